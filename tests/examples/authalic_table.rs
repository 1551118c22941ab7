//! Prints the distortion of every closed genus-0 model for several positions of the slider
//! between angles and areas: seconds, flipped triangles, mean σ1/σ2 and mean |ln area ratio|.
//!
//! ```text
//! cargo run --release -p cotan-tests --example authalic_table [-- part of a model's name ... [N]]
//! ```
//!
//! A number N splits every face into four, N times.

use std::time::Instant;

use cotan::prelude::*;
use cotan::sphere::{RelaxSettings, SphereMap, embed, flipped_faces, relax, untangle};
use cotan_geometry::Scalar;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |a: &String| a.parse::<usize>().ok();
    let times = arguments.iter().find_map(number).unwrap_or(0);
    let wanted: Vec<&String> = arguments.iter().filter(|a| number(a).is_none()).collect();
    println!("| model | λ | type | seconds | flipped | σ1/σ2 | |ln area| |");
    println!("|---|---|---|---|---|---|---|");
    for name in MODELS {
        if !wanted.is_empty() && !wanted.iter().any(|w| name.contains(w.as_str())) {
            continue;
        }
        if let Some(model) = cotan_tests::model(name) {
            let (mut mesh, mut positions) = (model.mesh().clone(), model.positions().clone());
            for _ in 0..times {
                (mesh, positions) = subdivided(&mesh, &positions);
            }
            rows(
                &format!("{name}, {}", mesh.num_vertices()),
                &mesh,
                &positions,
            );
        }
    }
}

/// Splits every face into four.
fn subdivided(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> (HalfedgeMesh, Positions<f64>) {
    let n = mesh.num_vertices();
    let middle = |h: cotan::halfedge::HalfedgeId| (n + h.edge().index()) as u32;
    let faces = mesh.faces().flat_map(|f| {
        let sides: Vec<_> = mesh.face_halfedges(f).collect();
        let corner = |k: usize| mesh.origin(sides[k]).index() as u32;
        let mid = |k: usize| middle(sides[k]);
        [
            [corner(0), mid(0), mid(2)],
            [corner(1), mid(1), mid(0)],
            [corner(2), mid(2), mid(1)],
            [mid(0), mid(1), mid(2)],
        ]
    });
    let faces: Vec<[u32; 3]> = faces.collect();
    let midpoint = |e| {
        let [a, b] = mesh.edge_vertices(e);
        nalgebra::center(&positions[a], &positions[b])
    };
    let all = positions
        .values()
        .copied()
        .chain(mesh.edges().map(midpoint));
    let all: Positions<f64> = all.collect();
    let mesh = HalfedgeMesh::from_faces(all.len(), &faces).expect("subdivision keeps a manifold");
    (mesh, all)
}

fn rows(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>) {
    for balance in [1.0, 0.5, 0.0] {
        row::<f64>(name, mesh, positions, balance);
    }
    for balance in [1.0, 0.0] {
        row::<f32>(name, mesh, positions, balance);
    }
    relaxed(name, mesh, positions);
    tangled(name, mesh, positions);
}

fn row<T: Scalar>(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>, balance: f64) {
    let start = Instant::now();
    let sphere = match embed::<T>(mesh, positions, balance) {
        Ok(sphere) => sphere,
        Err(error) => return println!("| {name} | {balance} | {error} |"),
    };
    report(name, &balance.to_string(), mesh, positions, &sphere, start);
}

fn report<T: Scalar>(
    name: &str,
    balance: &str,
    mesh: &HalfedgeMesh,
    positions: &Positions<f64>,
    sphere: &Positions<T>,
    start: Instant,
) {
    let seconds = start.elapsed().as_secs_f64();
    let flipped = flipped_faces(mesh, sphere).len();
    let (angles, areas) = distortion(mesh, positions, sphere);
    let kind = std::any::type_name::<T>();
    println!(
        "| {name} | {balance} | {kind} | {seconds:.2} | {flipped} | {angles:.4} | {areas:.4} |"
    );
    if let Err(error) = SphereMap::new(mesh, sphere.clone()) {
        println!("{error}");
    }
}

/// Relaxes the nearly conformal map towards areas by [`relax`], not from scratch.
fn relaxed(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>) {
    let Ok(mut sphere) = embed::<f64>(mesh, positions, 0.0) else {
        return;
    };
    let start = Instant::now();
    if let Err(error) = relax(mesh, positions, &mut sphere, 1.0, &RelaxSettings::default()) {
        return println!("| {name} | relaxed | {error} |");
    }
    report(name, "0 to 1", mesh, positions, &sphere, start);
}

/// Swaps some vertices of the nearly conformal map and repairs it by [`untangle`].
fn tangled(name: &str, mesh: &HalfedgeMesh, positions: &Positions<f64>) {
    let Ok(mut sphere) = embed::<f64>(mesh, positions, 0.0) else {
        return;
    };
    for v in mesh.vertices().step_by(1000) {
        let near = mesh.one_ring(v).flat_map(|w| mesh.one_ring(w));
        if let Some(w) = near.filter(|&w| w != v).nth(v.index() / 1000 % 7) {
            let (at_v, at_w) = (sphere[v], sphere[w]);
            sphere[v] = at_w;
            sphere[w] = at_v;
        }
    }
    let before = flipped_faces(mesh, &sphere).len();
    let entangled = sphere.clone();
    let start = Instant::now();
    untangle(mesh, positions, &mut sphere);
    let moved = mesh
        .vertices()
        .filter(|&v| sphere[v] != entangled[v])
        .count();
    let what = format!("{before} flips, {moved} moved");
    report(name, &what, mesh, positions, &sphere, start);
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
        // A face without area has no ratio and no weight.
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
