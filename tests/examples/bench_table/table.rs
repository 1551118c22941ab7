//! The ratios for one size as a Markdown table.

use std::fmt::Write as _;

use crate::comparison::{PEER_ITERATIONS, ours_name};
use crate::measured::Results;
use crate::ours::{HYBRID, ORIENTATIONS, THIN};

/// A row: our figure over theirs, and the upper bound for the ratio.
struct Row {
    what: String,
    ours: Option<f64>,
    others: Option<f64>,
    most: f64,
}

pub(crate) fn of_size(results: &Results, threads: usize) -> String {
    let clock = if threads == 1 { "processor" } else { "wall" };
    let mut out = format!(
        "## {} vertices, {threads} thread(s) of ours, {clock} seconds\n\n",
        results.num_vertices
    );
    out += "| what | ours | theirs | ratio | at most | |\n|---|---|---|---|---|---|\n";
    for row in rows(&Figures { results, threads }) {
        let Row {
            what,
            ours,
            others,
            most,
        } = row;
        match (ours, others) {
            (Some(ours), Some(others)) => {
                let ratio = ours / others;
                let verdict = if ratio <= most { "yes" } else { "no" };
                let _ = writeln!(
                    out,
                    "| {what} | {ours:.3e} | {others:.3e} | {ratio:.3} | {most:.2} | {verdict} |"
                );
            }
            _ => {
                let _ = writeln!(out, "| {what} | – | – | – | {most:.2} | not measured |");
            }
        }
    }
    out + "\n" + &facts(results, threads) + "\n"
}

struct Figures<'a> {
    results: &'a Results,
    threads: usize,
}

impl Figures<'_> {
    fn ours(&self, handles: &str, orientation: &str, phase: &str) -> Option<f64> {
        let name = ours_name(handles, orientation, self.threads);
        self.phase(&name, phase)
    }

    fn ours_number(&self, handles: &str, orientation: &str, key: &str) -> Option<f64> {
        self.results
            .number(&ours_name(handles, orientation, self.threads), key)
    }

    fn phase(&self, name: &str, phase: &str) -> Option<f64> {
        Some(self.results.seconds(name, phase)?.with(self.threads))
    }

    /// Order + symbolic + numeric of CHOLMOD, with the better of its orderings.
    fn cholmod(&self, matrix: &str) -> Option<f64> {
        let factor = |ordering| {
            let name = format!("CHOLMOD {matrix} {ordering}");
            Some(self.phase(&name, "analyse")? + self.phase(&name, "numeric")?)
        };
        Some(factor("amd")?.min(factor("metis")?))
    }

    fn per_iteration(&self, name: &str) -> Option<f64> {
        Some(self.phase(name, "iterations")? / PEER_ITERATIONS as f64)
    }

    fn whole(&self, name: &str) -> Option<f64> {
        let build = self.phase(name, "build").unwrap_or(0.0);
        Some(build + self.phase(name, "preprocess")? + self.phase(name, "iterations")?)
    }
}

