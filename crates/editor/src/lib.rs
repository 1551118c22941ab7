//! The interactive editor: a window on a mesh, its handles, and the solver beside it.
//!
//! Nothing of mesh editing is computed here: all three jobs are those of the crate [`cotan`].

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
