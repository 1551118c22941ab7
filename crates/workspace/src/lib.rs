//! An interactive mesh editor without its window.
//!
//! A [`Workspace`] holds the open [`Model`]: its mesh, and a [`History`] of [`Scene`]s (shape,
//! handles, masks, selection, settings). Everything that a person does is a [`Command`];
//! [`Workspace::apply`] carries it out and returns the [`Effect`]s that a window has to show. The
//! commands that change the scene are recorded. That one list gives undo and redo, the history,
//! recovery after a crash, and scripted tests:
//!
//! ```
//! use cotan_workspace::{Combine, Command, Role, Workspace};
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("bar.obj");
//! # let bar = cotan::shapes::bar::<f64>([4.0, 1.0, 1.0], [16, 4, 4]);
//! # let document = cotan_io::Document::from_mesh(bar.connectivity(), bar.positions())?;
//! # cotan_io::save(&document, &path)?;
//!
//! let mut workspace = Workspace::start(|| {})?;
//! workspace.apply(Command::Open { path });
//! workspace.finish();
//! workspace.apply(Command::SelectAll);
//! workspace.apply(Command::MakeHandle { role: Role::Fixed });
//! assert_eq!(workspace.scene().map(|s| s.handles().len()), Some(1));
//! workspace.apply(Command::Undo);
//! assert_eq!(workspace.scene().map(|s| s.handles().len()), Some(0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The solver, long jobs and measurements ([`meter`]) have a thread each. Nothing here waits for
//! them, except [`Workspace::finish`], which is for scripts.

pub mod files;
pub mod meter;
pub mod selection;
pub mod solver;

mod brush;
mod command;
mod edit;
mod effect;
mod handle;
mod handle_groups;
mod history;
mod jobs;
mod mask;
mod mirror;
mod model;
mod newest;
mod plain;
mod record;
mod refused;
mod scene;
mod settings;
mod shape;
mod task;
mod transform;
mod workspace;

pub use brush::{Brush, Paint};
pub use command::{Command, Job, Moved, Over};
pub use effect::{Effect, Notice};
pub use handle::{HandleGroup, Origin, Role, job_handles};
pub use history::{History, Step};
pub use jobs::Morph;
pub use mask::NamedMask;
pub use mirror::Mirror;
pub use model::Model;
pub use newest::lock;
pub use record::SceneRecord;
pub use refused::{After, Refused};
pub use scene::{Props, Scene};
pub use selection::Combine;
pub use settings::{Details, Follow, Influence, Others, Settings, Smooth, Way, editor_options};
pub use shape::Shape;
pub use transform::{Kind, Transform, Typed, Typing};
pub use workspace::{Arrival, Workspace};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
