//! The 3D view: camera, rendering, picking and selection. It does not depend on handles or jobs.
//!
//! In each frame a [`Camera`] and the rectangle of the picture give a [`CameraSnapshot`]. The
//! [`Renderer`] draws with it from a paint callback, and the [`Picker`] uses it to find what is
//! under the pointer. `examples/view.rs` shows everything in one file.

pub mod camera;
pub mod pick;
pub mod render;
pub mod select;
pub mod snapshot;

pub use camera::{Camera, StandardView, UpAxis};
pub use cotan::geometry::Ray;
pub use pick::{Hit, Picker};
pub use render::{Light, Line, Mark, Renderer, Shading, Style};
pub use select::{Reach, brush, lasso};
pub use snapshot::CameraSnapshot;
