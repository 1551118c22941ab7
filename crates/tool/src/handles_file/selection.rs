//! The vertices that a handle of a JSON file holds: a list of indices, a box, or a sphere.

use std::fmt;

use cotan::geometry::Readable;
use nalgebra::Point3;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::error::{HandlesError, Place};
use super::json::Triple;
use super::vertices::Vertices;

/// The member `vertices` of a handle.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Selection {
    Numbers(Vec<usize>),
    Region(Region),
}

/// A region of space; exactly one of the two is given.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Region {
    #[serde(rename = "box")]
    cuboid: Option<Cuboid>,
    sphere: Option<Sphere>,
}

#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Cuboid {
    min: Triple,
    max: Triple,
}

#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Sphere {
    center: Triple,
    radius: f64,
}

impl Selection {
    /// Returns the vertices, as indices of the mesh file.
    ///
    /// # Errors
    /// [`HandlesError`] if there are none, or one is not in the mesh.
    pub(super) fn vertices(
        &self,
        mesh: &Vertices<'_>,
        place: Place,
    ) -> Result<Vec<usize>, HandlesError> {
        match self {
            Self::Numbers(numbers) => {
                for &vertex in numbers {
                    mesh.position(vertex, place)?;
                }
                match numbers.is_empty() {
                    true => Err(HandlesError::Empty {
                        place,
                        why: "its list is empty",
                    }),
                    false => Ok(numbers.clone()),
                }
            }
            Self::Region(region) => region.vertices(mesh, place),
        }
    }
}

impl Region {
    fn vertices(&self, mesh: &Vertices<'_>, place: Place) -> Result<Vec<usize>, HandlesError> {
        let within = |contains: &dyn Fn(Point3<f64>) -> bool| -> Vec<usize> {
            mesh.used()
                .filter(|(_, p)| contains(*p))
                .map(|(vertex, _)| vertex)
                .collect()
        };
        let (found, why) = match (&self.cuboid, &self.sphere) {
            (Some(Cuboid { min, max }), None) => {
                let (min, max) = (min.point(), max.point());
                if (0..3).any(|k| min[k] > max[k]) {
                    let problem = "has a box whose min is above its max; swap them".into();
                    return Err(HandlesError::Invalid { place, problem });
                }
                let found = within(&|p| (0..3).all(|k| min[k] <= p[k] && p[k] <= max[k]));
                (
                    found,
                    "no vertex of the mesh lies in its box (`cotan info` prints the bounds)",
                )
            }
            (None, Some(Sphere { center, radius })) => {
                if *radius < 0.0 {
                    let radius = Readable(*radius);
                    let problem = format!("has a sphere of radius {radius}; give at least 0");
                    return Err(HandlesError::Invalid { place, problem });
                }
                let found = within(&|p| (p - center.point()).norm() <= *radius);
                (
                    found,
                    "no vertex of the mesh lies in its sphere (`cotan info` prints the bounds)",
                )
            }
            _ => {
                let problem =
                    "must select its vertices in exactly one way: by indices, a box, or a sphere"
                        .into();
                return Err(HandlesError::Invalid { place, problem });
            }
        };
        match found.is_empty() {
            true => Err(HandlesError::Empty { place, why }),
            false => Ok(found),
        }
    }
}

impl<'de> Deserialize<'de> for Selection {
    // Implemented manually, because derived errors for alternatives do not name the invalid key.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;

        impl<'de> Visitor<'de> for Either {
            type Value = Selection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of vertex indices, or an object with \"box\" or \"sphere\"")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Selection, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Selection::Numbers)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Selection, A::Error> {
                Region::deserialize(MapAccessDeserializer::new(map)).map(Selection::Region)
            }
        }

        deserializer.deserialize_any(Either)
    }
}
