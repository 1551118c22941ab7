//! Some parts of a mesh as a mesh of their own.
//!
//! Vertices are rows; a mesh that was cut into pieces stays cut, with copies behind the rows.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId};

/// A mesh of some of the parts of another one. Vertices and faces keep their order.
#[derive(Clone, Debug)]
pub(crate) struct Extract<T: Scalar> {
    pub(crate) mesh: Arc<HalfedgeMesh>,
    pub(crate) positions: Arc<Positions<T>>,
    /// Per vertex: its index in the whole mesh.
    whole: Vec<u32>,
    /// Per vertex of the whole mesh: its index here, or [`NOT_HERE`].
    here: Vec<u32>,
}

const NOT_HERE: u32 = u32::MAX;

impl<T: Scalar> Extract<T> {
    /// Extracts the vertices that `counts` accepts. Each face must have all corners among them, or
    /// none.
    pub(crate) fn new(
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
        counts: impl Fn(VertexId) -> bool,
    ) -> Self {
        let taken = mesh.vertices().filter(|v| counts(mesh.row_of(*v)));
        let taken: Vec<VertexId> = taken.collect();
        let mut here = vec![NOT_HERE; mesh.num_vertices()];
        for (k, v) in taken.iter().enumerate() {
            here[v.index()] = k as u32;
        }
        // The rows come first.
        let is_row = |v: &&VertexId| v.index() < mesh.num_rows();
        let whole: Vec<u32> = taken
            .iter()
            .filter(is_row)
            .map(|v| v.index() as u32)
            .collect();
        let copies = taken[whole.len()..].iter();
        let rows = copies.map(|v| VertexId::new(here[mesh.row_of(*v).index()] as usize));
        let rows: Vec<VertexId> = rows.collect();
        let faces: Vec<[u32; 3]> = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(|v| here[v.index()]))
            .filter(|corners| corners[0] != NOT_HERE)
            .collect();
        let mesh = HalfedgeMesh::from_faces(taken.len(), &faces)
            .expect("components of a half-edge mesh are one");
        let mesh = mesh
            .with_copies(rows)
            .expect("copies of rows that were taken along");
        let taken = whole.iter().map(|v| positions.as_slice()[*v as usize]);
        Self {
            mesh: Arc::new(mesh),
            positions: Arc::new(taken.collect()),
            whole,
            here,
        }
    }

    /// The index of a vertex in the whole mesh.
    pub(crate) fn in_whole(&self, vertex: VertexId) -> u32 {
        self.whole[vertex.index()]
    }

    /// The index here of a vertex of the whole mesh.
    pub(crate) fn in_extract(&self, vertex: u32) -> Option<VertexId> {
        let here = self.here[vertex as usize];
        (here != NOT_HERE).then(|| VertexId::new(here as usize))
    }

    /// The vertices, as indices of the whole mesh.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.whole
    }
}
