//! Moving the vertices of a document.

use cotan_geometry::{Positions, Scalar};
use nalgebra::Point3;

use super::{Document, is_finite};
use crate::error::IoError;
use crate::processing::ProcessingMesh;

impl Document {
    /// Writes positions of the processing mesh back to the document.
    ///
    /// Every vertex whose position differs from the document's is moved. All others, and vertices
    /// that no face uses, are preserved to the last digit of the file.
    ///
    /// # Errors
    /// [`IoError::PositionCount`] if the positions do not match `processing`, or `processing`
    /// does not match this document; [`IoError::NonFinitePosition`] if one is not finite. The
    /// document is unchanged in these cases.
    pub fn set_positions<T: Scalar>(
        &mut self,
        processing: &ProcessingMesh,
        positions: &Positions<T>,
    ) -> Result<(), IoError> {
        let expected = processing.mesh().num_vertices();
        if positions.len() != expected {
            return Err(IoError::PositionCount {
                expected,
                found: positions.len(),
            });
        }
        let expected = self.positions.len();
        if processing.num_document_vertices() != expected {
            return Err(IoError::PositionCount {
                expected,
                found: processing.num_document_vertices(),
            });
        }
        let mut moves: Vec<(usize, Point3<f64>)> = Vec::new();
        for vertex in 0..self.positions.len() {
            let Some(v) = processing.vertex(vertex) else {
                continue;
            };
            let (first, p) = (processing.document_vertex(v), positions[v]);
            let old = self.positions[first];
            // Compare in the caller's type: positions that `f32` cannot tell apart have not
            // moved.
            if p == old.map(T::of_f64) {
                continue;
            }
            let p = p.map(Scalar::as_f64);
            // A vertex welded within a tolerance keeps its offset from the first one.
            let [at, first] = [vertex, first].map(|v| self.file_positions()[v]);
            let p = match () {
                () if at == first => p,
                () if p == first => at,
                () => p + (at - first),
            };
            moves.push((vertex, p));
        }
        if let Some(&(vertex, _)) = moves.iter().find(|(_, p)| !is_finite(p)) {
            return Err(IoError::NonFinitePosition { vertex });
        }
        for (vertex, position) in moves {
            self.place(vertex, position);
        }
        Ok(())
    }

    /// Moves one vertex of the document, given its 0-based index.
    ///
    /// # Errors
    /// [`IoError::NonFinitePosition`] if the position is not finite, [`IoError::NoSuchVertex`] if
    /// the index is out of range.
    pub fn set_position(&mut self, vertex: usize, position: Point3<f64>) -> Result<(), IoError> {
        if vertex >= self.positions.len() {
            return Err(IoError::NoSuchVertex {
                vertex,
                num_vertices: self.positions.len(),
            });
        }
        if !is_finite(&position) {
            return Err(IoError::NonFinitePosition { vertex });
        }
        self.place(vertex, position);
        Ok(())
    }

    fn place(&mut self, vertex: usize, position: Point3<f64>) {
        if self.positions[vertex] != position {
            if self.original.is_empty() {
                self.original = self.positions.clone();
            }
            self.positions[vertex] = position;
        }
    }

    /// The positions in the file.
    pub(super) fn file_positions(&self) -> &[Point3<f64>] {
        match self.original.as_slice() {
            [] => &self.positions,
            original => original,
        }
    }
}
