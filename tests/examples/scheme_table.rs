//! Compares the intrinsic Delaunay scheme with the cotangent scheme on meshes with slivers.
//!
//! `cargo run --release -p cotan-tests --example scheme_table -- [PART of a name]`
//!
//! For both schemes: the rounds of the map to the sphere and the flipped triangles after each, the
//! iterations of a deformation whose upper end is turned by 40° and lifted, and the seconds of
//! both; the entries of the operator, and the seconds of measuring the rest shape.

use std::error::Error;
use std::time::Instant;

use cotan::flow::Rest;
use cotan::prelude::*;
use cotan::shapes::cylinder;
use cotan::sphere::{SphereOptions, spherical};
use cotan_geometry::Mesh;
use cotan_tests::model;
use nalgebra::{Isometry3, Translation3};

const MODELS: [&str; 6] = [
    "cartoon_elephant.obj",
    "tray_bottom.stl",
    "fandisk.obj",
    "spot.obj",
    "dinosaur.obj",
    "camelhead.off",
];

const RUNS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let part = std::env::args().nth(1).unwrap_or_default();
    println!(
        "| mesh | scheme | sphere: flips | seconds | deform: iterations | seconds | entries | rest |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for name in MODELS.iter().filter(|name| name.contains(&part)) {
        if let Some(processing) = model(name) {
            let positions = processing.positions().clone();
            row(name, &Mesh::new(processing.mesh().clone(), positions)?)?;
        }
    }
    // As a CAD program writes a rod: every wall one pair of triangles from end to end.
    row("rod of 64 walls", &cylinder(0.2, 4.0, 64, 1))
}

fn row(name: &str, shape: &Mesh<f64>) -> Result<(), Box<dyn Error>> {
    for scheme in [SchemeKind::Cotangent, SchemeKind::IntrinsicDelaunay] {
        let clock = Instant::now();
        let mapped = spherical(shape, &SphereOptions::default().scheme(scheme));
        let seconds = clock.elapsed().as_secs_f64();
        let sphere = match mapped {
            Ok(map) => format!("{:?} | {seconds:.2}", map.report.flips),
            Err(_) => "no sphere | –".into(),
        };
        let options = DeformOptions::default().scheme(scheme);
        let clock = Instant::now();
        let deformed = deform(shape, &turned(shape), &options);
        let seconds = clock.elapsed().as_secs_f64();
        let bent = match deformed {
            Ok(bent) => format!(
                "{} ({:?}) | {seconds:.2}",
                bent.report.iterations, bent.report.stop
            ),
            Err(error) => format!("{error} | –"),
        };
        let (entries, rest) = cost(shape, scheme)?;
        println!(
            "| {name} | {} | {sphere} | {bent} | {entries} | {:.1} ms |",
            scheme.name(),
            1e3 * rest
        );
    }
    Ok(())
}

/// The lower tenth along the longest axis is fixed, the upper one turned and lifted.
fn turned(shape: &Mesh<f64>) -> Handles<f64> {
    let surface = shape.surface();
    let bounds = surface.bounding_box();
    let axis = bounds.extents().imax();
    let (low, size) = (bounds.min[axis], bounds.extents()[axis]);
    let share = |p: &Point3<f64>| (p[axis] - low) / size;
    let (mut side, mut lift) = (Vector3::zeros(), Vector3::zeros());
    side[(axis + 1) % 3] = 40.0_f64.to_radians();
    lift[(axis + 2) % 3] = 0.1 * size;
    let center = bounds.center().coords;
    let turn =
        Translation3::from(center + lift) * Isometry3::rotation(side) * Translation3::from(-center);
    Handles::new()
        .fix(surface.vertices_where(|p| share(p) < 0.1))
        .transform(
            surface.vertices_where(|p| share(p) > 0.9),
            turn.to_homogeneous(),
        )
}

/// The off-diagonal entries of the operator, and the median seconds of measuring the rest shape.
fn cost(shape: &Mesh<f64>, scheme: SchemeKind) -> Result<(usize, f64), Box<dyn Error>> {
    let mut seconds = Vec::new();
    let mut entries = 0;
    for _ in 0..RUNS {
        let clock = Instant::now();
        let rest = Rest::new(
            shape.connectivity().clone(),
            shape.positions(),
            scheme.scheme::<f64>(),
        )?;
        seconds.push(clock.elapsed().as_secs_f64());
        entries = rest.graph().num_entries();
    }
    seconds.sort_by(f64::total_cmp);
    Ok((entries, seconds[RUNS / 2]))
}
