//! The options of `bench`.

use std::num::{NonZeroU32, NonZeroUsize};

use clap::Args;
use cotan::OrientationKind;
use cotan_io::Weld;

use crate::args::{InputPath, values};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan bench scan.ply --json

The job is a standard drag: along the longest side of the bounding box, a tenth of the vertices at
the lower end is held, a tenth at the upper end turned by 45 degrees and lifted. Seconds are medians
of wall time; other programs that run meanwhile make them longer.";

#[derive(Debug, Args)]
pub(crate) struct BenchArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz); the built-in model if none
    /// is given
    pub(crate) mesh: Option<InputPath>,
    /// Maximum number of times each phase is measured
    #[arg(long, value_name = "N", default_value = "5")]
    pub(crate) rounds: NonZeroU32,
    /// Orientation of the Laplacian coordinates
    #[arg(long, value_name = "NAME", default_value = OrientationKind::default().name(),
        value_parser = values::orientation())]
    pub(crate) orientation: OrientationKind,
    /// Treat vertices at the same place (exact), or within this distance, as one
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<Weld>,
    /// Number of threads [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print JSON
    #[arg(long)]
    pub(crate) json: bool,
}
