//! Maps of closed genus-0 meshes onto the unit sphere that never flip a triangle.
//!
//! [`spherical`] computes a map: constant curvature in the generic flow (paper, section 4.1),
//! with repairs where that flips triangles. A [`SphereMap`] can only be created by checking every
//! triangle. [`embed`], [`relax`] and [`untangle`] are the building blocks, which work on any
//! mesh or map, and [`SphereQuality`] measures the result.
//!
//! A map can be used to locate points ([`SphereMap::point_location`]), interpolate attributes
//! ([`SphereMap::interpolate`]), remesh ([`SphereMap::remesh`]), unwrap
//! ([`SphereMap::longitude_latitude`], [`SphereMap::geometry_image`]), rotate and align, and
//! morph between two shapes ([`Morph`]).
//!
//! | modules | content |
//! |---|---|
//! | `spherical`, `options`, `curvature`, `project`, `round` | the flow to constant curvature |
//! | `hierarchy`, `cmcf`, `layout` | its fallbacks |
//! | `map`, `predicate`, `orient`, `corners`, `wedges`, `sums` | checked maps, exact predicates |
//! | `kernel`, `sweep`, `iterate`, `untangle`, `relax`, `energy` | repairing and improving a map |
//! | `quality` | distortion of angles and areas |
//! | `locate`, `ray_tree`, `barycentric`, `interpolate` | finding points, interpolating |
//! | `resample` | remeshing |
//! | `longitude_latitude`, `geometry_image` | unwrapping |
//! | `rotate`, `rotation_search`, `align`, `moebius`, `morph` | rotating, aligning and morphing |
//! | `error` | the errors |
//!
//! ```
//! use cotan::sphere::{SphereOptions, spherical};
//! // A shape remeshed by the even triangles of an icosphere.
//! let shape = cotan::shapes::creature::<f64>(40);
//! let sphere = spherical(&shape, &SphereOptions::default().authalic(1.0))?;
//! let remeshed = sphere.map.remesh(shape.positions(), 4)?;
//! assert_eq!(remeshed.num_vertices(), 2562);
//! # Ok::<(), cotan::sphere::SphereError>(())
//! ```

mod align;
mod barycentric;
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
mod relax;
mod resample;
mod rotate;
mod rotation_search;
mod round;
mod spherical;
mod sums;
mod sweep;
#[cfg(test)]
mod testing;
mod untangle;
mod wedges;

pub use align::Aligned;
pub use curvature::{AreaMeasure, ConstantCurvature};
pub use error::SphereError;
pub use geometry_image::{BitDepth, EncodedImage, GeometryImage};
pub use hierarchy::embed;
pub use interpolate::Attribute;
pub use locate::{Located, PointLocation};
pub use longitude_latitude::CornerUvs;
pub use map::SphereMap;
pub use morph::{Morph, towards_sphere};
pub use options::{Centering, SphereMethod, SphereOptions, SphereReport, Stage};
pub use predicate::{flipped_faces, is_upright};
pub use quality::{AngleErrors, SphereQuality, Spread, area_log_ratios};
pub use relax::{RelaxSettings, relax};
pub use spherical::{Spherical, spherical, spherical_observed};
pub use untangle::untangle;