fn rows(figures: &Figures<'_>) -> Vec<Row> {
    let mut rows = Vec::new();
    let mut row = |what: String, ours: Option<f64>, others: Option<f64>, most: f64| {
        rows.push(Row {
            what,
            ours,
            others,
            most,
        });
    };
    for (orientation, libigl, cgal) in [("rotation", 0.25, 0.1), ("hybrid", 0.4, 1.0 / 6.0)] {
        let points = |phase| figures.ours("points", orientation, phase);
        let prepare = points("prepare");
        let factor = points("factor");
        row(
            format!("1 {orientation}: factor / CHOLMOD AᵀA"),
            factor,
            figures.cholmod("AtA"),
            0.25,
        );
        row(
            format!("1 {orientation}: factor and columns of 32 handles / CHOLMOD AᵀA"),
            prepare,
            figures.cholmod("AtA"),
            0.25,
        );
        if orientation == "rotation" {
            row(
                format!("1 {orientation}: factor / CHOLMOD L"),
                factor,
                figures.cholmod("L"),
                0.6,
            );
        }
        row(
            format!("2 {orientation}: change 1 of 32 handles / factor"),
            points("change a handle"),
            factor,
            0.05,
        );
        row(
            format!("2 {orientation}: change 1 of 32 handles / solve"),
            points("change a handle"),
            points("solve"),
            2.0,
        );
        row(
            format!("3 {orientation}: solve / faer's, as many factors of L"),
            points("solve"),
            points("faer solve").map(|s| s * if orientation == "hybrid" { 2.0 } else { 1.0 }),
            0.5,
        );
        let number = |key| figures.ours_number("points", orientation, key);
        let bus = number("factor_bytes")
            .zip(number("bandwidth"))
            .map(|(b, w)| 2.0 * b / w);
        row(
            format!("3 {orientation}: solve / factor read twice"),
            points("solve"),
            bus,
            2.5,
        );
        let iteration = points("iteration");
        row(
            format!("4 {orientation}: iteration / solve"),
            iteration,
            points("solve"),
            2.0,
        );
        row(
            format!("4 {orientation}: iteration / libigl's"),
            iteration,
            figures.per_iteration("libigl points"),
            libigl,
        );
        row(
            format!("4 {orientation}: iteration / CGAL's"),
            iteration,
            figures.per_iteration("CGAL points"),
            cgal,
        );
        for handles in ["points", "regions"] {
            let job = figures.ours(handles, orientation, "job");
            for name in ["libigl", "CGAL"] {
                let whole = figures.whole(&format!("{name} {handles}"));
                row(
                    format!(
                        "5 {orientation}: job, {handles} / {name}'s {PEER_ITERATIONS} iterations"
                    ),
                    job,
                    whole,
                    1.0,
                );
            }
        }
        let regions = |phase| figures.ours("regions", orientation, phase);
        row(
            format!("6 {orientation}: prepare, regions / libigl's"),
            regions("prepare"),
            figures.phase("libigl regions", "preprocess"),
            1.0,
        );
        row(
            format!("6 {orientation}: iteration, regions / libigl's"),
            regions("iteration"),
            figures.per_iteration("libigl regions"),
            libigl,
        );
        row(
            format!("6 {orientation}: iteration, regions / CGAL's"),
            regions("iteration"),
            figures.per_iteration("CGAL regions"),
            cgal,
        );
    }
    for handles in ["points", "regions"] {
        let [thin, solid] =
            [THIN, HYBRID].map(|method| move |phase| figures.ours(handles, method, phase));
        for (phase, most) in [("iteration", 1.25), ("job", f64::INFINITY)] {
            row(
                format!("7 solid body: {phase}, {handles} / thin shell's"),
                solid(phase),
                thin(phase),
                most,
            );
        }
    }
    rows
}

/// The figures behind the ratios, in seconds.
fn facts(results: &Results, threads: usize) -> String {
    let mut out = String::new();
    let figures = Figures { results, threads };
    let mut line = |name: String, phases: &[&str], numbers: &[&str]| {
        let mut words = Vec::new();
        for phase in phases {
            if let Some(seconds) = figures.phase(&name, phase) {
                words.push(format!("{phase} {seconds:.4}"));
            }
        }
        for key in numbers {
            if let Some(number) = results.number(&name, key) {
                words.push(format!("{key} {number:.3e}"));
            }
        }
        if !words.is_empty() {
            let _ = writeln!(out, "- {name}: {}", words.join(", "));
        }
    };
    for handles in ["points", "regions"] {
        for orientation in ORIENTATIONS.into_iter().chain([THIN]) {
            line(
                ours_name(handles, orientation, threads),
                &[
                    "connectivity",
                    "prepare",
                    "change a handle",
                    "solve",
                    "iteration",
                    "job",
                    "faer prepare",
                    "faer solve",
                ],
                &[
                    "num_iterations",
                    "converged",
                    "factor_bytes",
                    "faer factor_bytes",
                    "bandwidth",
                    "megabytes",
                ],
            );
        }
    }
    for matrix in ["L", "AtA"] {
        for ordering in ["amd", "metis"] {
            let name = format!("CHOLMOD {matrix} {ordering}");
            line(
                name,
                &["analyse", "numeric", "solve"],
                &["entries", "megabytes"],
            );
        }
    }
    for name in [
        "libigl points",
        "libigl regions",
        "CGAL points",
        "CGAL regions",
        "potpourri3d",
    ] {
        line(
            name.into(),
            &["build", "preprocess", "iterations", "cotmatrix"],
            &["num_iterations", "megabytes"],
        );
    }
    out
}
