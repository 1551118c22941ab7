//! A mesh before and after, with the roles of its vertices.

use cotan::geometry::Positions;
use cotan::halfedge::{HalfedgeMesh, VertexMap};
use cotan_io::ProcessingMesh;
use cotan_tool::handles_file::Constraint;

/// The role of a vertex in the picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Mark {
    /// Not a handle.
    Free,
    /// A fixed handle.
    Fixed,
    /// A moved handle.
    Moved,
}

/// The role of each vertex, according to the handles.
pub(crate) fn marks(constraints: &[Constraint], processing: &ProcessingMesh) -> VertexMap<Mark> {
    let mut marks = VertexMap::filled(processing.mesh().num_vertices(), Mark::Free);
    for constraint in constraints {
        let Some(v) = processing.vertex(constraint.vertex) else {
            continue;
        };
        let moves = constraint.moves(processing.positions()[v]);
        marks[v] = if moves { Mark::Moved } else { Mark::Fixed };
    }
    marks
}

/// One mesh with two sets of positions.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BeforeAfter<'a> {
    pub(crate) mesh: &'a HalfedgeMesh,
    pub(crate) before: &'a Positions<f64>,
    pub(crate) after: &'a Positions<f64>,
    pub(crate) marks: &'a VertexMap<Mark>,
}

impl Mark {
    /// The colour in linear RGB.
    pub(super) fn color(self) -> [f32; 3] {
        match self {
            Self::Free => [0.62, 0.63, 0.60],
            Self::Fixed => [0.10, 0.27, 0.62],
            Self::Moved => [0.86, 0.27, 0.05],
        }
    }
}
