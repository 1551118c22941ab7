//! Repairs that require no guess about the shape.
//!
//! The files of this folder are one concept and use each other freely.

mod change;
mod filling;
mod holes;
mod parts;
mod split;
mod work;

use std::num::NonZeroUsize;

pub use change::Change;
pub use filling::Filling;

use crate::cure::Cure;
use crate::document::Document;
use crate::error::IoError;
use crate::weld::Weld;
use parts::Kept;
use work::Work;

/// The set of repairs to make; see [`Repair::apply`].
///
/// [`Repair::new`] makes none. [`Repair::default`] makes those that lose nothing: degenerate and
/// duplicate faces are dropped, faces are oriented, vertices with several fans are split. Every
/// vertex keeps its index, unless the document has several [parts](Document::parts): copies
/// follow the vertices of their part, so those of later parts move up. [`Repair::all`] does
/// everything needed to get a surface from any list of faces.
///
/// ```
/// use cotan_io::{Limits, Repair, read};
/// let bow_tie = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
/// let document = read(bow_tie, None, &Limits::default())?;
/// assert!(document.surface().is_err());
/// let repaired = Repair::default().apply(&document)?;
/// assert_eq!(repaired.changes[0].to_string(), "split vertex 0 into 2 (new vertex 5)");
/// assert!(repaired.document.surface().is_ok());
/// # Ok::<(), cotan_io::IoError>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
#[must_use]
pub struct Repair {
    weld: Weld,
    /// On if welded vertices remain separate vertices of the file.
    keeps: Toggle,
    degenerate: Toggle,
    zero_area: Toggle,
    duplicates: Toggle,
    orient: Toggle,
    edges: Toggle,
    vertices: Toggle,
    compact: Toggle,
    kept: Kept,
    filling: Filling,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Toggle {
    Off,
    On,
}

impl Toggle {
    fn is_on(self) -> bool {
        self == Self::On
    }
}

impl Default for Repair {
    fn default() -> Self {
        Self::new()
            .drop_degenerate()
            .drop_duplicates()
            .orient()
            .split_vertices()
    }
}

/// The result of a repair.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Repaired {
    /// The repaired document.
    pub document: Document,
    /// The changes in order; empty if there was nothing to do.
    pub changes: Vec<Change>,
    /// For each vertex of the repaired document, the original vertex that it is or was copied
    /// from. For an [added](Repaired::added_vertices) vertex, a nearby vertex of the hole.
    pub vertex_sources: Vec<usize>,
    /// The vertices of the repaired document that were added to fill holes, in ascending order.
    pub added_vertices: Vec<usize>,
    /// For each face of the repaired document, its original face; `None` if it fills a hole.
    pub face_sources: Vec<Option<usize>>,
}

impl Repair {
    /// Creates an empty set of repairs.
    pub fn new() -> Self {
        Self {
            weld: Weld::AsFormat,
            keeps: Toggle::Off,
            degenerate: Toggle::Off,
            zero_area: Toggle::Off,
            duplicates: Toggle::Off,
            orient: Toggle::Off,
            edges: Toggle::Off,
            vertices: Toggle::Off,
            compact: Toggle::Off,
            kept: Kept::ALL,
            filling: Filling::Off,
        }
    }

    /// All repairs that a surface may need: vertices are welded where they are equal, all holes
    /// are filled, and unused vertices are dropped.
    ///
    /// Faces without area are kept.
    ///
    /// The repaired document either has a [surface](Document::surface) or no faces.
    pub fn all() -> Self {
        Self::default()
            .weld(Weld::Exact)
            .split_edges()
            .fill_holes(Filling::PLAIN)
            .compact()
    }

    /// Merges vertices. The first one at a place is kept, with its position and attributes.
    ///
    /// A glTF, which splits vertices at seams, keeps all of them. They then count as one vertex
    /// for topology, in this document but not in its file. [`Weld::Off`] makes them separate
    /// vertices there.
    pub fn weld(mut self, weld: Weld) -> Self {
        (self.weld, self.keeps) = (weld, Toggle::Off);
        self
    }

    /// Like [`Repair::weld`] for a glTF: every vertex is kept, and welded ones count as one in
    /// this document, but not in its file.
    ///
    /// The [surface](Document::surface) of the repaired document has them as one vertex. No
    /// further welding is needed, which would join what was separated.
    pub fn weld_in_place(mut self, weld: Weld) -> Self {
        (self.weld, self.keeps) = (weld, Toggle::On);
        self
    }

