//! The options of `sphere`, `resample` and `morph`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use cotan::SchemeKind;
use cotan::sphere::{Centering, SphereMethod, SphereOptions};
use cotan_io::{Filling, Repair, Weld};

use super::options::EmbedArgs;
use super::paths::{InputPath, OutputPath};
use super::values::{self, Precision};
use crate::error::Cure;
use crate::prepare::{Source, Surfaces};
use crate::sphere::Turn;

pub(super) const SPHERE_EXAMPLE: &str = "\
Examples:
  cotan sphere cotan-demo/before.obj -o sphere.obj --picture sphere.png --report sphere.json
  cotan sphere brain.ply -o sphere.ply --authalic 1       (areas are kept, not angles)
  cotan sphere scan.ply -o sphere.ply --fill-holes --precision f32

The mesh must be closed, in one piece, and without a tunnel through it. OUT is the file of the mesh
with every vertex on the unit sphere; no triangle is flipped there, which exact arithmetic has
checked, or the command ends with an error (formats of 32-bit numbers are read back, and what their
rounding flips is told in a warning).";

pub(super) const RESAMPLE_EXAMPLE: &str = "\
Example:
  cotan resample cotan-demo/before.obj --level 6 --authalic 1 -o even.obj

The shape on the triangles of an icosphere, placed by way of the sphere map. A conformal map leaves
few of them for limbs; --authalic 1 gives every part its share.";

pub(super) const MORPH_EXAMPLE: &str = "\
Example:
  cotan morph cow.obj horse.obj -t 0.5 -o between.obj
  cotan morph cow.obj horse.obj -t 0.5 --level 6 --authalic 1 -o even.obj

Each vertex goes the straight way to the place of B that has its place on the sphere, B's sphere
turned to fit A's, which is all that is done to make limbs meet limbs. OUT has the same triangles
for every -t, so that files of several times make an animation.";

const MAPPING: &str = "Mapping";
const MENDING: &str = "Mending";

/// The input mesh, and its repair before the mapping.
#[derive(Debug, Args)]
pub(crate) struct ClosedMeshArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
}

/// The repair of a mesh before the mapping.
#[derive(Debug, Args)]
pub(crate) struct MendingArgs {
    /// Repair the mesh first, as `cotan repair` without options does
    #[arg(long, help_heading = MENDING)]
    repair: bool,
    /// Fill holes of at most N edges (=N), or all, first; `smooth` or `smooth:N` adds vertices
    /// that make the patch continue the surface
    #[arg(long, value_name = "[smooth][:N]", num_args = 0..=1, require_equals = true,
        value_parser = values::filling, help_heading = MENDING)]
    fill_holes: Option<Option<Filling>>,
    /// Treat vertices as one that are at the same place (exact) or this close
    /// [default: exact for .stl, .gltf and .glb, otherwise off]
    #[arg(long, value_name = "off|exact|X", value_parser = values::weld, help_heading = MENDING)]
    weld: Option<Weld>,
}

/// The options of the mapping.
#[derive(Debug, Args)]
pub(crate) struct MapArgs {
    /// Weights of the Laplacian
    #[arg(long, value_name = "NAME", value_parser = values::scheme(), default_value = "cotangent",
        help_heading = MAPPING)]
    scheme: SchemeKind,
    /// robust never flips a triangle; the paper's and conformalized mean-curvature flow (cmcf) are
    /// for comparison
    #[arg(long, value_name = "NAME", value_parser = values::sphere_method(),
        default_value = "robust", help_heading = MAPPING)]
    method: SphereMethod,
    /// Keep angles, whatever that does to areas (the default): --authalic 0
    #[arg(long, conflicts_with = "authalic", help_heading = MAPPING)]
    conformal: bool,
    /// From 0, keep angles, to 1, keep areas
    #[arg(long, value_name = "SHARE", value_parser = values::share, default_value = "0",
        help_heading = MAPPING)]
    authalic: f64,
    /// Put the centre of the mesh's areas at the centre of the sphere, by a Moebius map
    /// [default: on; off for the paper's method]
    #[arg(long, value_name = "on|off", value_parser = values::centering(), help_heading = MAPPING)]
    center: Option<Centering>,
    /// The most iterations of a round [default: 100; 300 for the paper's method]
    #[arg(long, value_name = "N", help_heading = MAPPING)]
    iterations: Option<NonZeroUsize>,
    /// Stop when no vertex moves by more than this on the unit sphere
    #[arg(long, value_name = "X", value_parser = values::tolerance, default_value = "1e-4",
        help_heading = MAPPING)]
    tolerance: f64,
}

