//! The repair that fixes a given defect or error.

/// A single repair: the step of [`Repair`](crate::Repair) that fixes a defect, or an error of
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
    /// [`Repair::weld`](crate::Repair::weld) for equal vertices.
    Weld,
    /// [`Repair::drop_degenerate`](crate::Repair::drop_degenerate).
    DropDegenerate,
    /// [`Repair::drop_zero_area`](crate::Repair::drop_zero_area).
    DropZeroArea,
    /// [`Repair::drop_duplicates`](crate::Repair::drop_duplicates).
    DropDuplicates,
    /// [`Repair::orient`](crate::Repair::orient).
    Orient,
    /// [`Repair::split_vertices`](crate::Repair::split_vertices).
    SplitVertices,
    /// [`Repair::split_edges`](crate::Repair::split_edges).
    SplitEdges,
    /// [`Repair::fill_holes`](crate::Repair::fill_holes).
    FillHoles,
    /// [`Repair::compact`](crate::Repair::compact).
    Compact,
}
