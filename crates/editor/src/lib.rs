//! The interactive editor: a window that shows a mesh and its handles, with the solver on a
//! thread of its own.
//!
//! This crate does no mesh editing of its own: all three jobs come from the crate [`cotan`].

pub mod app;
pub mod files;
mod handle_groups;
pub mod meter;
mod newest;
pub mod rescue;
pub mod scene;
pub mod solver;
pub mod task;
pub mod view;
