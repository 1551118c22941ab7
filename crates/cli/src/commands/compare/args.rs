//! The options of `compare`.

use clap::Args;

use crate::args::InputPath;

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan compare before.obj after.obj

A is the original. E_p is the change of the cotangent weights, E_g the change of the lengths of the
Laplacian coordinates, with A scaled to a bounding box of longest side 1.";

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// The original mesh
    #[arg(value_name = "A")]
    pub(crate) original: InputPath,
    /// The other mesh: same vertices and faces, other positions
    #[arg(value_name = "B")]
    pub(crate) other: InputPath,
    /// A third shape of the same vertices and faces; the distance is that of B to it, not to A
    #[arg(long, value_name = "SHAPE")]
    pub(crate) distance_to: Option<InputPath>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
