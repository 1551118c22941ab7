//! Sphere maps of mesh files, shared by `sphere`, `resample`, `morph` and `detail`.

mod align;
pub(crate) mod args;
mod landmarks;
mod mapping;
mod refusal;
mod report;
mod warnings;

pub(crate) use align::{Common, aligned};
pub(crate) use landmarks::pairs;
pub(crate) use mapping::{Mapped, Mapper, Turn};
pub(crate) use refusal::refuse;
pub(crate) use report::{GeometryImageFields, MapReport, Resampled, WrittenSphere};
pub(crate) use warnings::warn;
