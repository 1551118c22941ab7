//! Prints what the embedding with the slider between angles and areas does to every closed
//! genus-0 model: seconds, flipped triangles, mean σ1/σ2 and mean |ln area ratio|.
//!
//! ```text
//! cargo run --release -p cotan-tests --example authalic_table [-- part of a model's name ...]
//! ```

use std::time::Instant;

use cotan::prelude::*;
use cotan::sphere::{SphereMap, embed, flipped_faces};
use cotan_geometry::Scalar;

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    println!("| model | λ | type | seconds | flipped | σ1/σ2 | |ln area| |");
    println!("|---|---|---|---|---|---|---|");
    for name in MODELS {
        if !wanted.is_empty() && !wanted.iter().any(|w| name.contains(w.as_str())) {
            continue;
        }
        let Some(model) = cotan_tests::model(name) else {
            continue;
        };
        let (mesh, positions) = (model.mesh(), model.positions());
        for balance in [1.0, 0.5, 0.0] {
            row::<f64>(name, mesh, positions, balance);
        }
        row::<f32>(name, mesh, positions, 1.0);
    }
}

fn row<T: Scalar>(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>, balance: f64) {
    let start = Instant::now();
    let sphere = match embed::<T>(mesh, positions, balance) {
        Ok(sphere) => sphere,
        Err(error) => return println!("| {name} | {balance} | {error} |"),
    };
    let seconds = start.elapsed().as_secs_f64();
    let flipped = flipped_faces(mesh, &sphere).len();
    let (angles, areas) = distortion(mesh, positions, &sphere);
    let kind = std::any::type_name::<T>();
    println!(
        "| {name} | {balance} | {kind} | {seconds:.2} | {flipped} | {angles:.4} | {areas:.4} |"
    );
    if let Err(error) = SphereMap::new(mesh, sphere) {
        println!("{error}");
    }
}

/// The means over the source's area of σ1/σ2 and of |ln((Ω/4π) / (A/ΣA))|.
fn distortion<T: Scalar>(
    mesh: &HalfedgeMesh,
    source: &Positions<f64>,
    sphere: &Positions<T>,
) -> (f64, f64) {
    let sphere: Positions<f64> = sphere.map(|p| p.map(T::as_f64));
    let area = |[a, b, c]: [Point3<f64>; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
    let total: f64 = mesh
        .faces()
        .map(|f| area(mesh.triangle(f).map(|v| source[v])))
        .sum();
    let map = SphereMap::new(mesh, sphere.clone()).ok();
    let (mut angles, mut areas) = (0.0, 0.0);
    for f in mesh.faces() {
        let (rest, image) = (
            mesh.triangle(f).map(|v| source[v]),
            mesh.triangle(f).map(|v| sphere[v]),
        );
        let share = area(rest) / total;
        // A face without area has no ratio, and no weight.
        if !(share > 1e-15) {
            continue;
        }
        let solid = map
            .as_ref()
            .map_or_else(|| area(image), |m| m.solid_angle(f));
        areas += share * (solid / (4.0 * std::f64::consts::PI) / share).ln().abs();
        angles += share * singular_ratio(rest, image);
    }
    (angles, areas)
}

/// σ1/σ2 of the affine map between two triangles.
fn singular_ratio([a, b, c]: [Point3<f64>; 3], [x, y, z]: [Point3<f64>; 3]) -> f64 {
    let flat = |u: Vector3<f64>, v: Vector3<f64>| {
        let first = u.norm();
        let along = u.dot(&v) / first;
        nalgebra::Matrix2::new(first, along, 0.0, u.cross(&v).norm() / first)
    };
    let (rest, image) = (flat(b - a, c - a), flat(y - x, z - x));
    let Some(inverse) = rest.try_inverse() else {
        return 1.0;
    };
    let values = (image * inverse).singular_values();
    values.max() / values.min()
}

const MODELS: [&str; 10] = [
    "spot.obj",
    "fandisk.obj",
    "duck.glb",
    "cartoon_elephant.obj",
    "dinosaur.obj",
    "armadillo.ply",
    "brain.ply",
    "venus_50002.off",
    "venus_33587_derived.ply",
    "igea.ply",
];
