//! What a document is like, manifold or not, and everything that is wrong with it.
//!
//! Topology is counted on the polygons as they stand, so that meshes from which no half-edge
//! structure can be built are described too.

mod defect;
mod find;

pub use defect::{Defect, DefectKind};

use crate::document::Document;
use crate::error::IoError;
use crate::weld::Weld;

pub(crate) use find::{duplicate_faces, shells};

/// What [`Document::inspect`] finds.
///
/// Faces that enclose nothing, as those that welding collapses, do not count for edges, components
/// and boundary.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Inspection {
    /// Places that a face uses: vertices, those welded together counted once.
    pub num_vertices: usize,
    /// Faces that enclose something.
    pub num_faces: usize,
    /// Edges.
    pub num_edges: usize,
    /// Edges with one face.
    pub num_boundary_edges: usize,
    /// Sets of edges with one face that hang together by vertices. Where two holes touch at a
    /// vertex with several fans, they are one boundary and two [holes](Defect::Hole).
    pub num_boundaries: usize,
    /// Shortest, mean and longest edge; `None` if there is none.
    pub edge_lengths: Option<[f64; 3]>,
    /// Faces that hang together by edges, in the order of their first face.
    pub components: Vec<Component>,
    /// Everything that is wrong: kind by kind, in the order of the elements.
    pub defects: Vec<Defect>,
    /// Why the attributes cannot be decoded, if so; what is not finite among them is not known
    /// then.
    pub attributes_problem: Option<String>,
}

/// Faces that hang together by edges.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct Component {
    /// Its first face.
    pub first_face: usize,
    /// How many faces it has.
    pub num_faces: usize,
    /// How many edges with one face it has.
    pub num_boundary_edges: usize,
    /// Whether its faces can be given one direction; edges with three faces or more do not count.
    pub is_orientable: bool,
    /// The volume that it encloses; `None` unless every edge has two faces that agree.
    pub volume: Option<f64>,
}

impl Inspection {
    /// V − E + F.
    pub fn euler_characteristic(&self) -> i64 {
        self.num_vertices as i64 - self.num_edges as i64 + self.num_faces as i64
    }

    /// Whether there are faces and no edge has only one.
    pub fn is_closed(&self) -> bool {
        self.num_faces > 0 && self.num_boundary_edges == 0
    }

    /// How many defects of a kind there are.
    pub fn count(&self, kind: DefectKind) -> usize {
        self.defects.iter().filter(|d| d.kind() == kind).count()
    }

    /// The boundary loops.
    pub fn num_holes(&self) -> usize {
        self.count(DefectKind::Hole)
    }
}

impl Document {
    /// Counts, components, and everything that is wrong, with its elements.
    ///
    /// Takes time in proportion to the size of the mesh and its logarithm, whatever is wrong.
    ///
    /// # Errors
    /// [`IoError::WeldTolerance`] for a tolerance that is not a distance.
    ///
    /// ```
    /// use cotan_io::{DefectKind, Limits, Weld, read};
    /// let bow_tie = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
    /// let inspection = read(bow_tie, None, &Limits::default())?.inspect(Weld::AsFormat)?;
    /// assert_eq!(inspection.components.len(), 2);
    /// let fans = inspection.defects.iter().find(|d| d.kind() == DefectKind::SeveralFans);
    /// assert_eq!(fans.unwrap().to_string(), "vertex 0 joins 2 separate fans of faces");
    /// # Ok::<(), cotan_io::IoError>(())
    /// ```
    pub fn inspect(&self, weld: Weld) -> Result<Inspection, IoError> {
        find::inspect(self, &self.places(weld)?, &self.places(Weld::Exact)?)
    }

    /// Everything that is wrong, with its elements; see [`Document::inspect`].
    ///
    /// # Errors
    /// As [`Document::inspect`].
    pub fn defects(&self, weld: Weld) -> Result<Vec<Defect>, IoError> {
        Ok(self.inspect(weld)?.defects)
    }
}

#[cfg(test)]
mod tests;
