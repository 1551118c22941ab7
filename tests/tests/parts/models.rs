//! Models of several parts, made by code, and their measures.

use cotan::prelude::*;

/// Several meshes as one, part after part.
pub(crate) fn together(parts: &[Mesh<f64>]) -> Mesh<f64> {
    let (mut points, mut faces) = (Vec::new(), Vec::new());
    for part in parts {
        let first = points.len() as u32;
        points.extend(part.positions().values().copied());
        let triangles = part.to_triangles();
        faces.extend(
            triangles
                .chunks_exact(3)
                .map(|t| [first + t[0], first + t[1], first + t[2]]),
        );
    }
    let mesh = HalfedgeMesh::from_faces(points.len(), &faces).unwrap();
    Mesh::new(mesh, points.into_iter().collect()).unwrap()
}

/// The part with this number by itself.
pub(crate) fn alone(shape: &Mesh<f64>, part: usize) -> (Mesh<f64>, Vec<VertexId>) {
    let components = shape.connectivity().components();
    let vertices: Vec<VertexId> = shape
        .connectivity()
        .vertices()
        .filter(|v| components.of(*v) == part)
        .collect();
    let mut number = vec![0; shape.num_vertices()];
    for (k, v) in vertices.iter().enumerate() {
        number[v.index()] = k as u32;
    }
    let mesh = shape.connectivity();
    let faces: Vec<[u32; 3]> = mesh
        .faces()
        .map(|f| mesh.triangle(f))
        .filter(|t| components.of(t[0]) == part)
        .map(|t| t.map(|v| number[v.index()]))
        .collect();
    let positions = vertices.iter().map(|v| shape.positions()[*v]).collect();
    let mesh = HalfedgeMesh::from_faces(vertices.len(), &faces).unwrap();
    (Mesh::new(mesh, positions).unwrap(), vertices)
}

/// The vertices of a part that satisfy a condition.
pub(crate) fn of_part(
    shape: &Mesh<f64>,
    part: usize,
    wanted: impl Fn(&Point3<f64>) -> bool,
) -> Vec<VertexId> {
    let components = shape.connectivity().components();
    let all = shape.connectivity().vertices();
    all.filter(|v| components.of(*v) == part && wanted(&shape.positions()[*v]))
        .collect()
}

/// The greatest distance between corresponding vertices.
pub(crate) fn farthest(a: &Positions<f64>, b: &Positions<f64>) -> f64 {
    let pairs = a.values().zip(b.values());
    pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

/// A rotation about a point, in degrees, as a matrix.
pub(crate) fn turn(about: [f64; 3], axis: Vector3<f64>, degrees: f64) -> Matrix4<f64> {
    let about = nalgebra::Translation3::from(Point3::from(about).coords);
    let turn = Rotation3::new(axis.normalize() * degrees.to_radians());
    about.to_homogeneous() * turn.to_homogeneous() * about.inverse().to_homogeneous()
}

/// The worst change of a gap and the worst turn, over the parts that follow.
pub(crate) fn worst(parts: &[cotan::PartReport]) -> [f64; 2] {
    let over = |of: fn(&cotan::PartReport) -> f64| parts.iter().map(of).fold(0.0, f64::max);
    [over(|p| p.gap_change), over(|p| p.turn_degrees)]
}
