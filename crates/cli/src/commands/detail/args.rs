//! The options of `detail`.

use clap::{ArgGroup, Args};
use cotan::smooth::DetailOptions;

use crate::args::{InputPath, MeshArgs, PartArgs, values};
use crate::commands::smooth::args::KeepArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan detail bust.ply -o caricature.ply --scale 2
  cotan detail base.obj -o mixed.obj --from rough.obj
  cotan detail ball.ply -o painted.ply --field mean_curvature

--field is a property of the vertices of a PLY file: the mean curvature that each is to have,
(k1 + k2) / 2, positive where convex, in one over the unit of the mesh.";

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("edit").required(true).args(["scale", "from", "field"]))]
pub(crate) struct DetailArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// Make details F times as strong: 0 takes them away, 2 doubles them
    #[arg(long, value_name = "F", value_parser = values::tolerance)]
    pub(crate) scale: Option<f64>,
    /// Take the details of another mesh with the same vertices and faces
    #[arg(long, value_name = "OTHER")]
    pub(crate) from: Option<InputPath>,
    /// Give every vertex the mean curvature that this property of the file says
    #[arg(long, value_name = "NAME")]
    pub(crate) field: Option<String>,
    /// Number of iterations
    #[arg(long, value_name = "N", default_value = "20")]
    iterations: usize,
    /// Weight that holds each vertex in place
    #[arg(long, value_name = "MU", value_parser = values::positive, default_value = "0.5")]
    anchor: f64,
    #[command(flatten)]
    pub(crate) part: PartArgs,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
}

impl DetailArgs {
    pub(crate) fn options(&self) -> DetailOptions {
        DetailOptions::default()
            .anchor(self.anchor)
            .iterations(self.iterations)
            .boundary(self.keep.boundary())
            .preserve(self.keep.preserve())
            .max_displacement(self.keep.max_displacement)
    }
}
