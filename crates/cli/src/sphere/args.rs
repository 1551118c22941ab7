//! The options that `sphere`, `resample` and `morph` share.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use cotan::SchemeKind;
use cotan::sphere::{Centering, SphereMethod, SphereOptions};
use cotan_io::{Filling, Repair, Weld};

use super::Turn;
use crate::args::{InputPath, OutputPath, Precision, values};
use crate::prepare::Source;

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
    /// Treat vertices at the same place (exact), or within this distance, as one
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
    /// Maximum number of iterations of a round [default: 100; 300 for the paper's method]
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
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
}

/// The rotation of the sphere.
#[derive(Debug, Args)]
pub(crate) struct TurnArgs {
    /// principal: the longest axis of the mesh points to the poles, the second to longitude 0
    #[arg(long, value_name = "NAME", value_enum, default_value_t = Orient::None,
        help_heading = MAPPING)]
    orient: Orient,
    /// Three vertices, one per line or a JSON list: the first goes to the pole, the second to
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

impl MendingArgs {
    /// The mesh at `path` with these repairs.
    pub(crate) fn source(&self, path: &InputPath) -> Source {
        let filling = match self.fill_holes {
            Some(filling) => filling.unwrap_or(Filling::PLAIN),
            None => Filling::Off,
        };
        let repair = self.repair.then(Repair::default);
        Source::new(path, repair, self.weld).fill_holes(filling)
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
    use crate::command_line::{Arguments, Command};

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
