//! What is wrong with a mesh, and where.

use serde::Serialize;

/// A defect with its elements, as the file numbers them, from 0.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub(crate) struct Defect {
    pub(crate) kind: &'static str,
    pub(crate) description: String,
    pub(crate) vertices: Vec<usize>,
    pub(crate) faces: Vec<usize>,
}

impl Defect {
    pub(super) fn non_manifold_edge(vertices: [u32; 2], faces: Vec<usize>) -> Self {
        let [a, b] = vertices;
        Self {
            kind: "non-manifold edge",
            description: format!(
                "the edge between vertices {a} and {b} has {} faces",
                faces.len()
            ),
            vertices: vec![a as usize, b as usize],
            faces,
        }
    }

    pub(super) fn inconsistent_orientation(vertices: [u32; 2], faces: Vec<usize>) -> Self {
        let [a, b] = vertices;
        let list: Vec<String> = faces.iter().map(usize::to_string).collect();
        Self {
            kind: "inconsistent orientation",
            description: format!(
                "faces {} run through the edge between vertices {a} and {b} in the same direction",
                list.join(" and ")
            ),
            vertices: vec![a as usize, b as usize],
            faces,
        }
    }

    pub(super) fn several_fans(vertex: usize, num_fans: usize) -> Self {
        Self {
            kind: "several fans",
            description: format!("vertex {vertex} joins {num_fans} separate fans of faces"),
            vertices: vec![vertex],
            faces: Vec::new(),
        }
    }

    pub(super) fn repeated_vertex(vertex: u32, face: usize) -> Self {
        Self {
            kind: "repeated vertex",
            description: format!("face {face} passes twice through vertex {vertex}"),
            vertices: vec![vertex as usize],
            faces: vec![face],
        }
    }

    pub(super) fn unreferenced_vertex(vertex: usize) -> Self {
        Self {
            kind: "unreferenced vertex",
            description: format!("vertex {vertex} belongs to no face"),
            vertices: vec![vertex],
            faces: Vec::new(),
        }
    }

    pub(super) fn degenerate_face(face: usize) -> Self {
        Self {
            kind: "degenerate face",
            description: format!("face {face} has a triangle without area"),
            vertices: Vec::new(),
            faces: vec![face],
        }
    }
}
