//! The repair that fixes a given defect or error.

use super::Repair;
use super::filling::Filling;
use crate::weld::Weld;

/// A single repair: the step of [`Repair`] that fixes a defect, or an error of
/// [`Document::surface`](crate::Document::surface).
///
/// ```
/// use cotan_io::{Cure, Document, Repair};
/// # use nalgebra::Point3;
/// // Two triangles that run through their edge in the same direction.
/// let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
/// let positions = corners.map(|[x, y]| Point3::new(x, y, 0.0)).to_vec();
/// let faces = [vec![0, 1, 2], vec![0, 3, 2]].into_iter().collect();
/// let document = Document::new(positions, faces)?;
/// let cure = document.surface().err().and_then(|error| error.cure());
/// assert_eq!(cure, Some(Cure::Orient));
/// let repair = cure.map_or_else(Repair::new, |cure| Repair::new().cure(cure));
/// assert!(repair.apply(&document)?.document.surface().is_ok());
/// # Ok::<(), cotan_io::IoError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum Cure {
    /// [`Repair::weld`] for equal vertices.
    Weld,
    /// [`Repair::drop_degenerate`].
    DropDegenerate,
    /// [`Repair::drop_zero_area`].
    DropZeroArea,
    /// [`Repair::drop_duplicates`].
    DropDuplicates,
    /// [`Repair::orient`].
    Orient,
    /// [`Repair::split_vertices`].
    SplitVertices,
    /// [`Repair::split_edges`].
    SplitEdges,
    /// [`Repair::fill_holes`].
    FillHoles,
    /// [`Repair::compact`].
    Compact,
}

impl Repair {
    /// Adds the step that fixes a defect.
    ///
    /// Equal vertices are welded, and holes of any size are filled without new vertices.
    pub fn cure(self, cure: Cure) -> Self {
        match cure {
            Cure::Weld => self.weld(Weld::Exact),
            Cure::DropDegenerate => self.drop_degenerate(),
            Cure::DropZeroArea => self.drop_zero_area(),
            Cure::DropDuplicates => self.drop_duplicates(),
            Cure::Orient => self.orient(),
            Cure::SplitVertices => self.split_vertices(),
            Cure::SplitEdges => self.split_edges(),
            Cure::FillHoles => self.fill_holes(Filling::PLAIN),
            Cure::Compact => self.compact(),
        }
    }
}