/// The options of a mapping run and its report.
#[derive(Debug, Args)]
pub(crate) struct MapRunArgs {
    /// The number type of the positions on the sphere
    #[arg(long, value_name = "TYPE", value_enum, default_value_t = Precision::F64)]
    pub(crate) precision: Precision,
    /// Number of threads; it changes no byte of the result [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
}

#[derive(Debug, Args)]
pub(crate) struct SphereArgs {
    #[command(flatten)]
    pub(crate) input: ClosedMeshArgs,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    #[command(flatten)]
    pub(crate) run: MapRunArgs,
    #[command(flatten)]
    pub(crate) turn: TurnArgs,
    /// Draw the mesh and the sphere, coloured by what the map does to areas (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
    /// Give OUT texture coordinates: longitude and latitude, with a cut at 180 degrees. The file
    /// is then written anew from what more than one format can hold
    #[arg(long)]
    pub(crate) uv: bool,
    /// Write the positions of the mesh as the colours of a square (PNG, 16 bits), the sphere
    /// unfolded as an octahedron; the report says what the colours stand for
    #[arg(long, value_name = "P.png")]
    pub(crate) geometry_image: Option<OutputPath>,
    /// Pixels of a side of the geometry image; odd
    #[arg(long, value_name = "N", default_value = "257", value_parser = values::odd_size)]
    pub(crate) size: usize,
}

/// The rotation of the sphere.
#[derive(Debug, Args)]
pub(crate) struct TurnArgs {
    /// principal: the longest axis of the mesh points to the poles, the second to longitude 0
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Orient::None,
        help_heading = MAPPING)]
    orient: Orient,
    /// Three vertices, one a line or a JSON list: the first goes to the pole, the second to
    /// longitude 0 (the third, if that is at a pole)
    #[arg(long, value_name = "FILE", conflicts_with = "orient", help_heading = MAPPING)]
    landmarks: Option<InputPath>,
}

/// The rotation of the sphere if there are no landmarks.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Orient {
    None,
    Principal,
}

impl TurnArgs {
    /// The rotation of the sphere.
    pub(crate) fn turn(&self) -> Turn<'_> {
        match (&self.landmarks, self.orient) {
            (Some(path), _) => Turn::Landmarks(path),
            (None, Orient::Principal) => Turn::Principal,
            (None, Orient::None) => Turn::None,
        }
    }
}

#[derive(Debug, Args)]
pub(crate) struct ResampleArgs {
    #[command(flatten)]
    pub(crate) input: ClosedMeshArgs,
    /// Subdivisions of the icosphere, at most 8: 10 * 4^N + 2 vertices
    #[arg(long, value_name = "N", value_parser = values::level())]
    pub(crate) level: u32,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    #[command(flatten)]
    pub(crate) turn: TurnArgs,
    #[command(flatten)]
    pub(crate) run: MapRunArgs,
}

