//! Sphere maps for the tests of this module.

use cotan_geometry::{Mesh, icosphere};
use cotan_halfedge::HalfedgeMesh;
use nalgebra::{Point3, Vector3};

use super::error::SphereError;
use super::map::SphereMap;
use super::moebius;
use super::predicate::is_upright;

/// The unit sphere with all but a fraction `rest` of it pressed towards `axis` by a Möbius map.
pub(crate) fn squeezed(
    shape: &Mesh<f64>,
    axis: &Vector3<f64>,
    rest: f64,
) -> Result<SphereMap<f64>, SphereError> {
    let mut points: Vec<Vector3<f64>> = shape.positions().values().map(|p| p.coords).collect();
    moebius::apply(&mut points, &(axis * (1.0 - rest)));
    SphereMap::new(
        shape.connectivity(),
        points.into_iter().map(Point3::from).collect(),
    )
}

/// A sphere in which each face is split by a point placed `margin` times the smallest possible
/// distance from one of its edges: 320 faces, a third of them slivers.
pub(crate) fn splintered(margin: f64) -> Mesh<f64> {
    let shape = icosphere::<f64>(1);
    let mut points: Vec<Point3<f64>> = shape.positions().values().copied().collect();
    let mut faces = Vec::new();
    for f in shape.connectivity().faces() {
        let corners = shape.connectivity().triangle(f);
        let [a, b, c] = corners.map(|v| points[v.index()]);
        let middle = (a.coords + b.coords) * 0.5;
        let split = |h: f64| Point3::from((middle + (c.coords - middle) * h).normalize());
        let mut height = 1e-17;
        while !is_upright(&a, &b, &split(height)) {
            height *= 1.5;
        }
        let new = points.len() as u32;
        points.push(split(height * margin));
        let [a, b, c] = corners.map(|v| v.index() as u32);
        faces.extend([[a, b, new], [b, c, new], [c, a, new]]);
    }
    let mesh = HalfedgeMesh::from_faces(points.len(), &faces).expect("a split sphere");
    Mesh::new(mesh, points.into_iter().collect()).unwrap()
}
