//! Seconds, medians, and the lines of JSON that child processes print.

use std::collections::BTreeMap;
use std::time::Instant;

use cpu_time::ProcessTime;
use serde_json::{Map, Value, json};

/// Wall and processor seconds.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seconds {
    pub(crate) wall: f64,
    pub(crate) cpu: f64,
}

impl Seconds {
    /// The time that counts for this number of threads: processor time for one thread, because
    /// other processes disturb it least, and wall time for more.
    pub(crate) fn with(self, threads: usize) -> f64 {
        if threads == 1 { self.cpu } else { self.wall }
    }
}

impl std::ops::Add for Seconds {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            wall: self.wall + other.wall,
            cpu: self.cpu + other.cpu,
        }
    }
}

pub(crate) fn time<R>(work: impl FnOnce() -> R) -> (R, Seconds) {
    let (wall, cpu) = (Instant::now(), ProcessTime::now());
    let result = work();
    let seconds = Seconds {
        wall: wall.elapsed().as_secs_f64(),
        cpu: cpu.elapsed().as_secs_f64(),
    };
    (result, seconds)
}

/// The measurements of a child process: phases, each the median of its runs, and plain numbers.
#[derive(Default)]
pub(crate) struct Phases {
    runs: BTreeMap<&'static str, Vec<Seconds>>,
    numbers: BTreeMap<&'static str, f64>,
}

impl Phases {
    pub(crate) fn time<R>(&mut self, name: &'static str, work: impl FnOnce() -> R) -> R {
        let (result, seconds) = time(work);
        self.runs.entry(name).or_default().push(seconds);
        result
    }

    pub(crate) fn number(&mut self, name: &'static str, value: f64) {
        self.numbers.insert(name, value);
    }

    pub(crate) fn to_json(&self) -> Value {
        let mut object = Map::new();
        for (name, runs) in &self.runs {
            let s = medians(runs);
            object.insert((*name).into(), json!([s.wall, s.cpu]));
        }
        for (name, value) in &self.numbers {
            object.insert((*name).into(), json!(value));
        }
        Value::Object(object)
    }
}

pub(crate) fn medians(runs: &[Seconds]) -> Seconds {
    Seconds {
        wall: median(runs.iter().map(|s| s.wall)),
        cpu: median(runs.iter().map(|s| s.cpu)),
    }
}

pub(crate) fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The lines of all rounds, by the name of the program that was measured.
#[derive(Default)]
pub(crate) struct Results {
    pub(crate) num_vertices: usize,
    lines: BTreeMap<String, Vec<Value>>,
}

impl Results {
    pub(crate) fn new(num_vertices: usize) -> Self {
        Self {
            num_vertices,
            ..Self::default()
        }
    }

    pub(crate) fn push(&mut self, name: &str, line: Value) {
        self.lines.entry(name.into()).or_default().push(line);
    }

    /// The median of a program's phase over the rounds, or `None` if it was not measured.
    pub(crate) fn seconds(&self, name: &str, phase: &str) -> Option<Seconds> {
        let lines = self.lines.get(name)?;
        let runs: Option<Vec<Seconds>> = lines
            .iter()
            .map(|line| {
                let pair = line.get(phase)?.as_array()?;
                Some(Seconds {
                    wall: pair.first()?.as_f64()?,
                    cpu: pair.get(1)?.as_f64()?,
                })
            })
            .collect();
        Some(medians(&runs?))
    }

    pub(crate) fn number(&self, name: &str, key: &str) -> Option<f64> {
        let lines = self.lines.get(name)?;
        let numbers: Option<Vec<f64>> = lines.iter().map(|line| line.get(key)?.as_f64()).collect();
        Some(median(numbers?.into_iter()))
    }

    pub(crate) fn into_lines(self) -> impl Iterator<Item = String> {
        let n = self.num_vertices;
        self.lines.into_iter().flat_map(move |(name, lines)| {
            lines.into_iter().map(move |line| {
                json!({ "who": name, "vertices": n, "measured": line }).to_string()
            })
        })
    }
}
