//! Mesh files on the sphere, shared by the commands that use a sphere map.

mod geometry_image;
mod landmarks;
mod mapping;
mod picture;
mod polygons;
mod refusal;
mod report;
mod texture;
mod unused;
mod written;

pub(crate) use geometry_image::geometry_image;
pub(crate) use landmarks::{LandmarksError, pairs};
pub(crate) use mapping::{Input, Mapped, Mapper, Turn};
pub(crate) use picture::area_picture;
pub(crate) use polygons::{Upright, upright};
pub(crate) use report::{Phases, Resampled, SphereRun, WrittenSphere, warn};
pub(crate) use texture::with_texture;
pub(crate) use unused::{join_welded, place_unused, sphericity_error};
pub(crate) use written::warn_of_short_numbers;
