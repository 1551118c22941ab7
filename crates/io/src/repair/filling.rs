//! The methods of filling a hole.

use std::num::NonZeroUsize;

/// The method by which [`Repair::fill_holes`](super::Repair::fill_holes) fills holes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Filling {
    /// Holes are not filled.
    Off,
    /// Holes are filled with triangles between their vertices.
    ///
    /// For up to 300 edges all triangulations are compared, and a hole stays open only if each of
    /// them needs an existing edge. In longer holes, ears are clipped first.
    Plain {
        /// Maximum number of edges of a hole to fill; longer ones stay open.
        max_edges: NonZeroUsize,
    },
    /// Holes are filled as by [`Filling::Plain`], and refined with new vertices, as dense as
    /// those around the hole.
    ///
    /// If there are no such triangles, the hole is filled with a fan around one new vertex. At
    /// most 100,000 vertices are added to all holes together.
    ///
    /// The new vertices lie in the plain triangles. `cotan_tool::repair` fairs the patch so that
    /// it continues the surface.
    Smooth {
        /// Maximum number of edges of a hole to fill; longer ones stay open.
        max_edges: NonZeroUsize,
    },
}

impl Filling {
    /// [`Filling::Plain`] for holes of any length.
    pub const PLAIN: Self = Self::Plain {
        max_edges: NonZeroUsize::MAX,
    };

    /// [`Filling::Smooth`] for holes of any length.
    pub const SMOOTH: Self = Self::Smooth {
        max_edges: NonZeroUsize::MAX,
    };

    /// Maximum number of edges of a hole to fill.
    pub(super) fn max_edges(self) -> usize {
        match self {
            Self::Off => 0,
            Self::Plain { max_edges } | Self::Smooth { max_edges } => max_edges.get(),
        }
    }
}
