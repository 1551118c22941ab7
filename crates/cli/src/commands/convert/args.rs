//! The options of `convert`.

use clap::Args;

use crate::args::{EmbedArgs, InputPath, OutputPath};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan convert scan.ply scan.obj

The extension of OUT names the format; a .gz behind it compresses. Vertices and faces
keep their order; what the new format cannot hold is named in a warning.";

#[derive(Debug, Args)]
pub(crate) struct ConvertArgs {
    /// Mesh file to read
    #[arg(value_name = "IN")]
    pub(crate) input: InputPath,
    /// Mesh file to write
    #[arg(value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
}