#[derive(Debug, Args)]
pub(crate) struct MorphArgs {
    /// Mesh file of the shape at time 0
    #[arg(value_name = "A")]
    pub(crate) start: InputPath,
    /// Mesh file of the shape at time 1
    #[arg(value_name = "B")]
    pub(crate) end: InputPath,
    /// Time between A and B: 0 is A, 1 is B
    #[arg(short, long, value_name = "T", value_parser = values::share)]
    pub(crate) time: f64,
    /// Resample both to an icosphere of N subdivisions, at most 8; without it OUT is A's file with
    /// other positions
    #[arg(long, value_name = "N", value_parser = values::level())]
    pub(crate) level: Option<u32>,
    /// Mesh file to write; its extension names the format
    #[arg(short, long, value_name = "OUT")]
    pub(crate) output: OutputPath,
    #[command(flatten)]
    pub(crate) embed: EmbedArgs,
    /// Alignment of B's sphere with A's
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Align::Pose)]
    pub(crate) align: Align,
    /// Pairs of a vertex of A and one of B that belong together, `a b` a line or a JSON list of
    /// lists; two or more
    #[arg(long, value_name = "FILE", conflicts_with = "align")]
    pub(crate) landmarks: Option<InputPath>,
    #[command(flatten)]
    pub(crate) mending: MendingArgs,
    #[command(flatten)]
    pub(crate) map: MapArgs,
    /// Number of threads; it changes no byte of the result [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
}

/// The alignment of one sphere with another.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum Align {
    /// Places that are near each other in space, for shapes in like poses
    Pose,
    /// Places where both maps shrink areas alike, whatever the poses
    Areas,
    /// Not at all
    None,
}

impl MendingArgs {
    /// The mesh at `path` with these repairs.
    pub(crate) fn source<'a>(&self, path: &'a InputPath) -> Source<'a> {
        let mut repair = self.repair.then(Repair::default);
        let filling = match self.fill_holes {
            Some(filling) => filling.unwrap_or(Filling::PLAIN),
            None => Filling::Off,
        };
        if filling != Filling::Off {
            let before = repair.unwrap_or_else(Repair::new);
            repair = Some(before.fill_holes(filling));
        }
        Source {
            path,
            repair,
            filling,
            weld: self.weld.unwrap_or_default(),
            cure: match self.repair {
                true => Cure::Beyond,
                false => Cure::Offered,
            },
            surfaces: Surfaces::Manifold,
        }
    }
}

impl MapArgs {
    /// The library's options; those not given keep the defaults of the method.
    pub(crate) fn options(&self) -> SphereOptions {
        let default = match self.method {
            SphereMethod::Paper => SphereOptions::paper(self.scheme),
            _ => SphereOptions::default(),
        };
        default
            .clone()
            .scheme(self.scheme)
            .method(self.method)
            .authalic(match self.conformal {
                true => 0.0,
                false => self.authalic,
            })
            .centering(self.center.unwrap_or(default.centering))
            .tolerance(self.tolerance)
            .iteration_limit(
                self.iterations
                    .map_or(default.iteration_limit, NonZeroUsize::get),
            )
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;
    use crate::args::{Arguments, Command};

    fn options(words: &[&str]) -> SphereOptions {
        let words = ["cotan", "sphere", "a.obj", "-o", "b.obj"]
            .iter()
            .chain(words);
        let arguments = Arguments::try_parse_from(words).unwrap();
        let Command::Sphere(args) = arguments.command else {
            panic!("another command")
        };
        args.map.options()
    }

    #[test]
    fn the_defaults_are_the_librarys() {
        assert_eq!(options(&[]), SphereOptions::default());
        assert_eq!(options(&["--conformal"]), SphereOptions::default());
        let paper = SphereOptions::paper(SchemeKind::Tutte);
        assert_eq!(options(&["--method", "paper", "--scheme", "tutte"]), paper);
    }

    #[test]
    fn the_help_names_the_defaults_of_the_methods() {
        let [robust, paper] = [
            SphereOptions::default(),
            SphereOptions::paper(SchemeKind::Cotangent),
        ];
        assert_eq!((robust.iteration_limit, paper.iteration_limit), (100, 300));
        assert_eq!(robust.centering.name(), "on");
        assert_eq!(paper.centering.name(), "off");
    }
}
