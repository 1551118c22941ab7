//! The options of `reconstruct`.

use std::num::NonZeroUsize;

use clap::Args;
use cotan::DeformOptions;

use crate::args::values;
use crate::commands::deform::args::{InputArgs, MethodArgs, RunArgs};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan reconstruct bunny.ply --handles pins.txt --iterations 200 -o rebuilt.ply --report r.json

The first solve has Laplacian coordinates of zero: the shape must come from the lengths of the
Laplacian coordinates and the weights alone. Three to six handles that stay where they are say where
the shape is.";

#[derive(Debug, Args)]
pub(crate) struct ReconstructArgs {
    #[command(flatten)]
    pub(crate) input: InputArgs,
    /// Number of iterations
    #[arg(long, value_name = "N")]
    iterations: NonZeroUsize,
    #[command(flatten)]
    method: MethodArgs,
    /// Stop earlier, when no vertex moves by more than this ratio of the bounding box's diagonal
    #[arg(long, value_name = "X", value_parser = values::tolerance, default_value = "0")]
    tolerance: f64,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

impl ReconstructArgs {
    /// The options of [`cotan::reconstruct`].
    pub(crate) fn options(&self) -> DeformOptions {
        self.method
            .options()
            .tolerance(self.tolerance)
            .iteration_limit(self.iterations.get())
            .for_reconstruction()
    }
}
