//! The ids of handles.

use std::fmt;

/// The id of a handle within [`Handles`](crate::Handles). The
/// first handle added is 0, the next one is 1. A
/// handle keeps its id when others are removed, and ids are never reused within one [`Handles`].
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct HandleId(usize);

impl HandleId {
    /// The id of the handle that was added after `index` others.
    pub const fn new(index: usize) -> Self {
        Self(index)
    }

    /// The number of handles that were added before it.
    pub const fn index(self) -> usize {
        self.0
    }
}

impl From<usize> for HandleId {
    fn from(index: usize) -> Self {
        Self(index)
    }
}

impl fmt::Display for HandleId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
