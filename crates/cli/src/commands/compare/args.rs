//! The options of `compare`.

use clap::Args;

use crate::args::{InputPath, OutputPath};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan compare before.obj after.obj
  cotan compare scan.ply simplified.ply --picture distances.png

Meshes with the same vertices and faces are compared vertex by vertex, others by the distances
between their surfaces; the output says which. The Hausdorff distance is the greatest distance of a
point of one surface from the other, given with an upper bound.

For the same vertices and faces A is the original. E_p is the change of the cotangent weights, E_g the change of the lengths of the
Laplacian coordinates, with A scaled to a bounding box of longest side 1.";

#[derive(Debug, Args)]
pub(crate) struct CompareArgs {
    /// The original mesh
    #[arg(value_name = "A")]
    pub(crate) original: InputPath,
    /// The other mesh
    #[arg(value_name = "B")]
    pub(crate) other: InputPath,
    /// A third shape of the same vertices and faces; the distance is that of B to it, not to A
    #[arg(long, value_name = "SHAPE")]
    pub(crate) distance_to: Option<InputPath>,
    /// Draw both meshes, coloured by the distance from the surface of the other (PNG). With
    /// --distance-to, draw A, B and SHAPE, coloured by the distance of the vertices from SHAPE
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
