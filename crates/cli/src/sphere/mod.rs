//! Sphere maps of mesh files, shared by `sphere`, `resample` and `morph`.

pub(crate) mod args;
mod landmarks;
mod mapping;
mod refusal;
mod report;
mod warnings;

pub(crate) use landmarks::pairs;
pub(crate) use mapping::{Mapped, Mapper, Turn};
pub(crate) use refusal::refuse;
pub(crate) use report::{GeometryImageFields, MapReport, Resampled, WrittenSphere};
pub(crate) use warnings::warn;