    /// Drops faces that enclose nothing, and polygon corners that enclose nothing: repetitions,
    /// and spikes that run out and straight back.
    pub fn drop_degenerate(mut self) -> Self {
        self.degenerate = Toggle::On;
        self
    }

    /// Drops faces whose triangles all have no area although their vertices differ.
    ///
    /// This opens holes, or leaves corners in the middle of an edge.
    pub fn drop_zero_area(mut self) -> Self {
        self.zero_area = Toggle::On;
        self
    }

    /// Drops faces with the outline of an earlier one, in either direction.
    ///
    /// Two faces that are back to back and have no other neighbour are kept, since they form a
    /// closed surface.
    pub fn drop_duplicates(mut self) -> Self {
        self.duplicates = Toggle::On;
        self
    }

    /// Reverses faces until neighbours agree, as few as possible in each component.
    ///
    /// Then reverses closed components that point inward, except those that may be cavities of
    /// another.
    ///
    /// A one-sided component is left unchanged, unless edges may be split.
    pub fn orient(mut self) -> Self {
        self.orient = Toggle::On;
        self
    }

    /// Splits vertices so that each fan of faces has its own.
    pub fn split_vertices(mut self) -> Self {
        self.vertices = Toggle::On;
        self
    }

    /// Separates the faces at edges with more than two.
    ///
    /// The two sides of a wedge of the solid stay together, others get their own edges. One-sided
    /// components are cut open. Vertices are split, too.
    pub fn split_edges(mut self) -> Self {
        self.edges = Toggle::On;
        self.split_vertices()
    }

    /// Keeps the `num_parts` parts with the most faces, and drops the others together with the
    /// vertices that only they use.
    ///
    /// A part is a set of faces connected through edges.
    pub fn keep_largest(mut self, num_parts: NonZeroUsize) -> Self {
        self.kept.most_parts = num_parts.get();
        self
    }

    /// Drops parts with fewer than `num_faces` faces, and the vertices that only they use; see
    /// [`Repair::keep_largest`].
    pub fn drop_parts_below(mut self, num_faces: usize) -> Self {
        self.kept.least_faces = num_faces;
        self
    }

    /// Fills holes. The boundary of an open surface is a hole as well.
    pub fn fill_holes(mut self, filling: Filling) -> Self {
        self.filling = filling;
        self
    }

    /// Drops vertices that no face uses, and renumbers the others.
    ///
    /// A document without faces keeps its vertices.
    pub fn compact(mut self) -> Self {
        self.compact = Toggle::On;
        self
    }

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
    /// Makes the repairs in this order: weld vertices, drop faces, orient faces, separate faces
    /// at edges and vertices, drop parts, fill holes, drop vertices.
    ///
    /// Vertices keep their order, with copies after those of their part. Faces keep theirs, with
    /// hole-filling faces at the end. Attributes are carried along.
    ///
    /// # Errors
    /// [`IoError::WeldTolerance`] for a tolerance that is not a valid distance,
    /// [`IoError::NoPartLeft`] if every part is too small to be kept, and [`IoError`] with the
    /// location in the file if data to be carried along is invalid.
    pub fn apply(&self, document: &Document) -> Result<Repaired, IoError> {
        let mut work = Work::new(document)?;
        if self.weld != Weld::AsFormat {
            work.weld(self.weld, self.keeps)?;
        }
        if self.degenerate.is_on() {
            work.drop_degenerate();
        }
        if self.zero_area.is_on() {
            work.drop_zero_area();
        }
        if self.duplicates.is_on() {
            work.drop_duplicates();
        }
        if self.orient.is_on() {
            work.orient(self.edges);
        }
        if self.vertices.is_on() {
            work.split(self.edges);
        }
        if self.orient.is_on() {
            work.turn_outward();
        }
        // The cut of a polygon depends on its direction, so this comes after reversing.
        if self.edges.is_on() {
            work.untangle();
        }
        if self.kept != Kept::ALL {
            work.keep_parts(self.kept)?;
        }
        if self.filling != Filling::Off {
            work.fill_holes(self.filling);
        }
        work.finish(self.compact)
    }
}

#[cfg(test)]
mod tests;
