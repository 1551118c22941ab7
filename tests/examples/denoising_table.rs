//! Mean normal error after denoising, in degrees, method by method: the table of
//! `docs/decisions/2026-11-27-smoothing.md`.
//!
//! ```sh
//! cargo run --release -p cotan-tests --example denoising_table
//! ```

use std::time::Instant;

use cotan::prelude::*;
use cotan::smooth::{NormalError, SmoothMethod, SmoothOptions, smooth, with_normal_noise};
use cotan_tests::model;

/// Name, method and iterations of each column.
const COLUMNS: [(&str, SmoothMethod, Option<usize>); 8] = [
    ("auto", SmoothMethod::Auto, None),
    ("curvature", SmoothMethod::Curvature, None),
    ("anchored", SmoothMethod::Anchored, None),
    ("feature", SmoothMethod::Feature, None),
    ("edges", SmoothMethod::FeatureEdges, None),
    ("taubin 10", SmoothMethod::Taubin, Some(10)),
    ("taubin 50", SmoothMethod::Taubin, Some(50)),
    ("implicit", SmoothMethod::Implicit, None),
];

fn main() {
    print!("| mesh, noise | noisy |");
    COLUMNS.iter().for_each(|(name, ..)| print!(" {name} |"));
    println!("\n|---|---|{}", "---|".repeat(COLUMNS.len()));
    if let (Some(clean), Some(noisy)) = (model("fandisk.obj"), model("fandisk_noisy.obj")) {
        let rest = Surface::new(clean.mesh(), clean.positions()).expect("a surface");
        row("fandisk_noisy", &rest, noisy.positions());
    }
    for name in ["dinosaur.obj", "armadillo.ply", "spot.obj"] {
        let Some(mesh) = model(name) else { continue };
        let rest = Surface::new(mesh.mesh(), mesh.positions()).expect("a surface");
        for noise in [0.1, 0.2, 0.3] {
            let x = with_normal_noise(&rest, noise * rest.mean_edge_length(), 1);
            row(&format!("{name} {noise}"), &rest, &x);
        }
    }
    times();
}

/// Prints one line: errors in degrees, and the volume relative to that of the noisy mesh.
fn row(name: &str, clean: &Surface<'_, f64>, noisy: &Positions<f64>) {
    let error = |x: &Positions<f64>| NormalError::measure(clean, &clean.with_positions(x)).mean;
    print!("| {name} | {:.2} |", error(noisy));
    let before = clean.with_positions(noisy).volume();
    for (_, method, iterations) in COLUMNS {
        let options = SmoothOptions::default()
            .method(method)
            .iterations(iterations);
        let smoothed = smooth(
            Surface::assume_checked(clean.mesh(), noisy),
            &Handles::new(),
            &options,
        )
        .expect("models smooth");
        let ratio = clean.with_positions(&smoothed.positions).volume() / before;
        print!(" {:.2} ({ratio:.4}) |", error(&smoothed.positions));
    }
    println!();
}

/// Prints the time per iteration, from runs of two lengths, and for the whole job.
fn times() {
    println!("\n| mesh | method | ms an iteration | s in all |\n|---|---|---|---|");
    for name in ["dinosaur.obj", "igea.ply"] {
        let Some(mesh) = model(name) else { continue };
        for (label, method, _) in COLUMNS.iter().filter(|c| c.0 != "taubin 50") {
            let seconds = |iterations| {
                let options = SmoothOptions::default()
                    .method(*method)
                    .iterations(iterations);
                let clock = Instant::now();
                let result = smooth(mesh.surface(), &Handles::new(), &options);
                result.expect("models smooth");
                clock.elapsed().as_secs_f64()
            };
            let (few, many) = (seconds(Some(2)), seconds(Some(12)));
            let each = 100.0 * (many - few);
            println!("| {name} | {label} | {each:.1} | {:.2} |", seconds(None));
        }
    }
}
