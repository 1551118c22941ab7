//! The options of `smooth`, and those that it shares with `detail`.

use std::num::NonZeroUsize;

use clap::Args;
use cotan::smooth::{Boundary, Preserve, SmoothMethod, SmoothOptions};

use crate::args::{InputPath, MeshArgs, OutputPath, values};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan smooth scan.ply -o smooth.ply --preserve-volume --report smooth.json
  cotan smooth part.obj -o clean.obj --method feature --truth original.obj
  cotan smooth scan.ply -o stronger.ply --anchor 0.3 --max-displacement 0.01

auto chooses between curvature (organic shapes) and feature (parts with creases) and says why.
anchored and paper are the paper's section 4.2, with every vertex or only one held; feature-edges
filters dihedral angles; taubin and implicit are there to compare with.";

/// The constraints to keep, and the outputs in addition to the mesh.
#[derive(Debug, Args)]
pub(crate) struct KeepArgs {
    /// Keep the volume of every closed component exactly
    #[arg(long)]
    preserve_volume: bool,
    /// Keep the area of every component exactly
    #[arg(long, conflicts_with = "preserve_volume")]
    preserve_area: bool,
    /// Let no vertex move farther than this, in the unit of the mesh
    #[arg(long, value_name = "D", value_parser = values::positive)]
    pub(crate) max_displacement: Option<f64>,
    /// Let the boundary of an open mesh move; it stays otherwise
    #[arg(long)]
    free_boundary: bool,
    /// Number of threads; it changes no byte of the result [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
    /// Draw the mesh before and after, coloured by its mean curvature (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
    /// A mesh with the same vertices and faces to compare the result with
    #[arg(long, value_name = "CLEAN")]
    pub(crate) truth: Option<InputPath>,
}

impl KeepArgs {
    pub(crate) fn preserve(&self) -> Preserve {
        match (self.preserve_volume, self.preserve_area) {
            (true, _) => Preserve::Volume,
            (_, true) => Preserve::Area,
            _ => Preserve::Nothing,
        }
    }

    pub(crate) fn boundary(&self) -> Boundary {
        if self.free_boundary {
            Boundary::Free
        } else {
            Boundary::Fixed
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct SmoothArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// How
    #[arg(long, visible_alias = "mode", value_name = "NAME", value_parser = values::smooth_method(),
        default_value = "auto")]
    method: SmoothMethod,
    /// Number of iterations [default: what the method needs]
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Which part of a step of the curvature is taken, above 0 and at most 1
    #[arg(long, value_name = "S", value_parser = values::positive, default_value = "1")]
    step: f64,
    /// Weight that holds each vertex in place; smaller smooths more
    /// [default: what suits the method and the noise of the mesh]
    #[arg(long, value_name = "MU", value_parser = values::positive)]
    anchor: Option<f64>,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
}

impl SmoothArgs {
    pub(crate) fn options(&self) -> SmoothOptions {
        SmoothOptions::default()
            .method(self.method)
            .iterations(self.iterations)
            .step(self.step)
            .anchor(self.anchor)
            .boundary(self.keep.boundary())
            .preserve(self.keep.preserve())
            .max_displacement(self.keep.max_displacement)
    }
}
