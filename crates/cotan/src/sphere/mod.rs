//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.

mod cmcf;
mod corners;
mod curvature;
mod energy;
mod error;
mod error;
mod hierarchy;
mod iterate;
mod kernel;
mod layout;
mod map;
mod moebius;
mod options;
mod predicate;
mod project;
mod quality;
mod round;
mod spherical;
mod sums;
mod sweep;

pub use curvature::{AreaMeasure, ConstantCurvature};
pub use error::SphereError;
pub use hierarchy::embed;
pub use map::SphereMap;
pub use options::{Centering, SphereMethod, SphereOptions, SphereReport, Stage};
pub use predicate::{flipped_faces, is_upright};
pub use quality::{AngleErrors, SphereQuality, Spread, area_log_ratios};
pub use spherical::{Spherical, spherical, spherical_observed};
