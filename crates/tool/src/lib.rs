//! What the programs of cotan share: the command line and the editor.
//!
//! Files that name handles, read and written ([`handles_file`]); files that are written whole or not
//! at all ([`files`]); from numbers to colours ([`color_scale`]); messages in the numbers of the
//! user's file ([`numbers`]); and repairs of `cotan_io` with holes that `cotan` makes smooth
//! ([`repair`]). Nothing here prints.

pub mod color_scale;
pub mod error;
pub mod files;
pub mod handles_file;
pub mod numbers;
pub mod repair;

pub use color_scale::{ColorScale, Overflow};
pub use error::ToolError;
