//! The options of `remesh`.

use clap::Args;
use cotan::halfedge::EdgeId;
use cotan::surface::{Features, RemeshOptions};

use crate::args::{MeshArgs, values};
use crate::tessellation::args::OutcomeArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan remesh scan.ply -o even.ply --length 0.5 --report even.json
  cotan remesh part.stl -o even.stl --relative-length 0.5 --feature-angle 30
  cotan remesh scan.ply -o adapted.ply --error 0.01

Without a length, edges become as long as the mean edge is. --error adapts the length to the
curvature. Boundaries, creases, and seams of texture coordinates and materials are kept.";

#[derive(Debug, Args)]
pub(crate) struct RemeshArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// The length of the new edges, in the unit of the mesh
    #[arg(long, value_name = "L", value_parser = values::positive)]
    length: Option<f64>,
    /// The length of the new edges, in mean edge lengths of the mesh [default: 1]
    #[arg(long, value_name = "X", value_parser = values::positive, conflicts_with = "length")]
    relative_length: Option<f64>,
    /// Adapt the length to the curvature: the distance of an edge's middle from the surface. The
    /// length then is between a third and three times the one asked for
    #[arg(long, value_name = "D", value_parser = values::positive)]
    error: Option<f64>,
    /// Keep edges as creases whose triangles differ by this angle, in degrees; 180 keeps none
    #[arg(long, value_name = "DEGREES", value_parser = values::positive, default_value = "45")]
    feature_angle: f64,
    /// Number of rounds
    #[arg(long, value_name = "N", default_value = "10")]
    iterations: usize,
    #[command(flatten)]
    pub(crate) outcome: OutcomeArgs,
}

impl RemeshArgs {
    /// The options for a mesh with the given mean edge length and seams.
    pub(crate) fn options(&self, mean: f64, seams: Vec<EdgeId>) -> RemeshOptions {
        let relative = self.relative_length.unwrap_or(1.0);
        let length = self.length.unwrap_or(relative * mean);
        let options = match self.error {
            Some(error) => RemeshOptions::adaptive(error, length / 3.0, 3.0 * length),
            None => RemeshOptions::uniform(length),
        };
        let features = if self.feature_angle < 180.0 {
            Features::creases(self.feature_angle.to_radians())
        } else {
            Features::none()
        };
        options
            .features(features.with_edges(seams))
            .iterations(self.iterations)
    }
}
