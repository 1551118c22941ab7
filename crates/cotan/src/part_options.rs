//! The parts of a model that follow, and how they are tied.

use crate::named::setters;

/// The treatment of the parts of a model that have no handles.
///
/// A part is a connected component of the mesh. Parts are indexed in the order of their first
/// vertices; the names of objects, groups or nodes are known to the programs that read files.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Parts {
    /// They follow the parts that they touch, or the nearest ones.
    #[default]
    Follow,
    /// They are not part of the deformation: [`crate::deform()`] refuses a part without a handle.
    Still,
    /// These follow; all others without handles stay where they are.
    Only(Vec<usize>),
}

/// The ties between parts and the parts that they follow.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct Ties {
    /// A factor on the stiffness of ties, relative to the bending of the surface. At 10, cloth
    /// creases; at 0.1, it flows. Default: 1.
    pub strength: f64,
    /// Parts that follow nothing: they stay where they are unless they have handles.
    pub free: Vec<usize>,
    /// Pairs of parts that are not tied to each other.
    pub untied: Vec<[usize; 2]>,
}

setters!(Ties {
    strength: f64,
    free: Vec<usize>,
    untied: Vec<[usize; 2]>,
});

impl Default for Ties {
    fn default() -> Self {
        Self {
            strength: 1.0,
            free: Vec::new(),
            untied: Vec::new(),
        }
    }
}
