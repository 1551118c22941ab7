//! Prints the results of the methods of spherical parameterization for every closed genus-0
//! model.
//!
//! ```text
//! cargo run --release -p cotan-tests --example sphere_table [-- part of a model's name ...]
//! ```

use std::time::Instant;

use cotan::prelude::*;
use cotan::sphere::{SphereMethod, SphereOptions, SphereQuality, spherical};
use cotan_tests::{closed_models, model};

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!(
        "| model | vertices | method | iterations | factorizations | flips after each round | σ1/σ2 mean | p99 | mean abs ln area | sphericity | degree | seconds | stages |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for name in closed_models() {
        if !(wanted.is_empty() || wanted.iter().any(|w| name.contains(w.as_str()))) {
            continue;
        }
        let Some(mesh) = model(name) else { continue };
        // The other methods take minutes on the large models.
        let is_quick = std::env::var_os("QUICK").is_some();
        let robust = SphereOptions::default();
        row(name, "robust cotangent", &mesh, &robust);
        row_as::<f32>(name, "robust cotangent, f32", &mesh, &robust);
        let uniform = robust.clone().scheme(SchemeKind::Uniform);
        row(name, "robust uniform", &mesh, &uniform);
        for authalic in [0.5, 1.0] {
            let options = robust.clone().authalic(authalic);
            row(name, &format!("authalic {authalic}"), &mesh, &options);
        }
        if is_quick {
            continue;
        }
        let cmcf = robust.method(SphereMethod::Cmcf);
        row(name, "cmcf", &mesh, &cmcf);
        for scheme in [SchemeKind::Cotangent, SchemeKind::Tutte] {
            let options = SphereOptions::paper(scheme);
            row(name, &format!("paper {}", scheme.name()), &mesh, &options);
        }
    }
}

fn row(name: &str, method: &str, mesh: &cotan_io::ProcessingMesh, options: &SphereOptions) {
    row_as::<f64>(name, method, mesh, options);
}

fn row_as<T: Scalar>(
    name: &str,
    method: &str,
    mesh: &cotan_io::ProcessingMesh,
    options: &SphereOptions,
) {
    let positions = mesh.positions().map(|p| p.map(T::of_f64));
    let surface = Surface::new(mesh.mesh(), &positions).expect("a surface");
    let clock = Instant::now();
    let done = spherical(Surface::assume_checked(mesh.mesh(), &positions), options);
    let seconds = clock.elapsed().as_secs_f64();
    let n = positions.len();
    match done {
        Ok(done) => {
            let q = SphereQuality::measure(&surface, &done.map);
            let r = &done.report;
            let stages: Vec<&str> = r.stages.iter().map(|s| s.as_str()).collect();
            println!(
                "| {name} | {n} | {method} | {} | {} | {:?} | {:.4} | {:.4} | {:.4} | {:.1e} | {} | {seconds:.2} | {} |",
                r.iterations,
                r.factorizations,
                r.flips,
                q.conformal_distortion.mean,
                q.conformal_distortion.p99,
                q.area_distortion.mean,
                q.sphericity_error,
                q.degree,
                stages.join(", ")
            );
        }
        Err(error) => println!("| {name} | {n} | {method} | refused: {error} | {seconds:.2} |"),
    }
}
