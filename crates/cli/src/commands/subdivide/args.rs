//! The options of `subdivide`.

use clap::{Args, ValueEnum};
use cotan::surface::{SubdivideOptions, SubdivisionScheme};

use crate::args::{MeshArgs, values};
use crate::tessellation::Base;
use crate::tessellation::args::OutcomeArgs;

pub(crate) const EXAMPLE: &str = "\
Examples:
  cotan subdivide bar.obj -o fine.obj --levels 2
  cotan subdivide cage.obj -o smooth.obj --scheme catmull-clark --crease-angle 80

Loop cuts triangles, Catmull and Clark polygons, whose new faces are quadrilaterals; midpoint keeps
the shape. Boundaries stay sharp. Texture coordinates and colours are interpolated.";

#[derive(Debug, Args)]
pub(crate) struct SubdivideArgs {
    #[command(flatten)]
    pub(crate) mesh: MeshArgs,
    /// Subdivision scheme
    #[arg(long, value_name = "NAME", value_enum, default_value = "loop")]
    scheme: Scheme,
    /// Number of times that every face is cut
    #[arg(long, value_name = "N", default_value = "1")]
    levels: usize,
    /// Keep edges sharp whose faces differ by this angle, in degrees [default: only the boundary]
    #[arg(long, value_name = "DEGREES", value_parser = values::positive)]
    crease_angle: Option<f64>,
    #[command(flatten)]
    pub(crate) outcome: OutcomeArgs,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Scheme {
    Loop,
    CatmullClark,
    Midpoint,
}

impl SubdivideArgs {
    pub(crate) fn scheme(&self) -> SubdivisionScheme {
        match self.scheme {
            Scheme::Loop => SubdivisionScheme::Loop,
            Scheme::CatmullClark => SubdivisionScheme::CatmullClark,
            Scheme::Midpoint => SubdivisionScheme::Midpoint,
        }
    }

    pub(crate) fn options(&self, base: &Base) -> SubdivideOptions {
        let options = SubdivideOptions::new(self.scheme()).levels(self.levels);
        match self.crease_angle {
            Some(angle) => options.creases(base.creases(angle.to_radians())),
            None => options,
        }
    }
}
