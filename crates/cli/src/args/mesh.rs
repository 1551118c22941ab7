//! The options of commands that read one mesh and write another.

use clap::Args;
use cotan_io::Weld;

use super::{EmbedArgs, InputPath, OutputPath, values};

/// The input mesh and the output.
#[derive(Debug, Args)]
pub(crate) struct MeshArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Repair the mesh first, as `cotan repair` without options does
    #[arg(long)]
    pub(crate) repair: bool,
    /// Treat vertices at the same place (exact), or within this distance, as one
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<Weld>,
}
