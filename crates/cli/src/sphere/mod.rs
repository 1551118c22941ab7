//! A mesh file on the sphere: what the commands share that go by way of a sphere map.

mod mapping;
mod picture;
mod refusal;
mod report;
mod written;

pub(crate) use mapping::{Mapped, Mapper};
pub(crate) use picture::area_picture;
pub(crate) use report::{Phases, SphereRun, warn};
pub(crate) use written::warn_of_short_numbers;
