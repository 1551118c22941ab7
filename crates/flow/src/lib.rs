//! The one generic iteration of curvature-flow Laplacian editing.
//!
//! A [`Flow`] alternates two steps until nothing moves (Au, Tai, Fu, Liu 2005, section 3.2):
//!
//! 1. solve for the positions whose Laplacian coordinates are nearest to the wanted ones ℓ, with
//!    the handles in place. The matrix is that of the original mesh and never changes;
//! 2. rebuild ℓ from the new positions: a [`ScalarFieldUpdater`] says how long each ℓ_i is to be,
//!    an [`Orientation`] which way it points.
//!
//! Three rules do so, each in a file of its own in `rule/`: a *fixed point* of any
//! [`Orientation`]; the *descent* of an energy, whose local step ([`LocalGlobal`]) takes the place
//! of the orientation; and *projected* steps, which a [`Projection`] carries back.
//!
//! Inside, everything is in box units: the bounding box's lower corner at 0, its longest side 1.

mod accelerate;
mod box_units;
mod builder;
mod cells;
mod current;
mod energy;
mod error;
mod fit;
mod flow;
mod four;
mod gradients;
mod nearest_rotation;
mod net;
mod orientation;
mod passes;
mod per_rest;
mod point_handles;
mod point_tie;
mod projection;
mod report;
mod rest;
mod rule;
mod run;
mod schedule;
mod start;
mod state;
mod stated_turns;
mod targets;
mod ties;
mod updater;
mod vectors;
mod winding;
mod workspace;

pub use box_units::BoxUnits;
pub use builder::{Acceleration, DEFAULT_ITERATION_LIMIT, DEFAULT_TOLERANCE, FlowBuilder, Start};
pub use energy::{Energy, FittedCells, Hybrid, LocalGlobal, NextStep, Stiffness};
pub use error::FlowError;
pub use flow::Flow;
pub use nearest_rotation::nearest_rotation;
pub use orientation::{AlongNormal, BestRotation, Limited, Orientation, Reflect, ReflectFirst};
pub use per_rest::PerRest;
pub use point_handles::predicted_point_handle_bytes;
pub use point_tie::PointTie;
pub use projection::Projection;
pub use report::{LostTurn, Report, StepReport, StopReason};
pub use rest::Rest;
pub use schedule::Schedule;
pub use start::FirstGuess;
pub use state::FlowState;
pub use updater::{KeepMagnitude, PrescribedField, RescaleByArea, ScalarFieldUpdater};
pub use winding::Winding;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
