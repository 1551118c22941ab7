//! Local edits of the connectivity.
//!
//! Each edit checks its conditions before it changes anything, so a rejected edit leaves the mesh
//! unchanged. There are no tombstones: ids stay 0, 1, 2, … The crate documentation lists the
//! edits.

mod checks;
mod collapse;
mod delete;
mod error;
mod flip;
mod renumbering;
mod split_edge;
mod split_face;
mod steps;
mod triangulate;

use crate::ids::Id;
use crate::map::DenseMap;

pub(crate) use checks::MAX_EDGES;
pub use collapse::{ClosedFace, Collapsed};
pub use error::EditError;
pub use flip::FlippedEdge;
pub use renumbering::Renumbering;
pub use split_edge::SplitEdge;
pub use split_face::{CutFace, SplitFace};
/// Appends a clone of its parent's value for each child. The children have the next ids.
fn inherit<I: Id, T: Clone>(
    elements: &'static str,
    map: &mut DenseMap<I, T>,
    children: impl IntoIterator<Item = (I, I)>,
) -> Result<(), EditError> {
    for (parent, child) in children {
        check_length(elements, child.index(), map.len())?;
        map.push(map[parent].clone());
    }
    Ok(())
}

fn check_length(elements: &'static str, expected: usize, found: usize) -> Result<(), EditError> {
    (found == expected)
        .then_some(())
        .ok_or(EditError::MapLength {
            elements,
            expected,
            found,
        })
}

#[cfg(test)]
mod tests;
