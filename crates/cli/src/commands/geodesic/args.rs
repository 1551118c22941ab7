//! The options of `geodesic`.

use std::num::NonZeroUsize;

use clap::{ArgGroup, Args};

use crate::args::{MeshArgs, OutputPath, values};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan geodesic hand.ply --from 1200 -o distances.ply --picture distances.png
  cotan geodesic hand.ply --from 10,20,30 -o nearest.ply
  cotan geodesic hand.ply --at 0.1,2.5,-1 -o distances.ply

The output has the property `distance` at its vertices, in the unit of the mesh: the length of the
shortest way along the surface to the nearest source, within about 1 %. Vertices that no way joins
to a source are infinitely far. Write PLY; other formats have no such property.";

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("source").required(true).multiple(true).args(["from", "at"]))]
pub(crate) struct GeodesicArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// Measure from these vertices, by their indices in the file, counted from 0
    #[arg(long, value_name = "INDEX,...", value_delimiter = ',')]
    pub(crate) from: Vec<usize>,
    /// Measure from the point of the surface that is closest to this one; may be repeated
    #[arg(long, value_name = "X,Y,Z", value_parser = values::point, allow_hyphen_values = true)]
    pub(crate) at: Vec<[f64; 3]>,
    /// Time for which heat spreads, in squared mean edge lengths: more gives smoother distances
    #[arg(long, value_name = "M", value_parser = values::positive, default_value = "4")]
    pub(crate) time: f64,
    /// Number of lines of equal distance in the picture
    #[arg(long, value_name = "N", default_value = "20")]
    pub(crate) lines: NonZeroUsize,
    /// Draw the distances with lines of equal distance (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
}
