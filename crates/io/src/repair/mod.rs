//! Repairs that need no guess at a shape.

mod change;
mod cure;
mod filling;
mod holes;
mod parts;
mod split;
mod work;

use std::num::NonZeroUsize;

pub use change::Change;
pub use cure::Cure;
pub use filling::Filling;

use crate::document::Document;
use crate::error::IoError;
use crate::weld::Weld;
use parts::Kept;
use work::Work;

/// Which repairs are made; see [`Repair::apply`].
///
/// [`Repair::new`] makes none, [`Repair::default`] those that lose nothing: degenerate and
/// duplicate faces are dropped, faces are oriented, vertices with several fans are split. Every
/// vertex keeps its number, save where a document has several [parts](Document::parts): the copies
/// follow behind the vertices of their part, so those of later parts move up. [`Repair::all`] makes
/// whatever it takes to get a surface from any list of faces.
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
    /// Whether welded vertices stay vertices of the file.
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

/// What came of a repair.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Repaired {
    /// The repaired document.
    pub document: Document,
    /// What was done, step by step; empty if nothing was to be done.
    pub changes: Vec<Change>,
    /// For each vertex of the repaired document the vertex that it was or is a copy of; for one
    /// that was [added](Repaired::added_vertices) a vertex of the hole that is near.
    pub vertex_sources: Vec<usize>,
    /// The vertices of the repaired document that were added to fill holes, in ascending order.
    pub added_vertices: Vec<usize>,
    /// For each face of the repaired document the face that it was; `None` if it fills a hole.
    pub face_sources: Vec<Option<usize>>,
}

impl Repair {
    /// No repair.
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

    /// Every repair that a surface may need, with vertices welded where they are equal, all holes
    /// filled, and unused vertices dropped. Faces without area stay.
    ///
    /// The repaired document has a [surface](Document::surface), or no face.
    pub fn all() -> Self {
        Self::default()
            .weld(Weld::Exact)
            .split_edges()
            .fill_holes(Filling::PLAIN)
            .compact()
    }

    /// Merges vertices; the first at a place stays, with its position and attributes.
    ///
    /// A glTF, which splits vertices at seams, keeps them; they count as one where the faces are
    /// looked at, in this document, not in its file. [`Weld::Off`] makes each of them a vertex of
    /// its own there.
    pub fn weld(mut self, weld: Weld) -> Self {
        (self.weld, self.keeps) = (weld, Toggle::Off);
        self
    }

    /// As [`Repair::weld`] in a glTF: every vertex stays, and those that are welded count as one in
    /// this document, not in its file.
    ///
    /// The [surface](Document::surface) of the repaired document has them as one vertex, and no
    /// further welding is needed, which would join what was parted.
    pub fn weld_in_place(mut self, weld: Weld) -> Self {
        (self.weld, self.keeps) = (weld, Toggle::On);
        self
    }

    /// Drops faces that enclose nothing, and corners of polygons that do: repetitions, and spikes
    /// that run out and straight back.
    pub fn drop_degenerate(mut self) -> Self {
        self.degenerate = Toggle::On;
        self
    }

    /// Drops faces of which all triangles have no area, though their vertices differ. That opens
    /// holes, or leaves corners in the middle of an edge.
    pub fn drop_zero_area(mut self) -> Self {
        self.zero_area = Toggle::On;
        self
    }

    /// Drops faces that have the outline of one before them, in either direction.
    ///
    /// Two faces that are each other's back, and have no other neighbour, stay: they are a closed
    /// surface.
    pub fn drop_duplicates(mut self) -> Self {
        self.duplicates = Toggle::On;
        self
    }

    /// Turns faces round until neighbours agree, as few as possible in each component; then closed
    /// components that look inward, save those that may be cavities of another.
    ///
    /// A component with one side only stays as it is, unless edges may be split.
    pub fn orient(mut self) -> Self {
        self.orient = Toggle::On;
        self
    }

    /// Gives each fan of faces a vertex of its own.
    pub fn split_vertices(mut self) -> Self {
        self.vertices = Toggle::On;
        self
    }

    /// Parts the faces at edges that have more than two: the two sides of a wedge of the solid stay
    /// together, others get edges of their own. One-sided components are cut open. Vertices are
    /// split, too.
    pub fn split_edges(mut self) -> Self {
        self.edges = Toggle::On;
        self.split_vertices()
    }

    /// Keeps the parts with the most faces, so many of them, and drops the others with the vertices
    /// that only these use. A part is a set of faces that hang together by edges.
    pub fn keep_largest(mut self, num_parts: NonZeroUsize) -> Self {
        self.kept.most_parts = num_parts.get();
        self
    }

    /// Drops parts with fewer faces, and the vertices that only these use; see
    /// [`Repair::keep_largest`].
    pub fn drop_parts_below(mut self, num_faces: usize) -> Self {
        self.kept.least_faces = num_faces;
        self
    }

    /// Fills holes; the boundary of an open surface is a hole as well.
    pub fn fill_holes(mut self, filling: Filling) -> Self {
        self.filling = filling;
        self
    }

    /// Drops vertices that no face uses; the others are renumbered. A document without faces keeps
    /// its vertices.
    pub fn compact(mut self) -> Self {
        self.compact = Toggle::On;
        self
    }

    /// Makes the repairs: vertices are welded, faces dropped, oriented, parted at edges and at
    /// vertices, parts dropped, holes filled, vertices dropped, in this order.
    ///
    /// Vertices keep their order, and copies follow behind those of their part; faces keep theirs,
    /// and what fills holes follows behind. Attributes go along.
    ///
    /// # Errors
    /// [`IoError::WeldTolerance`] for a tolerance that is not a distance, [`IoError::NoPartLeft`]
    /// if every part is too small to stay, and [`IoError`] with the place in the file if what goes
    /// along is wrong there.
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
        // How a polygon is cut depends on its direction, so this comes behind turning.
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
