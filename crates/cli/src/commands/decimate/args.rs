//! The options of `decimate`.

use clap::Args;
use cotan::surface::DecimateOptions;
use cotan_io::{COLOR, UV};

use crate::args::{MeshArgs, values};
use crate::tessellation::args::OutcomeArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan decimate scan.ply -o small.ply --faces 10000 --report small.json
  cotan decimate scan.ply -o small.ply --ratio 0.1
  cotan decimate part.stl -o light.stl --error 0.01
  cotan decimate painted.ply -o small.ply --ratio 0.1 --color-weight 0.1

Edges are collapsed, the cheapest first, by the distance from the planes of the triangles that were
merged. Boundaries, topology, and seams of texture coordinates and materials are kept.";

#[derive(Debug, Args)]
pub(crate) struct DecimateArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    #[command(flatten)]
    target: TargetArgs,
    #[command(flatten)]
    weights: WeightArgs,
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

/// The attributes that count as a cost.
#[derive(Debug, Args)]
struct WeightArgs {
    /// Keep texture coordinates too: a difference of 1 costs as much as a distance of WEIGHT times
    /// the size of the mesh (its longest side)
    #[arg(long, value_name = "WEIGHT", value_parser = values::positive)]
    uv_weight: Option<f64>,
    /// Keep colours too, with components from 0 to 1, in the same way
    #[arg(long, value_name = "WEIGHT", value_parser = values::positive)]
    color_weight: Option<f64>,
}

impl DecimateArgs {
    /// The names of the properties that count as a cost, with the options that ask for them and
    /// their weights.
    pub(crate) fn weights(&self) -> impl Iterator<Item = (&'static str, &'static str, f64)> {
        let weights = [
            (UV, "--uv-weight", self.weights.uv_weight),
            (COLOR, "--color-weight", self.weights.color_weight),
        ];
        weights
            .into_iter()
            .filter_map(|(name, option, weight)| Some((name, option, weight?)))
    }

    pub(crate) fn options(&self, num_faces: usize) -> DecimateOptions {
        match (&self.target.faces, &self.target.ratio, &self.target.error) {
            (_, _, Some(error)) => DecimateOptions::to_error(*error),
            (_, Some(ratio), _) => DecimateOptions::to_faces((ratio * num_faces as f64) as usize),
            (faces, _, _) => DecimateOptions::to_faces(faces.unwrap_or(num_faces)),
        }
    }
}
