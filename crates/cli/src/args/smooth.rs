//! The options of `smooth` and `detail`.

use std::num::NonZeroUsize;

use clap::{ArgGroup, Args};
use cotan::smooth::{Boundary, DetailOptions, Preserve, SmoothMethod, SmoothOptions};
use cotan_io::Weld;

use super::options::{EmbedArgs, InputArgs};
use super::paths::{InputPath, OutputPath};
use super::values;

pub(super) const SMOOTH_EXAMPLE: &str = "\
Examples:
  cotan smooth scan.ply -o smooth.ply --preserve-volume --report smooth.json
  cotan smooth part.obj -o clean.obj --method feature --truth original.obj
  cotan smooth scan.ply -o stronger.ply --anchor 0.3 --max-displacement 0.01

auto chooses between curvature (organic shapes) and feature (parts with creases) and says why.
anchored and paper are the paper's section 4.2, with every vertex or only one held; feature-edges
filters dihedral angles; taubin and implicit are there to compare with.";

pub(super) const DETAIL_EXAMPLE: &str = "\
Examples:
  cotan detail bust.ply -o caricature.ply --scale 2
  cotan detail base.obj -o mixed.obj --from rough.obj
  cotan detail ball.ply -o painted.ply --field mean_curvature

--field is a property of the vertices of a PLY file: the mean curvature that each is to have,
(k1 + k2) / 2, positive where convex, in one over the unit of the mesh.";

/// The input mesh and the output.
#[derive(Debug, Args)]
pub(crate) struct MeshArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Repair the mesh first, as `cotan repair` without options does
    #[arg(long)]
    repair: bool,
    /// Treat vertices as one that are at the same place (exact) or this close
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    weld: Option<Weld>,
}

impl MeshArgs {
    /// The arguments as the input of an edit without handles.
    pub(crate) fn input(&self) -> InputArgs {
        InputArgs {
            mesh: self.mesh.clone(),
            handles: InputPath::default(),
            def: None,
            output: self.output.clone(),
            embed: self.embed,
            repair: self.repair,
            weld: self.weld,
        }
    }
}

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
    max_displacement: Option<f64>,
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
    fn preserve(&self) -> Preserve {
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
