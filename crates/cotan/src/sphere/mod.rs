//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.

mod corners;
mod energy;
mod error;
mod hierarchy;
mod kernel;
mod layout;
mod map;
mod predicate;
mod relax;
mod sweep;
mod untangle;

pub use error::SphereError;
pub use hierarchy::embed;
pub use map::SphereMap;
pub use predicate::{flipped_faces, is_upright};
pub use relax::{RelaxSettings, relax};
pub use untangle::untangle;
