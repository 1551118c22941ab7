//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.

mod error;
mod map;
mod moebius;
mod predicate;

pub use error::SphereError;
pub use map::SphereMap;
pub use predicate::{flipped_faces, is_upright};
