//! The interactive editor: a window that shows a [`cotan_workspace::Workspace`] and turns input
//! into its commands.
//!
//! Everything that concerns the model is in the workspace. This crate has what belongs to a
//! window: camera, drawing and picking ([`view`]), panels, dialogs and keys ([`app`]).

pub mod app;
pub mod view;
