//! The options of `denoise`.

use clap::Args;
use cotan::smooth::{SmoothMethod, SmoothOptions};

use crate::args::{MeshArgs, PartArgs, values};
use crate::commands::smooth::args::{KeepArgs, StepArgs};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan denoise scan.ply -o clean.ply --preserve-volume --report clean.json
  cotan denoise part.obj -o clean.obj --method feature --truth original.obj
  cotan denoise scan.ply -o stronger.ply --anchor 0.3 --max-displacement 0.01

auto leaves exact parts alone, chooses between curvature (organic shapes) and feature (parts with
creases), and says why. anchored and paper are the paper's section 4.2, with every vertex or only
one held; feature-edges filters dihedral angles; taubin and implicit are there to compare with.";

#[derive(Debug, Args)]
pub(crate) struct DenoiseArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// How
    #[arg(long, visible_alias = "mode", value_name = "NAME", value_parser = values::smooth_method(),
        default_value = "auto")]
    method: SmoothMethod,
    #[command(flatten)]
    steps: StepArgs,
    #[command(flatten)]
    pub(crate) part: PartArgs,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
}

impl DenoiseArgs {
    pub(crate) fn options(&self) -> SmoothOptions {
        self.steps.options(self.method, &self.keep)
    }
}
