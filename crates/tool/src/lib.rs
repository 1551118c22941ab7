//! Code shared by cotan's programs, the command line and the editor.
//!
//! - [`handles_file`]: reading and writing of files that define handles.
//! - [`files`], [`paths`]: atomic writing of files, never over an input or another output.
//! - [`interrupt`]: removal of temporary files when a signal ends the program.
//! - [`color_scale`]: conversion of numbers to colours.
//! - [`numbers`]: errors with the indices of the user's file.
//! - [`memory`]: prediction of the memory that work takes.
//! - [`merged`]: the file of a merged mesh, with the data of both inputs.
//! - [`part_names`]: the parts of a model by the names of its file.
//! - [`repair`]: repairs of `cotan_io`, with holes faired by `cotan`.
//!
//! Nothing here prints.

pub mod color_scale;
pub mod error;
pub mod files;
pub mod handles_file;
pub mod interrupt;
pub mod memory;
pub mod merged;
mod nodes;
pub mod numbers;
pub mod part_names;
pub mod paths;
pub mod repair;

pub use color_scale::{ColorScale, Overflow};
pub use error::ToolError;
pub use memory::{MemoryError, MemoryLimit, Work};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
