//! The options of `deform`, and those that it shares with `reconstruct`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use cotan::flow::{Acceleration, Schedule, Start, Stiffness};
use cotan::linear::Strategy;
use cotan::{DeformOptions, DetailSize, OrientationKind, SchemeKind};
use cotan_io::{Repair, Weld};

use crate::args::{EmbedArgs, InputPath, OutputPath, PartsArgs, Precision, RegionArgs, values};
use crate::prepare::{Instances, Source, Surfaces};

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan deform bar.obj --handles bar.json -o bent.obj --report bent.json --picture bent.png

See --help for the handles file.";

pub(crate) const HELP: &str = r#"Handles file:
  Vertices have the numbers of the mesh file, counted from 0, also with --repair. JSON:

    {"handles": [
      {"vertices": [0, 1, 2], "fixed": true},
      {"vertices": {"box": {"min": [9, -1, -1], "max": [11, 1, 1]}},
       "transform": {"scale": 1.2, "rotate": {"axis": [0, 1, 0], "degrees": 45},
                     "translate": [0, 0, 2]}},
      {"vertices": {"sphere": {"center": [5, 0, 1], "radius": 0.3}},
       "transform": {"matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 2]]}, "weight": 10},
      {"vertices": [77], "to": [[5.0, 0.5, 1.5]]}
    ]}

  A transform scales first (about the centroid of the handle's vertices), then rotates (about the
  point "about", by default the same centroid; counter-clockwise seen from the tip of the axis),
  then translates. "matrix" has 3 or 4 rows of 4 numbers, acts on columns (x, y, z, 1), and stands
  alone, except for "turn": [x, y, z], its rotation (an axis times degrees) if that is more than
  180. "weight" makes a handle soft, whatever --soft says.

  Plain text has one `vertex x y z` per line, the position where the vertex goes, with # comments.

  NAME.sel has one line per vertex of the mesh: 0 fixed, 1 free, 2 moved by the 4x4 matrix in
  NAME.def next to it (or in the file that --def names).

  "vertices" may also be what has a name in the file, a part of the model (by name or number, as
  `cotan info` lists them), or all but another selection:

    {"object": "head"}, {"group": "arm"}, {"material": "skin"}, {"node": "hat"},
    {"part": 3}, {"all_but": {"part": 0}}

Parts of the model without a handle follow those that they touch or are nearest to, unless --parts,
--free or --untie say otherwise, or the handles file does:

    {"handles": [...], "parts": {"follow": "all" | "none" | ["eye", 3], "free": ["hat"],
     "untied": [["upper jaw", "lower jaw"]], "strength": 1}}

Examples:
  cotan deform bar.obj --handles bar.json -o bent.obj --report bent.json --picture bent.png
  cotan deform scan.ply --handles pins.txt -o moved.ply --soft 100
  cotan deform bar.off --handles bar.sel --def bar2.def -o stretched.off
  cotan deform ogre.obj --repair --handles ear.json -o ogre2.obj
  cotan deform bar.off --handles bar.sel -o paper.off --orientation reflect --start original \
      --accelerate off --schedule paper                  (the paper's own settings)"#;

/// The input mesh, its handles, and the output.
#[derive(Debug, Args)]
pub(crate) struct InputArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Handles: JSON, text with `vertex x y z` per line, or a .sel file
    #[arg(long, value_name = "FILE")]
    pub(crate) handles: InputPath,
    /// The 4x4 matrix of a .sel file; by default the .def file of the same name
    #[arg(long, value_name = "FILE")]
    pub(crate) def: Option<InputPath>,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Repair the mesh first, as `cotan repair` without options does; handles use the vertex
    /// indices of the original file. With --weld, vertices that the repair splits stay split, and
    /// OUT keeps every vertex
    #[arg(long)]
    pub(crate) repair: bool,
    /// Treat vertices at the same place (exact), or within this distance, as one
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld)]
    pub(crate) weld: Option<Weld>,
    /// Give every node of a glTF that shows a mesh a copy of it, so that it can be edited alone;
    /// otherwise an edit shows wherever the mesh does. Copies have the numbers after all others
    #[arg(long)]
    pub(crate) make_unique: bool,
}

impl InputArgs {
    /// The source of the mesh.
    pub(crate) fn source(&self) -> Source {
        Source::new(&self.mesh, self.repair.then(Repair::default), self.weld)
            .surfaces(Surfaces::Any)
            .instances(match self.make_unique {
                true => Instances::Unique,
                false => Instances::Shared,
            })
    }
}

