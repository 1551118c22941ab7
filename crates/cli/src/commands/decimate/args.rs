//! The options of `decimate`.

use clap::Args;
use cotan::surface::DecimateOptions;

use crate::args::{MeshArgs, values};
use crate::tessellation::args::OutcomeArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan decimate scan.ply -o small.ply --faces 10000 --report small.json
  cotan decimate scan.ply -o small.ply --ratio 0.1
  cotan decimate part.stl -o light.stl --error 0.01

Edges are collapsed, the cheapest first, by the distance from the planes of the triangles that were
merged. Boundaries, topology, and seams of texture coordinates and materials are kept.";

#[derive(Debug, Args)]
pub(crate) struct DecimateArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    #[command(flatten)]
    target: TargetArgs,
    #[command(flatten)]
    pub(crate) outcome: OutcomeArgs,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct TargetArgs {
    /// Stop at this number of triangles
    #[arg(long, value_name = "N")]
    faces: Option<usize>,
    /// Stop at this share of the triangles, from 0 to 1
    #[arg(long, value_name = "SHARE", value_parser = values::share)]
    ratio: Option<f64>,
    /// Stop before the root mean square distance from the merged triangles exceeds this, in the
    /// unit of the mesh
    #[arg(long, value_name = "D", value_parser = values::positive)]
    error: Option<f64>,
}

impl DecimateArgs {
    pub(crate) fn options(&self, num_faces: usize) -> DecimateOptions {
        match (&self.target.faces, &self.target.ratio, &self.target.error) {
            (_, _, Some(error)) => DecimateOptions::to_error(*error),
            (_, Some(ratio), _) => DecimateOptions::to_faces((ratio * num_faces as f64) as usize),
            (faces, _, _) => DecimateOptions::to_faces(faces.unwrap_or(num_faces)),
        }
    }
}
