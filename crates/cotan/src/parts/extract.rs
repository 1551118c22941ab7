//! Some parts of a mesh as a mesh of their own.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId};

/// A mesh of some of the parts of another one. Vertices and faces keep their order.
#[derive(Clone, Debug)]
pub(crate) struct Extract<T: Scalar> {
    pub(crate) mesh: Arc<HalfedgeMesh>,
    pub(crate) positions: Arc<Positions<T>>,
    /// For each vertex its number in the whole.
    whole: Vec<u32>,
    /// For each vertex of the whole its number here, or [`NOT_HERE`].
    here: Vec<u32>,
}

const NOT_HERE: u32 = u32::MAX;

impl<T: Scalar> Extract<T> {
    /// Takes the vertices that `counts` accepts; faces are to have all corners among them or none.
    pub(crate) fn new(
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
        counts: impl Fn(VertexId) -> bool,
    ) -> Self {
        let whole: Vec<u32> = mesh
            .vertices()
            .filter(|v| counts(*v))
            .map(|v| v.index() as u32)
            .collect();
        let mut here = vec![NOT_HERE; mesh.num_vertices()];
        for (k, v) in whole.iter().enumerate() {
            here[*v as usize] = k as u32;
        }
        let faces: Vec<[u32; 3]> = mesh
            .faces()
            .map(|f| mesh.triangle(f).map(|v| here[v.index()]))
            .filter(|corners| corners[0] != NOT_HERE)
            .collect();
        let mesh = HalfedgeMesh::from_faces(whole.len(), &faces)
            .expect("components of a half-edge mesh are one");
        let taken = whole.iter().map(|v| positions.as_slice()[*v as usize]);
        Self {
            mesh: Arc::new(mesh),
            positions: Arc::new(taken.collect()),
            whole,
            here,
        }
    }

    /// The number of a vertex in the whole.
    pub(crate) fn in_whole(&self, vertex: VertexId) -> u32 {
        self.whole[vertex.index()]
    }

    /// The number here of a vertex of the whole.
    pub(crate) fn in_extract(&self, vertex: u32) -> Option<VertexId> {
        let here = self.here[vertex as usize];
        (here != NOT_HERE).then(|| VertexId::new(here as usize))
    }

    /// The vertices, as the whole numbers them.
    pub(crate) fn vertices(&self) -> &[u32] {
        &self.whole
    }
}
