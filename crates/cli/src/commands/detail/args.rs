//! The options of `detail`.

use clap::{ArgGroup, Args};
use cotan::detail::{ApplyOptions, Wavelength};
use cotan::smooth::DetailOptions;

use crate::args::values::{self, Length};
use crate::args::{InputPath, MeshArgs, PartArgs};
use crate::commands::smooth::args::KeepArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan detail bust.ply -o caricature.ply --scale 2
  cotan detail base.obj -o mixed.obj --from rough.obj
  cotan detail cow.obj -o scaly.obj --from dinosaur.obj --map sphere --scale 0.5
  cotan detail ball.ply -o painted.ply --field mean_curvature

--field is a property of the vertices of a PLY file: the mean curvature that each is to have,
(k1 + k2) / 2, positive where convex, in one over the unit of the mesh.

--map takes details from a mesh with other faces, relative to the sizes of both, and adds them.
sphere maps both to a sphere (closed, genus 0); closest takes the closest points of two meshes that
lie on each other; a file has one line per vertex of MESH with a triangle of OTHER, counted from 0,
and the weights of its three corners, or `-` for none.";

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("edit").required(true).multiple(true).args(["scale", "from", "field"]))]
pub(crate) struct DetailArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// Make details F times as strong: 0 takes them away, 2 doubles them; with --from, those of
    /// the other mesh
    #[arg(long, value_name = "F", value_parser = values::tolerance, conflicts_with = "field")]
    pub(crate) scale: Option<f64>,
    /// Take the details of another mesh, with the same vertices and faces if there is no --map
    #[arg(long, value_name = "OTHER", conflicts_with = "field")]
    pub(crate) from: Option<InputPath>,
    /// Give every vertex the mean curvature that this property of the file says
    #[arg(long, value_name = "NAME")]
    pub(crate) field: Option<String>,
    /// Places of OTHER that correspond to those of the mesh
    #[arg(long, value_name = "sphere|closest|FILE", value_parser = MapBy::parse, requires = "from",
        conflicts_with_all = ["iterations", "anchor", "handles"])]
    pub(crate) map: Option<MapBy>,
    /// Waves of OTHER that are shorter are details: a length in its unit, or per cent of the
    /// square root of its area [default: 30%]
    #[arg(long, value_name = "L", value_parser = values::length_or_share, requires = "map")]
    wavelength: Option<Length>,
    /// Pairs of a vertex of the mesh and one of OTHER that belong together, `a b` per line or a
    /// JSON list of lists: two or more for a sphere, three or more to place OTHER for closest
    /// points
    #[arg(long, value_name = "FILE", requires = "map")]
    pub(crate) landmarks: Option<InputPath>,
    /// Refuse a map that stretches a twentieth of the area more often than this
    #[arg(long, value_name = "X", value_parser = values::positive, requires = "map",
        default_value = "20")]
    pub(crate) max_stretch: f64,
    /// Number of iterations
    #[arg(long, value_name = "N", default_value = "20")]
    iterations: usize,
    /// Weight that holds each vertex in place
    #[arg(long, value_name = "MU", value_parser = values::positive, default_value = "0.5")]
    anchor: f64,
    #[command(flatten)]
    pub(crate) part: PartArgs,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
}

/// The source of a correspondence.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum MapBy {
    /// Maps of both meshes to the sphere.
    Sphere,
    /// Closest points.
    Closest,
    /// A triangle and weights per vertex.
    File(InputPath),
}

impl MapBy {
    fn parse(text: &str) -> Result<Self, String> {
        Ok(match text {
            "sphere" => Self::Sphere,
            "closest" => Self::Closest,
            "" => return Err("give sphere, closest or a file".to_owned()),
            file => Self::File(InputPath::from(std::path::PathBuf::from(file))),
        })
    }

    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Sphere => "sphere",
            Self::Closest => "closest",
            Self::File(_) => "file",
        }
    }
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

    pub(crate) fn wavelength(&self) -> Wavelength {
        match self.wavelength {
            Some(Length::Absolute(length)) => Wavelength::Length(length),
            Some(Length::Share(share)) => Wavelength::Share(share),
            None => Wavelength::default(),
        }
    }

    pub(crate) fn apply_options(&self) -> ApplyOptions {
        ApplyOptions::default()
            .scale(self.scale.unwrap_or(1.0))
            .boundary(self.keep.boundary())
            .preserve(self.keep.preserve())
            .max_displacement(self.keep.max_displacement)
    }
}
