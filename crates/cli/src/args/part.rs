//! The options that restrict an edit to a part of a mesh.

use std::str::FromStr;

use clap::Args;
use nalgebra::{Point3, Vector3};

use super::paths::InputPath;
use super::values::{self, Length};

/// The part that may move, and the vertices that are held.
#[derive(Debug, Args)]
pub(crate) struct PartArgs {
    /// Move a part only: box:X,Y,Z,X,Y,Z  sphere:X,Y,Z,R  near:VERTEX,R (along the surface)
    /// plane:X,Y,Z,NX,NY,NZ (the side of the normal) or property:NAME (numbers of a PLY file from
    /// 0 to 1, the share of the motion)
    #[arg(long, value_name = "SEL", value_parser = Selection::from_str)]
    pub(crate) mask: Option<Selection>,
    /// Move a part only: the vertices that a handles file names
    #[arg(long, value_name = "FILE", conflicts_with = "mask")]
    pub(crate) mask_file: Option<InputPath>,
    /// Width of the border of the part, inside of it, over which the motion fades: a length, or
    /// a share of the longest side in per cent [default: 5%]
    #[arg(long, value_name = "R", value_parser = values::length_or_share)]
    pub(crate) falloff: Option<Length>,
    /// Vertices to hold or to move: a handles file as for `cotan deform`
    #[arg(long, value_name = "FILE")]
    pub(crate) handles: Option<InputPath>,
}

/// The region of an edit, and its border.
#[derive(Debug, Args)]
pub(crate) struct RegionArgs {
    /// Edit a region only; no other vertex moves: box:X,Y,Z,X,Y,Z  sphere:X,Y,Z,R
    /// near:VERTEX,R (along the surface)  plane:X,Y,Z,NX,NY,NZ (the side of the normal)
    /// or property:NAME (numbers of a PLY file, above 0)
    #[arg(long, value_name = "SEL", value_parser = Selection::from_str)]
    pub(crate) region: Option<Selection>,
    /// Edit a region only: the vertices that a handles file names
    #[arg(long, value_name = "FILE", conflicts_with = "region")]
    pub(crate) region_file: Option<InputPath>,
    /// Width of the border of the region, inside of it, over which the motion fades, that of
    /// handles too: a length, or a share of the longest side in per cent [default: 0]
    #[arg(long, value_name = "R", value_parser = values::length_or_share)]
    pub(crate) falloff: Option<Length>,
}

/// A part of a mesh, as stated on the command line.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Selection {
    /// Between two corners.
    Box([Point3<f64>; 2]),
    /// Within a distance of a point.
    Sphere(Point3<f64>, f64),
    /// Within a distance of a vertex of the file, along the surface.
    Near(usize, f64),
    /// On the side of a plane to which its normal points: a point of the plane, and the normal.
    HalfSpace(Point3<f64>, Vector3<f64>),
    /// Weights in a property of the file.
    Property(String),
}

impl FromStr for Selection {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (kind, rest) = text.split_once(':').ok_or(FORMS)?;
        let numbers: Option<Vec<f64>> = rest
            .split(',')
            .map(|x| x.trim().parse().ok().filter(|x: &f64| x.is_finite()))
            .collect();
        match (kind, numbers.as_deref()) {
            ("property", _) if !rest.is_empty() => Ok(Self::Property(rest.to_owned())),
            ("box", Some(&[a, b, c, d, e, f])) => {
                let (p, q) = (Point3::new(a, b, c), Point3::new(d, e, f));
                Ok(Self::Box([p.inf(&q), p.sup(&q)]))
            }
            ("sphere", Some(&[x, y, z, r])) if r > 0.0 => Ok(Self::Sphere(Point3::new(x, y, z), r)),
            ("plane", Some(&[x, y, z, a, b, c])) if (a, b, c) != (0.0, 0.0, 0.0) => {
                Ok(Self::HalfSpace(Point3::new(x, y, z), Vector3::new(a, b, c)))
            }
            ("near", Some(&[_, r])) if r > 0.0 => {
                let vertex = rest.split(',').next().and_then(|v| v.trim().parse().ok());
                Ok(Self::Near(vertex.ok_or(FORMS)?, r))
            }
            _ => Err(FORMS.to_owned()),
        }
    }
}

const FORMS: &str = "give box:X,Y,Z,X,Y,Z, sphere:X,Y,Z,R, near:VERTEX,R, \
    plane:X,Y,Z,NX,NY,NZ or property:NAME, with a radius above 0 and a normal that is not 0";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn selections_are_read_and_others_refused() {
        let parse = |text: &str| text.parse::<Selection>();
        let corners = [Point3::new(-1.0, 0.0, 0.0), Point3::new(1.0, 2.0, 3.0)];
        assert_eq!(parse("box:1,0,3,-1,2,0"), Ok(Selection::Box(corners)));
        assert_eq!(
            parse("sphere:0, 0,1,0.5"),
            Ok(Selection::Sphere(Point3::new(0.0, 0.0, 1.0), 0.5))
        );
        assert_eq!(parse("near:17,0.5"), Ok(Selection::Near(17, 0.5)));
        let side = Selection::HalfSpace(Point3::new(0.0, 1.0, 0.0), -Vector3::y());
        assert_eq!(parse("plane:0,1,0,0,-1,0"), Ok(side));
        let property = Selection::Property("weight".to_owned());
        assert_eq!(parse("property:weight"), Ok(property));
        for text in [
            "box:1,2",
            "sphere:0,0,0,-1",
            "near:1.5,2",
            "plane:0,0,0,0,0,0",
            "ball:1",
            "nan",
            "sphere:0,0,0,nan",
        ] {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
