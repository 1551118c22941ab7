//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.

mod align;
mod barycentric;
mod error;
mod geometry_image;
mod interpolate;
mod locate;
mod longitude_latitude;
mod map;
mod moebius;
mod morph;
mod orient;
mod predicate;
mod ray_tree;
mod resample;
mod rotate;
mod rotation_search;
#[cfg(test)]
mod testing;

pub use align::Aligned;
pub use error::SphereError;
pub use geometry_image::{BitDepth, EncodedImage, GeometryImage};
pub use interpolate::Attribute;
pub use locate::{Located, PointLocation};
pub use longitude_latitude::CornerUvs;
pub use map::SphereMap;
pub use morph::Morph;
pub use predicate::{flipped_faces, is_upright};
