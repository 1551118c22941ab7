//! What the programs of cotan share: the command line and the editor.
//!
//! Files that name handles, read and written ([`handles_file`]); files that are written whole or
//! not at all ([`files`]), and never over an input or each other ([`paths`]); temporary files
//! removed when a signal ends the program ([`interrupt`]); from numbers to colours
//! ([`color_scale`]); messages in the numbers of the user's file ([`numbers`]); the memory that
//! work takes ([`memory`]); and repairs of `cotan_io` with holes that `cotan` makes smooth
//! ([`repair`]). Nothing here prints.

pub mod color_scale;
pub mod error;
pub mod files;
pub mod handles_file;
pub mod interrupt;
pub mod memory;
pub mod numbers;
pub mod paths;
pub mod repair;

pub use color_scale::{ColorScale, Overflow};
pub use error::ToolError;
pub use memory::{MemoryError, MemoryLimit, Work};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
