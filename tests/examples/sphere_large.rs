//! Maps a subdivided model of more than a million vertices, and prints time and peak memory.
//!
//! ```text
//! cargo run --release -p cotan-tests --example sphere_large [-- SUBDIVISIONS [AUTHALIC]]
//! ```

use std::collections::HashMap;
use std::time::Instant;

use cotan::prelude::*;
use cotan::shapes::creature;
use cotan::sphere::{SphereOptions, SphereQuality, spherical};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let rounds: usize = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(3);
    let authalic: f64 = arguments.next().and_then(|x| x.parse().ok()).unwrap_or(0.0);
    let (mut mesh, mut positions) = creature::<f64>(110).into_parts();
    for _ in 0..rounds {
        (mesh, positions) = subdivide(&mesh, &positions);
    }
    println!("{} vertices, peak {}", positions.len(), peak());
    let clock = Instant::now();
    let options = SphereOptions::default().authalic(authalic);
    let done = spherical(Surface::assume_checked(&mesh, &positions), &options).expect("a map");
    let seconds = clock.elapsed().as_secs_f64();
    println!("{seconds:.1} s, peak {}, {:?}", peak(), done.report);
    let surface = Surface::new(&mesh, &positions).expect("a surface");
    println!("{:?}", SphereQuality::measure(&surface, &done.map));
}

/// Splits every triangle into four at the midpoints of its edges.
fn subdivide(mesh: &HalfedgeMesh, positions: &Positions<f64>) -> (HalfedgeMesh, Positions<f64>) {
    let mut points: Vec<Point3<f64>> = positions.values().copied().collect();
    let mut middle = HashMap::new();
    for e in mesh.edges() {
        let [a, b] = mesh.edge_vertices(e);
        middle.insert(e, points.len() as u32);
        points.push(nalgebra::center(&positions[a], &positions[b]));
    }
    let mut faces = Vec::with_capacity(4 * mesh.num_faces());
    for f in mesh.faces() {
        let sides: Vec<_> = mesh.face_halfedges(f).collect();
        let corner = |k: usize| mesh.origin(sides[k]).index() as u32;
        let half = |k: usize| middle[&sides[k].edge()];
        faces.push([half(0), half(1), half(2)]);
        faces.extend((0..3).map(|k| [corner(k), half(k), half((k + 2) % 3)]));
    }
    let mesh = HalfedgeMesh::from_faces(points.len(), &faces).expect("a finer mesh");
    (mesh, points.into_iter().collect())
}

/// The peak memory of the process, if the system reports it.
fn peak() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.map_or("unknown".into(), |line| {
        line.trim_start_matches("VmHWM:").trim().to_owned()
    })
}
