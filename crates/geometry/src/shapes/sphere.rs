//! Unit spheres: the tetrahedron and the subdivided icosahedron.

use cotan_halfedge::{HalfedgeMesh, VertexId};
use nalgebra::{Point3, Vector3};

use super::connect;
use crate::mesh::Mesh;
use crate::scalar::Scalar;

/// The regular tetrahedron with its corners on the unit sphere: 4 vertices.
#[must_use]
pub fn tetrahedron<T: Scalar>() -> Mesh<T> {
    let c = 1.0 / 3.0_f64.sqrt();
    let points = [[c, c, c], [c, -c, -c], [-c, c, -c], [-c, -c, c]].map(Point3::from);
    connect(&points, &[[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])
}

/// The unit sphere as an icosahedron whose triangles are split into four `subdivisions` times,
/// with the new vertices projected onto the sphere: 10·4^s + 2 vertices.
///
/// Angles stay between 52° and 72°, so cotangent weights are positive. At most 8 subdivisions
/// (655,362 vertices).
///
/// ```
/// let shape = cotan_geometry::icosphere::<f32>(2);
/// assert_eq!(shape.num_vertices(), 162);
/// ```
#[must_use]
pub fn icosphere<T: Scalar>(subdivisions: u32) -> Mesh<T> {
    let mut points = icosahedron_points();
    let mut faces = ICOSAHEDRON_FACES.to_vec();
    for _ in 0..subdivisions.min(MAX_SUBDIVISIONS) {
        let (mesh, _) = connect::<f64>(&points, &faces).into_parts();
        for e in mesh.edges() {
            let [a, b] = mesh.edge_vertices(e).map(|v| points[v.index()].coords);
            points.push(Point3::from((a + b).normalize()));
        }
        faces = split_in_four(&mesh);
    }
    connect(&points, &faces)
}

/// The faces after a new vertex (index n + e) has been inserted into each edge e.
fn split_in_four(mesh: &HalfedgeMesh) -> Vec<[u32; 3]> {
    let n = mesh.num_vertices();
    let number = |v: VertexId| v.index() as u32;
    let mut faces = Vec::with_capacity(4 * mesh.num_faces());
    for f in mesh.faces() {
        let h = mesh.face_halfedge(f);
        let around = [h, mesh.next(h), mesh.prev(h)];
        let middle = around.map(|h| (n + h.edge().index()) as u32);
        for k in 0..3 {
            // The origin of the k-th halfedge.
            faces.push([
                number(mesh.origin(around[k])),
                middle[k],
                middle[(k + 2) % 3],
            ]);
        }
        faces.push(middle);
    }
    faces
}

pub(super) fn icosahedron_points() -> Vec<Point3<f64>> {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut points = Vec::with_capacity(12);
    for (k, sign) in [
        (0, 1.0),
        (1, 1.0),
        (2, 1.0),
        (0, -1.0),
        (1, -1.0),
        (2, -1.0),
    ] {
        for other in [1.0, -1.0] {
            let mut p = Vector3::zeros();
            p[k] = sign * golden;
            p[(k + 1) % 3] = other;
            points.push(Point3::from(p.normalize()));
        }
    }
    points
}

/// Corners in the order of [`icosahedron_points`]: 2 k + … along +x, +y, +z, then −x, −y, −z.
pub(super) const ICOSAHEDRON_FACES: [[u32; 3]; 20] = [
    [0, 4, 1],
    [0, 1, 10],
    [0, 3, 2],
    [0, 2, 4],
    [0, 10, 3],
    [1, 4, 8],
    [1, 8, 9],
    [1, 9, 10],
    [2, 3, 6],
    [2, 5, 4],
    [2, 6, 5],
    [3, 11, 6],
    [3, 10, 11],
    [4, 5, 8],
    [5, 6, 7],
    [5, 7, 8],
    [6, 11, 7],
    [7, 9, 8],
    [7, 11, 9],
    [9, 11, 10],
];

/// Gives 655,362 vertices; one more subdivision takes gigabytes.
const MAX_SUBDIVISIONS: u32 = 8;
