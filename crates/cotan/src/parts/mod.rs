//! Models of several parts: teeth, nails, eyes, clothes, screws.
//!
//! The connected components of a mesh are its *parts*. Those with handles *drive*: they are solved
//! as if they were alone. The others follow as *passengers*, in layers: a part is placed by its
//! contacts with the parts placed before it. Small parts move as rigid bodies, decals with the
//! surface below them, and large ones are deformed by the hybrid energy with soft handles at their
//! contacts.
//!
//! **Source**: ours.

mod contacts;
mod extract;
mod following;
mod model;
mod passenger;
mod plan;
mod proximity;
mod report;
mod roles;
mod survey;
mod turns;
mod workshop;

pub(crate) use following::{Following, turns_in_flow};
pub(crate) use passenger::Effort;
pub use report::PartReport;
pub use roles::Role;
pub use survey::survey;
