//! The 3D view: camera, picture, picking and selecting. It knows nothing of handles or jobs.

pub mod camera;
pub mod pick;
pub mod render;
pub mod select;
pub mod snapshot;

mod tree;

pub use camera::{Camera, StandardView, UpAxis};
pub use pick::{Hit, Picker};
pub use render::{Line, Mark, Renderer, Shading, Style};
pub use select::{Reach, brush, lasso};
pub use snapshot::{CameraSnapshot, Ray};
