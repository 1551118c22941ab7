//! The 3D view: camera, picture, picking and selecting. It knows nothing of handles or jobs.

pub mod camera;
pub mod pick;
pub mod render;
pub mod select;
pub mod snapshot;

pub use camera::{Camera, StandardView, UpAxis};
pub use render::{Renderer, Shading, Style};
pub use snapshot::{CameraSnapshot, Ray};
