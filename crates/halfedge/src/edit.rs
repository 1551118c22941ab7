//! Local changes of the connectivity. Every edit checks first and changes then, so that a
//! refused edit leaves the mesh as it was; there are no tombstones, so that ids stay 0, 1, 2, …
//! The crate documentation lists them.

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

pub(crate) use checks::MOST_EDGES;
pub use collapse::{ClosedFace, Collapsed};
pub use error::EditError;
pub use flip::FlippedEdge;
pub use renumbering::Renumbering;
pub use split_edge::SplitEdge;
pub use split_face::{CutFace, SplitFace};
/// Appends for every child a clone of its parent's value. The children have the next numbers.
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
