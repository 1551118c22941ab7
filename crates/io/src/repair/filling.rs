//! The ways to fill a hole.

use std::num::NonZeroUsize;

/// How [`Repair::fill_holes`](super::Repair::fill_holes) fills holes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Filling {
    /// No hole is filled.
    Off,
    /// With triangles between the vertices of the hole.
    ///
    /// Of up to 300 edges all triangulations are compared, and a hole stays open only if each of
    /// them needs an edge that is there already. Of longer holes ears are clipped first.
    Plain {
        /// The most edges of a hole that is filled; longer ones stay open.
        most_edges: NonZeroUsize,
    },
    /// With new vertices, as dense as those round the hole, in such triangles, or in a fan about
    /// one new vertex where there are none; at most 100,000 in all holes together.
    ///
    /// They lie in the plain triangles. `cotan_tool::repair` makes the patch continue the surface.
    Smooth {
        /// The most edges of a hole that is filled; longer ones stay open.
        most_edges: NonZeroUsize,
    },
}

impl Filling {
    /// [`Filling::Plain`] for holes of any length.
    pub const PLAIN: Self = Self::Plain {
        most_edges: NonZeroUsize::MAX,
    };

    /// [`Filling::Smooth`] for holes of any length.
    pub const SMOOTH: Self = Self::Smooth {
        most_edges: NonZeroUsize::MAX,
    };

    /// The most edges of a hole that is filled.
    pub(super) fn most_edges(self) -> usize {
        match self {
            Self::Off => 0,
            Self::Plain { most_edges } | Self::Smooth { most_edges } => most_edges.get(),
        }
    }
}
