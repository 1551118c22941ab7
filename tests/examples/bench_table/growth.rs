//! The growth of time and memory with the number of vertices.

use std::error::Error;
use std::fmt::Write as _;
use std::path::Path;

use crate::comparison::{ours_name, run_ours};
use crate::job::Jobs;
use crate::measured::Results;
use crate::options::Options;
use crate::ours;

pub(crate) struct Growth {
    sizes: Vec<Results>,
}

pub(crate) fn run(folder: &Path, options: &Options) -> Result<Growth, Box<dyn Error>> {
    let mut sizes = Vec::new();
    for &size in &options.growth {
        let jobs = Jobs::write(folder, size, options.numbering)?;
        let mut results = Results::new(jobs.num_vertices);
        for round in 1..=options.rounds {
            eprintln!(
                "growth, {} vertices: round {round} of {}",
                jobs.num_vertices, options.rounds
            );
            for orientation in ours::ORIENTATIONS {
                if let Some(line) = run_ours(&jobs.points, orientation, 1) {
                    results.push(&ours_name("points", orientation, 1), line);
                }
            }
        }
        for path in [&jobs.points, &jobs.regions] {
            std::fs::remove_file(path)?;
        }
        sizes.push(results);
    }
    Ok(Growth { sizes })
}

impl Growth {
    pub(crate) fn into_lines(self) -> impl Iterator<Item = String> {
        self.sizes.into_iter().flat_map(Results::into_lines)
    }
}

pub(crate) fn table(growth: &Growth) -> String {
    let mut out = String::from("## Growth, one thread, processor seconds\n\n| what |");
    for results in &growth.sizes {
        let _ = write!(out, " {} |", results.num_vertices);
    }
    out += " exponent | at most | |\n|---|";
    out += &"---|".repeat(growth.sizes.len() + 3);
    out.push('\n');
    for orientation in ours::ORIENTATIONS {
        for (what, most) in [("prepare", 1.35), ("iteration", 1.1), ("megabytes", 1.1)] {
            let name = ours_name("points", orientation, 1);
            let values: Vec<Option<f64>> = growth
                .sizes
                .iter()
                .map(|results| match what {
                    "megabytes" => results.number(&name, what),
                    phase => Some(results.seconds(&name, phase)?.cpu),
                })
                .collect();
            let _ = write!(out, "| {orientation}: {what} |");
            for value in &values {
                let cell = value.map_or("–".into(), |v| format!("{v:.3}"));
                let _ = write!(out, " {cell} |");
            }
            let sizes = growth.sizes.iter().map(|r| r.num_vertices as f64);
            let points: Vec<(f64, f64)> = sizes
                .zip(values)
                .filter_map(|(n, v)| Some((n.ln(), v?.ln())))
                .collect();
            let exponent = slope(&points);
            let verdict = if exponent <= most { "yes" } else { "no" };
            let _ = writeln!(out, " {exponent:.2} | {most:.2} | {verdict} |");
        }
    }
    out + "\n"
}

/// The slope of the least-squares line.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let above: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
    let below: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
    above / below
}