/// The options of the method that `deform` and `reconstruct` share.
#[derive(Debug, Args)]
pub(crate) struct MethodArgs {
    /// Weights of the Laplacian
    #[arg(long, value_name = "NAME", value_parser = values::scheme(), default_value = "cotangent")]
    scheme: SchemeKind,
    /// Let details grow and shrink with the area around them
    #[arg(long)]
    rescale: bool,
    /// Orientation of the Laplacian coordinates; reflect is the paper's
    #[arg(long, value_name = "NAME", value_parser = values::orientation(),
        default_value = "hybrid")]
    orientation: OrientationKind,
    /// Accelerate from the last M steps, or off
    #[arg(long, value_name = "M|off", value_parser = values::acceleration, default_value = "5")]
    accelerate: Acceleration,
    /// Steps at full length, or the paper's falling ratio
    #[arg(long, value_name = "NAME", value_parser = values::schedule(), default_value = "full")]
    schedule: Schedule,
    /// Details smaller than this are preserved by the flow, larger shapes by the hybrid's
    /// membrane; relative to the size of the mesh [default: 0.0175]
    #[arg(long, value_name = "X", value_parser = values::positive)]
    bending_length: Option<f64>,
    /// Resistance of a body: like a solid, or like an empty shell
    #[arg(long, value_name = "NAME", value_enum, default_value_t = StiffnessName::Solid)]
    stiffness: StiffnessName,
    /// Weight of the struts that keep opposite walls at their distance, relative to the hybrid's
    /// membrane; 0 for no struts [default: 0.3, or 0 for thin]
    #[arg(long, value_name = "BETA", value_parser = values::weight)]
    strut_weight: Option<f64>,
    /// Weight of the volume of closed bodies, relative to the hybrid's membrane; 0 for no weight
    /// [default: 1, or 0 for thin]
    #[arg(long, value_name = "GAMMA", value_parser = values::weight)]
    volume_weight: Option<f64>,
    /// Radius of the disc at which a handle of a single vertex pulls, in bending lengths; 0 pulls
    /// the vertex alone and leaves a cone [default: 6, or 0 for thin]
    #[arg(long, value_name = "X", value_parser = values::weight)]
    point_radius: Option<f64>,
    /// Hold stated turns of more than 180° that the body does not hold by itself, by a weight
    /// relative to the energy [0.3 where none is given]
    #[arg(long, value_name = "TAU", value_parser = values::weight, num_args = 0..=1,
        default_missing_value = "0.3")]
    hold_winding: Option<f64>,
    /// Solver of the linear system: the normal equations, or columns of the inverse, one per
    /// handle vertex; the report names the choice of auto
    #[arg(long, value_name = "NAME", value_parser = values::strategy(), default_value = "auto")]
    strategy: Strategy,
}

/// The names of the stiffnesses.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum StiffnessName {
    Solid,
    Thin,
}

/// The options of a run and its reports.
#[derive(Debug, Args)]
pub(crate) struct RunArgs {
    /// The number type of the iteration
    #[arg(long, value_name = "TYPE", value_enum, default_value_t = Precision::F64)]
    pub(crate) precision: Precision,
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
    /// Put the errors after every iteration into the report
    #[arg(long, requires = "report")]
    pub(crate) history: bool,
    /// Draw the mesh before and after (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
}

#[derive(Debug, Args)]
pub(crate) struct DeformArgs {
    #[command(flatten)]
    pub(crate) input: InputArgs,
    #[command(flatten)]
    pub(crate) parts: PartsArgs,
    #[command(flatten)]
    method: MethodArgs,
    /// The Laplacian coordinates of the first solve: turned with the handles, original, or zero
    #[arg(long, value_name = "NAME", value_parser = values::start(), default_value = "rotations")]
    start: Start,
    /// Maximum number of iterations
    #[arg(long, value_name = "N", default_value = "200")]
    iterations: NonZeroUsize,
    /// Stop when no vertex moves by more than this ratio of the bounding box's diagonal
    #[arg(long, value_name = "X", value_parser = values::tolerance, default_value = "1e-4")]
    tolerance: f64,
    /// Meet the handles exactly (the default)
    #[arg(long, conflicts_with = "soft")]
    hard: bool,
    /// Hold the handles by springs of this weight, where they have no weight of their own
    #[arg(long, value_name = "K", value_parser = values::positive)]
    pub(crate) soft: Option<f64>,
    #[command(flatten)]
    pub(crate) region: RegionArgs,
    #[command(flatten)]
    pub(crate) run: RunArgs,
}

impl MethodArgs {
    fn stiffness(&self) -> Stiffness {
        let mut stiffness = match self.stiffness {
            StiffnessName::Solid => Stiffness::SOLID,
            StiffnessName::Thin => Stiffness::THIN,
        };
        stiffness.struts = self.strut_weight.unwrap_or(stiffness.struts);
        stiffness.point_radius = self.point_radius.unwrap_or(stiffness.point_radius);
        stiffness.volume = self.volume_weight.unwrap_or(stiffness.volume);
        stiffness
    }

    /// The library's options; those not named here keep their defaults.
    pub(crate) fn options(&self) -> DeformOptions {
        let default = DeformOptions::default();
        default
            .clone()
            .system(default.system.strategy(self.strategy))
            .scheme(self.scheme)
            .orientation(self.orientation)
            .bending_length(self.bending_length.unwrap_or(default.bending_length))
            .stiffness(self.stiffness())
            .hold_winding(self.hold_winding.unwrap_or(default.hold_winding))
            .detail_size(if self.rescale {
                DetailSize::Rescale
            } else {
                DetailSize::Keep
            })
            .acceleration(self.accelerate)
            .schedule(self.schedule)
    }
}

impl DeformArgs {
    pub(crate) fn options(&self) -> DeformOptions {
        self.method
            .options()
            .start(self.start)
            .tolerance(self.tolerance)
            .iteration_limit(self.iterations.get())
    }
}

#[cfg(test)]
mod tests {
    use clap::{CommandFactory, Parser};

    use super::*;
    use crate::command_line::{Arguments, Command};

    #[test]
    fn the_defaults_are_the_librarys() {
        let words = [
            "cotan",
            "deform",
            "a.obj",
            "--handles",
            "h.json",
            "-o",
            "b.obj",
        ];
        let arguments = Arguments::try_parse_from(words).unwrap();
        let Command::Deform(args) = arguments.command else {
            panic!("another command")
        };
        assert_eq!(args.options(), DeformOptions::default());
    }

    #[test]
    fn the_help_names_the_default_bending_length() {
        let mut command = Arguments::command();
        let deform = command.find_subcommand_mut("deform").unwrap();
        let default = DeformOptions::default().bending_length;
        assert!(
            deform
                .render_help()
                .to_string()
                .contains(&format!("[default: {default}]"))
        );
    }
}
