//! Measures the intrinsic Delaunay triangulation and the distances that the heat method finds on
//! it, beside those on the mesh's own triangles.
//!
//! `cargo run --release -p cotan-tests --example distance_table -- [PART of a name] [--save
//! FOLDER]`
//!
//! A distance is impossible if it is shorter than the straight line in space or longer than the
//! shortest path along edges, by more than 1 % of the greatest distance. `--save` writes the
//! triangles and distances as text, for `scripts/distances.py`.

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;
use std::time::Instant;

use cotan::geometry::{face_area_vector, triangle_cotangents};
use cotan::laplacian::{Cotangent, IntrinsicDelaunay, Operator};
use cotan::linear::LinearSystem;
use cotan::prelude::*;
use cotan::surface::{EdgePaths, GeodesicDistances};
use cotan_tests::model;

const MODELS: [&str; 11] = [
    "spot.obj",
    "fandisk.obj",
    "fandisk_noisy.obj",
    "cartoon_elephant.obj",
    "dinosaur.obj",
    "venus_33587_derived.ply",
    "venus_50002.off",
    "armadillo.ply",
    "brain.ply",
    "igea.ply",
    "tray_bottom.stl",
];

const RUNS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let (mut part, mut folder) = (String::new(), None);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--save" => folder = words.next().map(PathBuf::from),
            _ => part = word,
        }
    }
    println!(
        "| mesh | vertices | flips | negative weights | operator, cotangent | intrinsic | prepare | \
         solve | impossible, intrinsic | cotangent |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for name in MODELS.iter().filter(|name| name.contains(&part)) {
        let Some(processing) = model(name) else {
            continue;
        };
        let surface = Surface::new(processing.mesh(), processing.positions())?;
        let source = VertexId::new(0);
        let row = measure(&surface, source)?;
        println!(
            "| {name} | {} | {} |",
            surface.mesh().num_vertices(),
            row.text
        );
        if let Some(folder) = &folder {
            let text = save(&surface, &row.distances)?;
            std::fs::write(folder.join(format!("{name}.txt")), text)?;
        }
    }
    Ok(())
}

struct Row {
    text: String,
    distances: VertexMap<f64>,
}

fn measure(surface: &Surface<'_, f64>, source: VertexId) -> Result<Row, Box<dyn Error>> {
    // Interleaved, since other programs may run.
    let (mut of_cotangent, mut of_intrinsic) = (Vec::new(), Vec::new());
    for _ in 0..RUNS {
        let clock = Instant::now();
        let _: Operator<f64> = Operator::assemble(&Cotangent::default(), surface)?;
        of_cotangent.push(clock.elapsed().as_secs_f64());
        let clock = Instant::now();
        let _: Operator<f64> = Operator::assemble(&IntrinsicDelaunay::default(), surface)?;
        of_intrinsic.push(clock.elapsed().as_secs_f64());
    }
    let cotangent = Operator::assemble(&Cotangent::default(), surface)?;
    let negative = cotangent.weights().iter().filter(|w| **w < 0.0).count() / 2;
    let clock = Instant::now();
    let prepared = GeodesicDistances::new(*surface)?;
    let preparing = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let distances = prepared.from_vertices(&[source])?;
    let solving = clock.elapsed().as_secs_f64();
    let on_mesh = heat_on_the_mesh(surface, &cotangent, source, prepared.time());
    let beside = match on_mesh {
        Ok(distances) => impossible(surface, source, &distances).to_string(),
        Err(error) => error.to_string(),
    };
    let text = format!(
        "{} | {negative} | {:.1} ms | {:.1} ms | {:.0} ms | {:.1} ms | {} | {beside}",
        prepared.num_flips(),
        1e3 * median(of_cotangent),
        1e3 * median(of_intrinsic),
        1e3 * preparing,
        1e3 * solving,
        impossible(surface, source, &distances),
    );
    Ok(Row { text, distances })
}

/// The number of vertices with an impossible distance.
fn impossible(surface: &Surface<'_, f64>, source: VertexId, found: &VertexMap<f64>) -> usize {
    let paths = EdgePaths::from(*surface, &[source]);
    let along = paths.distances();
    let finite = along.values().filter(|d| d.is_finite());
    let slack = 0.01 * finite.fold(0.0_f64, |m, d| m.max(*d));
    let from = surface.position(source);
    let is_wrong = |(v, d): &(VertexId, &f64)| {
        let straight = (surface.position(*v) - from).norm();
        along[*v].is_finite() && !(**d >= straight - slack && **d <= along[*v] + slack)
    };
    found.iter().filter(is_wrong).count()
}

/// The heat method with the cotangent weights of the mesh's own triangles.
fn heat_on_the_mesh(
    surface: &Surface<'_, f64>,
    operator: &Operator<f64>,
    source: VertexId,
    time: f64,
) -> Result<VertexMap<f64>, Box<dyn Error>> {
    let mesh = surface.mesh();
    let masses = surface.dual_areas().map(|area| 2.0 * area / time);
    let mut heat = VertexMap::filled(mesh.num_vertices(), 0.0);
    heat[source] = 1.0;
    let heat = LinearSystem::screened(operator, masses.as_slice(), &[])?.solve(&heat);
    let mut given = VertexMap::filled(mesh.num_vertices(), 0.0);
    for f in mesh.faces() {
        let v = mesh.triangle(f);
        let p = v.map(|v| surface.position(v));
        let cot = triangle_cotangents(&p[0], &p[1], &p[2]);
        let normal = face_area_vector(surface, f);
        let edge = |from: usize, to: usize| p[to % 3] - p[from % 3];
        let slope = |k: usize| normal.cross(&edge(k + 1, k + 2)) * heat[v[k]];
        let slope = slope(0) + slope(1) + slope(2);
        let away = slope * -1.0 / slope.norm().max(f64::MIN_POSITIVE);
        for k in 0..3 {
            let (next, last) = (edge(k, k + 1).dot(&away), edge(k, k + 2).dot(&away));
            given[v[k]] -= cot[(k + 2) % 3] * next + cot[(k + 1) % 3] * last;
        }
    }
    let components = mesh.components();
    let mut is_new = vec![true; components.count()];
    is_new[components.of(source)] = false;
    let mut pins = vec![source];
    pins.extend(
        mesh.vertices()
            .filter(|v| std::mem::take(&mut is_new[components.of(*v)])),
    );
    pins.iter().for_each(|v| given[*v] = 0.0);
    Ok(LinearSystem::poisson(operator, &pins)?.solve(&given))
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Vertices with their distances from vertex 0, then triangles.
fn save(surface: &Surface<'_, f64>, distances: &VertexMap<f64>) -> Result<String, std::fmt::Error> {
    let mut text = String::new();
    for (v, d) in distances.iter() {
        let p = surface.position(v);
        writeln!(text, "v {} {} {} {d}", p.x, p.y, p.z)?;
    }
    for f in surface.mesh().faces() {
        let [a, b, c] = surface.mesh().triangle(f).map(|v| v.index());
        writeln!(text, "f {a} {b} {c}")?;
    }
    Ok(text)
}
