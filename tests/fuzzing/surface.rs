//! Chains of remeshing, decimation and subdivision on arbitrary meshes.

use cotan::halfedge::HalfedgeMesh;
use cotan::prelude::*;
use cotan::surface::{
    DecimateOptions, Features, RemeshOptions, SubdivideOptions, SubdivisionScheme, decimate,
    remesh, subdivide,
};

use super::draw::Draw;
use super::halfedge::{edit, start};

/// Checks that every step gives a valid mesh of the same topology or refuses.
pub fn surface_chain(data: &[u8]) {
    let mut draw = Draw::new(data);
    let mut connectivity = start(&mut draw);
    for _ in 0..draw.below(20) {
        if connectivity.num_faces() == 0 {
            return;
        }
        // A refused edit changes nothing.
        let _ = edit(&mut draw, &mut connectivity);
    }
    if connectivity.num_vertices() > 200 {
        return;
    }
    let point = |draw: &mut Draw<'_>| Point3::new(draw.real(), draw.real(), draw.real());
    let positions: Positions<f64> = connectivity.vertices().map(|_| point(&mut draw)).collect();
    let Ok(mut mesh) = Mesh::new(connectivity, positions) else {
        return;
    };
    let topology = topology(mesh.connectivity());
    while !draw.is_empty() && mesh.num_faces() < 4000 {
        let Some(next) = step(&mut draw, &mesh) else {
            continue;
        };
        if let Err(error) = next.connectivity().validate() {
            panic!("an invalid mesh: {error}");
        }
        assert_eq!(topology, self::topology(next.connectivity()));
        mesh = next;
    }
}

/// The mesh after one step; `None` if the step was refused.
fn step(draw: &mut Draw<'_>, mesh: &Mesh<f64>) -> Option<Mesh<f64>> {
    let surface = mesh.surface();
    let features = match draw.below(3) {
        0 => Features::none(),
        _ => Features::creases(draw.real()),
    };
    match draw.below(4) {
        0 => {
            let faces = mesh.num_faces() * draw.below(256) / 256;
            let options = DecimateOptions::to_faces(faces).features(features);
            Some(decimate(&surface, &options).ok()?.mesh)
        }
        1 => {
            let length = (0.4 + draw.real().abs().min(4.0)) * surface.mean_edge_length();
            let options = RemeshOptions::uniform(length).features(features);
            // Slivers as long as the whole mesh would need millions of triangles.
            let options = options
                .iterations(draw.below(4))
                .max_memory(Some(4_000_000));
            Some(remesh(&surface, &options).ok()?.mesh)
        }
        kind => {
            let schemes = [SubdivisionScheme::Loop, SubdivisionScheme::Midpoint];
            let options = SubdivideOptions::new(schemes[kind % 2]);
            let made = subdivide(mesh.connectivity(), mesh.positions(), &options).ok()?;
            Mesh::new(made.connectivity, made.positions).ok()
        }
    }
}

/// The Euler characteristic and the boundary loops of every component, sorted.
fn topology(mesh: &HalfedgeMesh) -> Vec<(i64, usize)> {
    let components = mesh.topology();
    let of = components
        .iter()
        .map(|c| (c.euler_characteristic(), c.num_boundary_loops));
    let mut topology: Vec<_> = of.collect();
    topology.sort_unstable();
    topology
}
