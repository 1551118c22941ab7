//! Maps arbitrary meshes with arbitrary positions to the sphere.

use cotan::prelude::*;
use cotan::sphere::{SphereError, SphereOptions, spherical};

use super::draw::Draw;
use super::halfedge::{edit, start};

/// Checks that every triangulated topological sphere is mapped without a flip, whatever its
/// shape, and that everything else is refused with the reason.
pub fn sphere(data: &[u8]) {
    let mut draw = Draw::new(data);
    let options = SphereOptions::default()
        .scheme(SchemeKind::ALL[draw.below(SchemeKind::ALL.len())])
        .authalic([0.0, 0.0, 0.5, 1.0][draw.below(4)])
        .iteration_limit(20);
    let is_single = draw.below(2) == 1;
    let mut mesh = start(&mut draw);
    for _ in 0..draw.below(40) {
        if mesh.num_faces() == 0 {
            return;
        }
        // A refused edit changes nothing.
        let _ = edit(&mut draw, &mut mesh);
    }
    if mesh.num_vertices() > 300 || mesh.num_faces() == 0 {
        return;
    }
    let point = |draw: &mut Draw<'_>| Point3::new(draw.real(), draw.real(), draw.real());
    let positions: Positions<f64> = mesh.vertices().map(|_| point(&mut draw)).collect();
    if is_single {
        map(&mesh, &positions.map(|p| p.map(|x| x as f32)), &options);
    } else {
        map(&mesh, &positions, &options);
    }
}

fn map<T: Scalar>(mesh: &HalfedgeMesh, positions: &Positions<T>, options: &SphereOptions) {
    let is_finite = positions.values().all(|p| p.iter().all(|x| x.is_finite()));
    let is_sphere = mesh.components().count() == 1
        && mesh.num_faces() >= 4
        && mesh.is_triangle_mesh()
        && mesh.is_closed()
        && mesh.genus() == 0;
    match spherical(Surface::assume_checked(mesh, positions), options) {
        Ok(done) => {
            assert!(is_sphere && is_finite);
            assert_eq!(done.map.degree().round(), 1.0);
        }
        Err(error @ (SphereError::Flipped { .. } | SphereError::Degree { .. })) => {
            panic!(
                "a sphere was not mapped: {error}, {} vertices, {options:?}",
                mesh.num_vertices()
            )
        }
        Err(error) => assert!(!is_sphere || !is_finite, "{error}"),
    }
}
