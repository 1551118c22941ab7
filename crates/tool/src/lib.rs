//! What the programs of cotan share: the command line and the editor.
//!
//! Files that name handles, read and written ([`handles_file`]); files that are written whole or not
//! at all ([`files`]), and never over an input or each other ([`paths`]); temporary files removed when
//! a signal ends the program ([`interrupt`]); from numbers to colours ([`color_scale`]); and messages in
//! the numbers of the user's file ([`numbers`]). Nothing here prints, and nothing here edits a mesh.

pub mod color_scale;
pub mod error;
pub mod files;
pub mod handles_file;
pub mod interrupt;
pub mod numbers;
pub mod paths;

pub use color_scale::{ColorScale, Overflow};
pub use error::ToolError;
