//! Measures the cost of scattered vertex numbering and the benefit of a spatial order.
//!
//! `cargo run --release -p cotan-tests --example numbering_speed -- [VERTICES or MESH]...`
//!
//! A mesh file is measured with its own numbering and with a shuffled one; a number of vertices
//! stands for a randomly numbered irregular blob. Prints medians in processor seconds.

use std::error::Error;
use std::hint::black_box;

use cotan::flow::BestRotation;
use cotan::laplacian::{Cotangent, Operator};
use cotan::prelude::*;
use cotan::shapes::{VertexOrder, irregular};
use cotan_io::{Document, FaceList, Numbering, Weld};
use cpu_time::ProcessTime;

const RUNS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    if words.is_empty() {
        words = vec!["100000".into(), "655362".into()];
    }
    println!("| mesh | numbers | order found | load | build | weights | normals | iteration |");
    println!("|---|---|---|---|---|---|---|---|");
    for word in &words {
        match word.parse::<usize>() {
            Ok(size) => {
                for (order, name) in [
                    (VertexOrder::Natural, "natural"),
                    (VertexOrder::Random, "random"),
                ] {
                    let shape = irregular::<f64>(size, order, 6);
                    let document = Document::from_mesh(shape.connectivity(), shape.positions())?;
                    report(
                        &format!("{} vertices, {name}", shape.positions().len()),
                        &document,
                    )?;
                }
            }
            Err(_) => {
                let document = cotan_io::load(word)?;
                report(word, &document)?;
                report(&format!("{word}, shuffled"), &shuffled(&document)?)?;
            }
        }
    }
    Ok(())
}

fn report(name: &str, document: &Document) -> Result<(), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("mesh.ply");
    cotan_io::save(document, &path)?;
    let load = median(|| cotan_io::load(&path).map(drop))?;
    let document = cotan_io::load(&path)?;
    let found = document.surface()?.is_renumbered();
    for numbering in [Numbering::Document, Numbering::Spatial] {
        let build_once = || document.surface_numbered(Weld::AsFormat, numbering);
        let build = median(|| build_once().map(drop))?;
        let built = build_once()?;
        let surface = Surface::new(built.mesh(), built.positions())?;
        let weights = median(|| Operator::assemble(&Cotangent::default(), &surface).map(drop))?;
        let normals = median(|| {
            black_box(surface.vertex_normals());
            Ok::<_, Box<dyn Error>>(())
        })?;
        let held = [0, document.positions().len() / 2].map(|v| built.vertex(v));
        let [fixed, moved] = held.map(|v| v.unwrap_or(VertexId::new(0)));
        let at = |v: VertexId| (Handle::hard(v), built.positions()[v]);
        let mut flow = Flow::builder(built.mesh(), built.positions())
            .handles([at(fixed), at(moved)])
            .orientation(BestRotation::new())
            .tolerance(0.0)
            .build()?;
        flow.move_handles(&[(moved, built.positions()[moved] * 1.2)])?;
        flow.step()?;
        let iteration = median(|| flow.step().map(drop))?;
        println!(
            "| {name} | {numbering:?} | {} | {load:.4} | {build:.4} | {weights:.4} | {normals:.4} | {iteration:.4} |",
            if found { "scattered" } else { "good" }
        );
    }
    Ok(())
}

/// The same surface with its vertices and faces in random order.
fn shuffled(document: &Document) -> Result<Document, Box<dyn Error>> {
    let order = permutation(document.positions().len() as u64);
    let mut number = vec![0; order.len()];
    for (k, &v) in order.iter().enumerate() {
        number[v] = k as u32;
    }
    let positions = order.iter().map(|&v| document.positions()[v]).collect();
    let faces: FaceList = permutation(document.faces().len() as u64)
        .into_iter()
        .filter_map(|f| document.faces().get(f))
        .map(|face| face.iter().map(|&v| number[v as usize]).collect::<Vec<_>>())
        .collect();
    Ok(Document::new(positions, faces)?)
}

fn permutation(len: u64) -> Vec<usize> {
    let mut keyed: Vec<(u64, usize)> = (0..len)
        .map(|i| {
            (
                i.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29) ^ (i << 7),
                i as usize,
            )
        })
        .map(|(key, i)| (key.wrapping_mul(0xbf58_476d_1ce4_e5b9), i))
        .collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, i)| i).collect()
}

fn median<E>(mut work: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
    let mut runs = Vec::new();
    for _ in 0..RUNS {
        let clock = ProcessTime::now();
        work()?;
        runs.push(clock.elapsed().as_secs_f64());
    }
    runs.sort_by(f64::total_cmp);
    Ok(runs[RUNS / 2])
}
