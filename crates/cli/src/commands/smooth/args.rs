//! The options of `smooth`, and those that it shares with `denoise` and `detail`.

use std::num::NonZeroUsize;

use clap::Args;
use cotan::SchemeKind;
use cotan::smooth::{Boundary, BumpSize, BySizeOptions, Preserve, SmoothMethod, SmoothOptions};

use crate::args::values::{self, Length};
use crate::args::{InputPath, MeshArgs, OutputPath, PartArgs};

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan smooth scan.ply --size 2% -o smooth.ply --preserve-volume --report smooth.json
  cotan smooth scan.ply --size 0.5 --mask sphere:0,0,1,3 --falloff 1 -o part.ply
  cotan smooth scan.ply --method taubin -o taubin.ply

Bumps smaller than the size go, larger ones stay. To remove noise only, use cotan denoise, which
also explains the methods.";

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
    /// Let the boundary of an open mesh move; by default it stays in place
    #[arg(long)]
    free_boundary: bool,
    /// Number of threads; the result does not depend on it [default: one per core]
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
    /// Width of the smallest bump that is kept: a length in the unit of the mesh, or a share of
    /// its longest side in per cent [default: 2%]
    #[arg(long, value_name = "S", value_parser = values::length_or_share,
        conflicts_with_all = ["method", "scheme", "iterations", "step", "anchor"])]
    size: Option<Length>,
    /// Smooth by another method than by size
    #[arg(long, visible_alias = "mode", value_name = "NAME", value_parser = values::smooth_method())]
    pub(crate) method: Option<SmoothMethod>,
    #[command(flatten)]
    steps: StepArgs,
    #[command(flatten)]
    pub(crate) part: PartArgs,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
}

/// The options of methods other than that by size.
#[derive(Debug, Args)]
pub(crate) struct StepArgs {
    /// Weights of the Laplacian in the methods anchored, paper and implicit; the others have
    /// weights of their own [default: cotangent]
    #[arg(long, value_name = "NAME", value_parser = values::scheme())]
    scheme: Option<SchemeKind>,
    /// Number of iterations of a method [default: as many as it needs]
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Fraction of a step of the curvature that a method takes, above 0 and at most 1 [default: 1]
    #[arg(long, value_name = "S", value_parser = values::positive)]
    step: Option<f64>,
    /// Weight by which a method holds each vertex in place; smaller smooths more
    /// [default: chosen for the method and the noise of the mesh]
    #[arg(long, value_name = "MU", value_parser = values::positive)]
    anchor: Option<f64>,
}

impl StepArgs {
    pub(crate) fn options(&self, method: SmoothMethod, keep: &KeepArgs) -> SmoothOptions {
        SmoothOptions::default()
            .method(method)
            .scheme(self.scheme.unwrap_or_default())
            .iterations(self.iterations)
            .step(self.step.unwrap_or(1.0))
            .anchor(self.anchor)
            .boundary(keep.boundary())
            .preserve(keep.preserve())
            .max_displacement(keep.max_displacement)
    }

    fn is_given(&self) -> bool {
        self.scheme.is_some()
            || self.iterations.is_some()
            || self.step.is_some()
            || self.anchor.is_some()
    }
}

impl SmoothArgs {
    /// The settings of a method, if one is named or has a setting of its own.
    pub(crate) fn by_method(&self) -> Option<SmoothOptions> {
        let default = self.steps.is_given().then(SmoothMethod::default);
        let method = self.method.or(default)?;
        Some(self.steps.options(method, &self.keep))
    }

    pub(crate) fn size(&self) -> BumpSize {
        match self.size {
            Some(Length::Absolute(length)) => BumpSize::Length(length),
            Some(Length::Share(share)) => BumpSize::Share(share),
            None => BumpSize::DEFAULT,
        }
    }

    pub(crate) fn by_size(&self) -> BySizeOptions {
        BySizeOptions::default()
            .boundary(self.keep.boundary())
            .preserve(self.keep.preserve())
            .max_displacement(self.keep.max_displacement)
    }
}
