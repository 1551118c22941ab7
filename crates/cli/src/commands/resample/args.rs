//! The options of `resample`.

use clap::Args;

use crate::args::{OutputPath, values};
use crate::sphere::args::{ClosedMeshArgs, MapArgs, MapRunArgs, TurnArgs};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan resample cotan-demo/before.obj --level 6 --authalic 1 -o even.obj

The shape on the triangles of an icosphere, placed by way of the sphere map. A conformal map leaves
few of them for limbs; --authalic 1 gives every part its share.";

#[derive(Debug, Args)]
pub(crate) struct ResampleArgs {
    #[command(flatten)]
    pub(crate) input: ClosedMeshArgs,
    /// Subdivisions of the icosphere, at most 8: 10 * 4^N + 2 vertices
    #[arg(long, value_name = "N", value_parser = values::level())]
    pub(crate) level: u32,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    #[command(flatten)]
    pub(crate) turn: TurnArgs,
    #[command(flatten)]
    pub(crate) run: MapRunArgs,
}
