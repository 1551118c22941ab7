//! Typed element ids. An id is a plain index into the dense maps.

use std::fmt;

/// The index that no element has: "none" in the packed arrays.
pub(crate) const NONE: u32 = u32::MAX;

/// The common interface of the four id types, which lets one dense map serve them all.
pub trait Id: Copy + Eq + Ord + fmt::Debug + Send + Sync + 'static {
    /// Creates the id with this index.
    ///
    /// # Panics
    /// If `index` does not fit in 32 bits.
    fn new(index: usize) -> Self;

    /// The index, starting from 0.
    fn index(self) -> usize;
}

macro_rules! id_type {
    ($(#[$doc:meta])* $name:ident, $letter:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub(crate) u32);

        impl $name {
            /// Creates the id with this index.
            ///
            /// # Panics
            /// If `index` does not fit in 32 bits.
            #[inline]
            pub const fn new(index: usize) -> Self {
                assert!(index < NONE as usize, "an element number must be below 2^32 - 1");
                Self(index as u32)
            }

            /// The index of this element, starting from 0: its entry in every dense map and its
            /// row in every matrix.
            #[inline]
            pub const fn index(self) -> usize {
                self.0 as usize
            }

            #[allow(dead_code, reason = "only some kinds of element are ever absent")]
            #[inline]
            pub(crate) fn some(raw: u32) -> Option<Self> {
                (raw != NONE).then_some(Self(raw))
            }
        }

        impl Id for $name {
            #[inline]
            fn new(index: usize) -> Self {
                Self::new(index)
            }

            #[inline]
            fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($letter, "{}"), self.0)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                self.0.fmt(f)
            }
        }
    };
}

id_type!(
    /// A vertex. Its index is its row in every matrix built on the mesh.
    VertexId,
    "v"
);
id_type!(
    /// A halfedge: one of the two directed sides of an edge.
    ///
    /// Halfedges 2e and 2e + 1 are the two sides of edge e, so [`HalfedgeId::twin`] and
    /// [`HalfedgeId::edge`] are bit operations.
    HalfedgeId,
    "h"
);
id_type!(
    /// An undirected edge.
    EdgeId,
    "e"
);
id_type!(
    /// A face (a polygon of three or more corners).
    FaceId,
    "f"
);

impl HalfedgeId {
    /// The other side of the same edge, in the opposite direction.
    #[inline]
    #[must_use]
    pub const fn twin(self) -> Self {
        Self(self.0 ^ 1)
    }

    /// The edge that this halfedge is a side of.
    #[inline]
    pub const fn edge(self) -> EdgeId {
        EdgeId(self.0 >> 1)
    }
}

impl EdgeId {
    /// The two sides of this edge, with indices 2e and 2e + 1.
    #[inline]
    pub const fn halfedges(self) -> [HalfedgeId; 2] {
        [HalfedgeId(self.0 * 2), HalfedgeId(self.0 * 2 + 1)]
    }

    /// The first side of this edge, with index 2e.
    #[inline]
    pub const fn halfedge(self) -> HalfedgeId {
        HalfedgeId(self.0 * 2)
    }
}
