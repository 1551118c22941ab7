//! The 3D view: camera, picture, picking and selecting. It knows nothing of handles or jobs.
//!
//! Each frame a [`Camera`] looks into the rectangle that egui has for the picture, which gives a
//! [`CameraSnapshot`]. The [`Renderer`] draws by it, from within a paint callback; the [`Picker`]
//! tells by it what is under the pointer. `examples/view.rs` has all of it in one file.

pub mod camera;
pub mod pick;
pub mod render;
pub mod select;
pub mod snapshot;

pub use camera::{Camera, StandardView, UpAxis};
pub use cotan::geometry::Ray;
pub use pick::{Hit, Picker};
pub use render::{Line, Mark, Renderer, Shading, Style};
pub use select::{Reach, brush, lasso};
pub use snapshot::CameraSnapshot;
