//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.

mod align;
mod cmcf;
mod corners;
mod curvature;
mod energy;
mod error;
mod geometry_image;
mod hierarchy;
mod interpolate;
mod iterate;
mod kernel;
mod layout;
mod locate;
mod longitude_latitude;
mod map;
mod moebius;
mod morph;
mod options;
mod orient;
mod predicate;
mod project;
mod quality;
mod ray_tree;
mod resample;
mod rotate;
mod rotation_search;
mod round;
mod spherical;
mod sums;
mod sweep;
#[cfg(test)]
mod testing;

pub use align::Aligned;
pub use curvature::{AreaMeasure, ConstantCurvature};
pub use error::SphereError;
pub use geometry_image::{BitDepth, EncodedImage, GeometryImage};
pub use hierarchy::embed;
pub use interpolate::Attribute;
pub use locate::{Located, PointLocation};
pub use longitude_latitude::CornerUvs;
pub use map::SphereMap;
pub use morph::Morph;
pub use options::{Centering, SphereMethod, SphereOptions, SphereReport, Stage};
pub use predicate::{flipped_faces, is_upright};
pub use quality::{AngleErrors, SphereQuality, Spread, area_log_ratios};
pub use spherical::{Spherical, spherical, spherical_observed};
