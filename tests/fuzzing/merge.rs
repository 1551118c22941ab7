//! Joins random parts of two surfaces.

use cotan::geometry::Mesh;
use cotan::geometry::shapes::{VertexOrder, icosphere, irregular, torus};
use cotan::halfedge::FaceMap;
use cotan::merge::{FaceOrigin, MergeOptions, Placement, merge};
use cotan::prelude::*;

use super::draw::Draw;

/// Checks that what is joined is a closed surface with the predicted Euler characteristic, whose
/// faces come from where they are said to come from; everything else is refused with a reason.
pub fn merge_cuts(data: &[u8]) {
    let mut draw = Draw::new(data);
    let (a, keep_a) = part(&mut draw);
    let (b, keep_b) = part(&mut draw);
    let mut options = MergeOptions::default()
        .band(draw.below(6))
        .iterations(draw.below(4));
    if draw.below(2) == 1 {
        options = options.placement(Placement::Fit);
    }
    let Ok(merged) = merge(&a, &keep_a, &b, &keep_b, &options) else {
        return;
    };
    let mesh = merged.mesh.connectivity();
    mesh.validate().expect("a valid mesh");
    assert!(mesh.is_closed(), "both surfaces were closed");
    let kept = |of_a: bool| {
        let (source, faces) = (if of_a { &a } else { &b }, merged.faces.values());
        let own = faces.filter_map(|origin| match *origin {
            FaceOrigin::A(f) if of_a => Some(f),
            FaceOrigin::B(f) if !of_a => Some(f),
            _ => None,
        });
        let triangles: Vec<u32> = own
            .flat_map(|f| source.connectivity().triangle(f))
            .map(|v| v.index() as u32)
            .collect();
        let built = cotan::MeshBuilder::new()
            .drop_unused()
            .triangles::<f64, f64>(&source.to_positions::<f64>(), &triangles)
            .expect("a part of a surface is a surface");
        built.mesh.connectivity().euler_characteristic()
    };
    assert_eq!(mesh.euler_characteristic(), kept(true) + kept(false));
}

/// A closed surface, and random faces of it: a side of a plane, a ball, or noise.
fn part(draw: &mut Draw<'_>) -> (Mesh<f64>, FaceMap<bool>) {
    let shape = match draw.below(3) {
        0 => icosphere::<f64>(draw.below(4) as u32),
        1 => torus(1.0, 0.4, 12 + draw.below(12), 8 + draw.below(8)),
        _ => irregular(
            40 + draw.below(200),
            VertexOrder::Random,
            u64::from(draw.u32()),
        ),
    };
    let point = |draw: &mut Draw<'_>| Vector3::new(draw.real(), draw.real(), draw.real());
    let (normal, center, radius) = (point(draw), point(draw), draw.real());
    let kind = draw.below(3);
    let noise: Vec<u8> = (0..64).map(|_| draw.byte()).collect();
    let is_in = |v: VertexId| {
        let p = shape.positions()[v].coords;
        match kind {
            0 => p.dot(&normal) > radius / 16.0,
            1 => (p - center / 8.0).norm() < radius.abs() / 4.0,
            _ => noise[v.index() % 64] > 100,
        }
    };
    let mesh = shape.connectivity();
    let keep = FaceMap::from_fn(mesh.num_faces(), |f| mesh.face_vertices(f).all(is_in));
    (shape, keep)
}
