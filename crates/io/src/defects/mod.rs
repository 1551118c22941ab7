//! Inspection of a document, manifold or not: its properties and all its defects.
//!
//! Topology is computed from the polygons as they are, so that meshes from which no half-edge
//! structure can be built are covered too.
//!
//! The files of this folder are one concept and use each other freely.

mod defect;
mod find;

pub use defect::{Defect, DefectKind};

use crate::document::Document;
use crate::error::IoError;
use crate::weld::Weld;

pub(crate) use find::{duplicate_faces, shells};

/// The result of [`Document::inspect`].
///
/// Faces that enclose nothing, such as those that welding collapses, are not counted for edges,
/// components and boundary.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Inspection {
    /// Number of places that faces use: vertices, with welded ones counted once.
    pub num_vertices: usize,
    /// Number of faces that enclose something.
    pub num_faces: usize,
    /// Number of edges.
    pub num_edges: usize,
    /// Number of edges with one face.
    pub num_boundary_edges: usize,
    /// Number of sets of edges with one face that are connected through vertices. Two holes that
    /// touch at a vertex with several fans count as one boundary and two [holes](Defect::Hole).
    pub num_boundaries: usize,
    /// Shortest, mean and longest edge; `None` if there are no edges.
    pub edge_lengths: Option<[f64; 3]>,
    /// Sets of faces connected through edges, in the order of their first face.
    pub components: Vec<Component>,
    /// All defects, grouped by kind, in element order.
    pub defects: Vec<Defect>,
    /// The reason why the attributes cannot be decoded, if so. Non-finite values among them are
    /// unknown in that case.
    pub attributes_problem: Option<String>,
}

/// A set of faces connected through edges.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct Component {
    /// Its first face.
    pub first_face: usize,
    /// Number of faces.
    pub num_faces: usize,
    /// Number of edges with one face.
    pub num_boundary_edges: usize,
    /// `true` if its faces can be oriented consistently; edges with three or more faces are
    /// ignored.
    pub is_orientable: bool,
    /// The enclosed volume; `None` unless every edge has two consistently oriented faces.
    pub volume: Option<f64>,
}

impl Inspection {
    /// V − E + F.
    pub fn euler_characteristic(&self) -> i64 {
        self.num_vertices as i64 - self.num_edges as i64 + self.num_faces as i64
    }

    /// Returns `true` if there are faces and no edge has only one.
    pub fn is_closed(&self) -> bool {
        self.num_faces > 0 && self.num_boundary_edges == 0
    }

    /// The number of defects of a kind.
    pub fn count(&self, kind: DefectKind) -> usize {
        self.defects.iter().filter(|d| d.kind() == kind).count()
    }

    /// The number of boundary loops.
    pub fn num_holes(&self) -> usize {
        self.count(DefectKind::Hole)
    }
}

impl Document {
    /// Computes counts, components, and all defects with their elements.
    ///
    /// Takes O(n log n) time in the size of the mesh, whatever its defects.
    ///
    /// # Errors
    /// [`IoError::WeldTolerance`] for a tolerance that is not a valid distance.
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

    /// Finds all defects with their elements; see [`Document::inspect`].
    ///
    /// # Errors
    /// As for [`Document::inspect`].
    pub fn defects(&self, weld: Weld) -> Result<Vec<Defect>, IoError> {
        Ok(self.inspect(weld)?.defects)
    }
}

#[cfg(test)]
mod tests;
