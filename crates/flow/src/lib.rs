//! The one generic iteration of curvature-flow Laplacian editing.
//!
//! A [`Flow`] alternates two steps until nothing moves (Au, Tai, Fu, Liu 2005, section 3.2):
//!
//! 1. solve for the positions whose Laplacian coordinates are nearest to the wanted ones ℓ, with
//!    the handles in place. The matrix is that of the original mesh and never changes;
//! 2. rebuild ℓ from the new positions: a [`ScalarFieldUpdater`] says how long each ℓ_i is to be,
//!    an [`Orientation`] which way it points.
//!
//! Inside, everything is in box units: the bounding box's lower corner at 0, its longest side 1.

mod anderson;
mod builder;
mod descent;
mod error;
mod fans;
mod flow;
mod lbfgs;
mod orientation;
mod passes;
mod polar;
mod projection;
mod report;
mod rest;
mod schedule;
mod start;
mod state;
mod step;
mod updater;
mod vectors;

pub use builder::{Acceleration, DEFAULT_ITERATION_LIMIT, DEFAULT_TOLERANCE, FlowBuilder, Start};
pub use error::FlowError;
pub use flow::Flow;
pub use orientation::{
    AlongNormal, BestRotation, Energy, Hybrid, Limited, Orientation, Reflect, ReflectFirst,
};
pub use polar::nearest_rotation;
pub use projection::Projection;
pub use report::{Report, StepReport, StopReason};
pub use rest::Rest;
pub use schedule::Schedule;
pub use state::{FlowState, Quantities};
pub use updater::{KeepMagnitude, RescaleByArea, ScalarFieldUpdater};
