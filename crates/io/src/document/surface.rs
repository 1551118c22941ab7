//! The triangulated half-edge mesh of a document, and its welded vertices.

use std::borrow::Cow;

use super::{Document, Places};
use crate::error::IoError;
use crate::processing::{Allowed, Numbering, ProcessingMesh};
use crate::weld::{self, Weld};

impl Document {
    /// Builds the triangulated half-edge mesh of this document, with index maps in both
    /// directions, welded as the format implies; see [`Document::surface_with`].
    ///
    /// # Errors
    /// As for [`Document::surface_with`].
    pub fn surface(&self) -> Result<ProcessingMesh, IoError> {
        self.surface_with(Weld::AsFormat)
    }

    /// Builds the triangulated half-edge mesh of this document, with index maps in both
    /// directions.
    ///
    /// Vertices that no face uses are omitted. Polygons are triangulated inside their outline,
    /// even where it is concave. Faces left with fewer than three corners after welding are
    /// omitted.
    ///
    /// # Errors
    /// [`IoError::NoFaces`] if there is nothing to build from, [`IoError::NotManifold`] if the
    /// faces do not form an oriented manifold.
    pub fn surface_with(&self, weld: Weld) -> Result<ProcessingMesh, IoError> {
        self.surface_numbered(weld, Numbering::Auto)
    }

    /// Like [`Document::surface_with`], with the given order of vertices and triangles.
    ///
    /// # Errors
    /// As for [`Document::surface_with`].
    pub fn surface_numbered(
        &self,
        weld: Weld,
        numbering: Numbering,
    ) -> Result<ProcessingMesh, IoError> {
        self.built(weld, numbering, Allowed::Manifold)
    }

    /// Like [`Document::surface_with`], for any list of faces: where they do not form an oriented
    /// manifold, the mesh is cut into pieces that do, and copies of a vertex share a row, as by
    /// [`from_faces_in_pieces`](cotan_halfedge::HalfedgeMesh::from_faces_in_pieces). The document
    /// is not changed, and jobs that move all copies of a vertex alike can be [written
    /// back](Document::set_positions).
    ///
    /// A document that has an oriented manifold surface gives exactly that one.
    ///
    /// # Errors
    /// As for [`Document::surface_with`], except for edges with more than two faces, vertices with
    /// several fans, and inconsistent orientation.
    pub fn surface_in_pieces(&self, weld: Weld) -> Result<ProcessingMesh, IoError> {
        self.built(weld, Numbering::Auto, Allowed::Any)
    }

    fn built(
        &self,
        weld: Weld,
        numbering: Numbering,
        allowed: Allowed,
    ) -> Result<ProcessingMesh, IoError> {
        let (positions, places) = (&self.positions, self.places(weld)?);
        ProcessingMesh::build(positions, &self.faces, &places, numbering, allowed)
    }

    /// Returns `true` if the format splits vertices, so that several of them may be one.
    pub(crate) fn is_split(&self) -> bool {
        !matches!(self.places, Places::Own)
    }

    /// For each vertex, the first vertex that it is welded to; empty if there is nothing to weld.
    pub(crate) fn places(&self, weld: Weld) -> Result<Cow<'_, [u32]>, IoError> {
        let part = self.stretches.group_of();
        Ok(match weld {
            Weld::AsFormat => match &self.places {
                Places::Own => Cow::Borrowed(&[]),
                // Uses the positions in the file, so that a merged vertex stays merged when it
                // moves.
                Places::Exact => Cow::Owned(weld::exact(self.file_positions(), part)),
                Places::Given(places) => Cow::Borrowed(places),
            },
            Weld::Off => Cow::Borrowed(&[]),
            Weld::Exact => Cow::Owned(weld::exact(&self.positions, part)),
            Weld::Within(tolerance) if tolerance >= 0.0 && tolerance.is_finite() => {
                Cow::Owned(weld::within(&self.positions, part, tolerance))
            }
            Weld::Within(tolerance) => return Err(IoError::WeldTolerance { tolerance }),
        })
    }

    /// Returns a function that maps a vertex to the index of its stretch.
    ///
    /// The indices are ascending, and equal for consecutive vertices of a part that may be
    /// welded.
    pub(crate) fn stretch_of(&self) -> impl Fn(usize) -> usize + use<> {
        self.stretches.stretch_of()
    }
}
