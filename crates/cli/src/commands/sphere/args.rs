//! The options of `sphere`.

use clap::Args;

use crate::args::{EmbedArgs, OutputPath, values};
use crate::sphere::args::{ClosedMeshArgs, MapArgs, MapRunArgs, TurnArgs};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan sphere cotan-demo/before.obj -o sphere.obj --picture sphere.png --report sphere.json
  cotan sphere brain.ply -o sphere.ply --authalic 1       (areas are kept, not angles)
  cotan sphere scan.ply -o sphere.ply --fill-holes --precision f32

The mesh must be closed, in one piece, and without a tunnel through it. OUT is the file of the mesh
with every vertex on the unit sphere; no triangle is flipped there, which exact arithmetic has
checked, or the command ends with an error (formats of 32-bit numbers are read back, and a warning
counts the triangles that their rounding flips).";

#[derive(Debug, Args)]
pub(crate) struct SphereArgs {
    #[command(flatten)]
    pub(crate) input: ClosedMeshArgs,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    #[command(flatten)]
    pub(crate) run: MapRunArgs,
    #[command(flatten)]
    pub(crate) turn: TurnArgs,
    /// Draw the mesh and the sphere, coloured by what the map does to areas (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
    /// Give OUT texture coordinates: longitude and latitude, with a cut at 180 degrees. The file
    /// is then written anew from what more than one format can hold
    #[arg(long)]
    pub(crate) uv: bool,
    /// Write the positions of the mesh as the colours of a square (PNG, 16 bits), the sphere
    /// unfolded as an octahedron; the report says what the colours stand for
    #[arg(long, value_name = "P.png")]
    pub(crate) geometry_image: Option<OutputPath>,
    /// Pixels of a side of the geometry image; odd
    #[arg(long, value_name = "N", default_value = "257", value_parser = values::odd_size)]
    pub(crate) size: usize,
}
