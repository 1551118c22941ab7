//! Details that are carried from one surface to another with other triangles.
//!
//! A surface is split into its base, which is smooth, and heights along the base's normals
//! ([`Detail`]). The heights are sampled at corresponding points of another surface
//! ([`Correspondence`]) and applied along the normals of its base:
//!
//! ```text
//! h = (x − x̄) · n̄        h ← h − low-pass h        x' = x_T + s h n̄_T
//! ```
//!
//! Both surfaces are measured in square roots of their area.
//!
//! | module | content |
//! |---|---|
//! | `base` | the low-pass of a surface |
//! | `heights` | details, and operations on them |
//! | `correspondence` | corresponding points, by maps to the sphere or closest points |
//! | `stretch` | how far a correspondence distorts |
//! | `apply` | displacements, damped where faces would fold |
//! | `options`, `error` | settings and errors |
//!
//! **Source**: paper, section 4 (surface details mixing). It transfers the curvature between meshes
//! of one connectivity, as [`crate::smooth::TransferredCurvature`] does. Rebuilt from a sampled
//! curvature field, the test surfaces missed the truth by 70 to 90 % of the details' height;
//! heights that are filtered once more miss it by 15 to 40 %.

mod apply;
mod base;
mod correspondence;
mod error;
mod heights;
mod options;
mod stretch;

#[cfg(test)]
mod tests;

pub use apply::Applied;
pub use base::BaseSurface;
pub use correspondence::{Correspondence, CorrespondingPoint};
pub use error::DetailError;
pub use heights::Detail;
pub use options::{ApplyOptions, BaseOptions, Wavelength};
pub use stretch::Stretch;
