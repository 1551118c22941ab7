//! The options of `info`.

use clap::Args;
use cotan_io::Weld;

use crate::args::{InputPath, values};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan info bunny.ply --json

Meshes that are not manifold are described too; their defects are listed with their element, and
JSON lists --limit of each kind. `cotan repair` cures what can be cured without guessing a shape.
Vertices and faces have the numbers of the file, counted from 0.";

#[derive(Debug, Args)]
pub(crate) struct InfoArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Treat vertices at the same place (exact), or within this distance, as one
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<Weld>,
    /// Maximum number of defects of a kind that are listed in JSON
    #[arg(long, value_name = "N", default_value = "100")]
    pub(crate) limit: usize,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
