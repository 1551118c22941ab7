//! The half-edge mesh under arbitrary faces and edits.

use cotan::halfedge::{EdgeId, FaceId, HalfedgeId, HalfedgeMesh};
use cotan::shapes;

use super::draw::Draw;

/// Faces with few distinct vertices, so that they share some. One index in 64 is arbitrary.
fn faces(draw: &mut Draw<'_>, most: usize) -> (usize, Vec<Vec<u32>>) {
    let num_vertices = match draw.byte() {
        255 => draw.u32() as usize,
        b => usize::from(b) % 40,
    };
    let mut faces = Vec::new();
    while !draw.is_empty() && faces.len() < most {
        let degree = match draw.below(8) {
            0..=4 => 3,
            5 | 6 => 4,
            _ => draw.below(12),
        };
        let corner = |draw: &mut Draw<'_>| match draw.byte() {
            255 => draw.u32(),
            b => u32::from(b) % (num_vertices.clamp(1, 255) as u32),
        };
        faces.push((0..degree).map(|_| corner(draw)).collect());
    }
    (num_vertices, faces)
}

/// Checks that any list of faces gives a valid mesh with these faces, or an error with the
/// reason.
pub fn halfedge_build(data: &[u8]) {
    let (num_vertices, faces) = faces(&mut Draw::new(data), 200);
    match HalfedgeMesh::from_faces(num_vertices, &faces) {
        Ok(mesh) => {
            check(&mesh);
            assert_eq!(
                (mesh.num_vertices(), mesh.num_faces()),
                (num_vertices, faces.len())
            );
            let again = HalfedgeMesh::from_faces(num_vertices, &mesh.to_faces());
            assert_eq!(again.as_ref(), Ok(&mesh));
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
}

fn check(mesh: &HalfedgeMesh) {
    mesh.validate().unwrap_or_else(|error| panic!("{error}"));
    for part in &mesh.topology() {
        let twice = 2 - part.euler_characteristic() - part.num_boundary_loops as i64;
        assert!(twice >= 0 && twice % 2 == 0, "{part:?}");
    }
}

/// Checks that any sequence of edits, performed or refused, leaves a valid mesh.
pub fn halfedge_edits(data: &[u8]) {
    let mut draw = Draw::new(data);
    let mut mesh = start(&mut draw);
    for _ in 0..64 {
        if draw.is_empty() || mesh.num_faces() == 0 {
            break;
        }
        let before = mesh.clone();
        if edit(&mut draw, &mut mesh).is_err() {
            assert_eq!(mesh, before, "a refused edit changes nothing");
        }
        check(&mesh);
    }
}

pub(super) fn start(draw: &mut Draw<'_>) -> HalfedgeMesh {
    match draw.below(5) {
        0 => shapes::tetrahedron::<f64>().into_parts().0,
        1 => shapes::icosphere::<f64>(1).into_parts().0,
        2 => shapes::torus::<f64>(1.0, 0.4, 4, 3).into_parts().0,
        3 => {
            shapes::bumpy_plane::<f64>([1.0, 1.0], [3, 4], 0.1)
                .into_parts()
                .0
        }
        _ => {
            let (num_vertices, faces) = faces(draw, 12);
            HalfedgeMesh::from_faces(num_vertices, &faces)
                .unwrap_or_else(|_| shapes::tetrahedron::<f64>().into_parts().0)
        }
    }
}

/// Performs one edit. Element indices are sometimes out of range.
pub(super) fn edit(draw: &mut Draw<'_>, mesh: &mut HalfedgeMesh) -> Result<(), ()> {
    let kind = draw.below(8);
    let mut pick = |count: usize| match draw.byte() {
        255 => draw.u32() as usize >> 1,
        b => usize::from(b) % count,
    };
    let halfedges = mesh.num_halfedges();
    let result = match kind {
        0 => mesh
            .flip_edge(EdgeId::new(pick(mesh.num_edges())))
            .map(drop),
        1 => mesh
            .split_edge(EdgeId::new(pick(mesh.num_edges())))
            .map(drop),
        2 => mesh
            .split_face(FaceId::new(pick(mesh.num_faces())))
            .map(drop),
        3 => {
            let [from, to] = [pick(halfedges), pick(halfedges)].map(HalfedgeId::new);
            mesh.connect_corners(from, to).map(drop)
        }
        4 | 5 => mesh.collapse(HalfedgeId::new(pick(halfedges))).map(drop),
        6 => {
            let faces = [pick(mesh.num_faces()), pick(mesh.num_faces())].map(FaceId::new);
            mesh.delete_faces(&faces).map(drop)
        }
        _ => match pick(2) {
            0 => mesh.triangulate().map(drop),
            component => mesh.flip_orientation(component - 1),
        },
    };
    result.map_err(drop)
}
