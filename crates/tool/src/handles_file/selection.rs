//! The vertices that a handle of a JSON file holds: a list of indices, a box, a sphere, what has a
//! name in the file, a part, or all but such a selection.

use std::collections::HashSet;
use std::fmt;

use cotan::geometry::Readable;
use cotan_io::LabelKind;
use nalgebra::Point3;
use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::error::{HandlePlace, HandlesError};
use super::json::Triple;
use super::part_settings::PartWord;
use super::vertices::Vertices;

/// The member `vertices` of a handle.
#[derive(Clone, PartialEq, Debug)]
pub(super) enum Selection {
    Numbers(Vec<usize>),
    Region(Box<Region>),
}

/// A region of space or of the model; exactly one of these is given.
#[derive(Clone, PartialEq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Region {
    #[serde(rename = "box")]
    cuboid: Option<Cuboid>,
    sphere: Option<Sphere>,
    object: Option<String>,
    group: Option<String>,
    material: Option<String>,
    node: Option<String>,
    part: Option<PartWord>,
    all_but: Option<Selection>,
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
        place: HandlePlace,
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
    fn vertices(
        &self,
        mesh: &Vertices<'_>,
        place: HandlePlace,
    ) -> Result<Vec<usize>, HandlesError> {
        let within = |contains: &dyn Fn(Point3<f64>) -> bool| -> Vec<usize> {
            mesh.used()
                .filter(|(_, p)| contains(*p))
                .map(|(vertex, _)| vertex)
                .collect()
        };
        let labels = [
            (LabelKind::Object, "object", &self.object),
            (LabelKind::Group, "group", &self.group),
            (LabelKind::Material, "material", &self.material),
        ];
        let named = labels.iter().filter(|(.., name)| name.is_some()).count();
        let others = [
            self.node.is_some(),
            self.part.is_some(),
            self.all_but.is_some(),
        ];
        let num_others = named + others.iter().filter(|is_given| **is_given).count();
        let (found, why) = match (&self.cuboid, &self.sphere) {
            (None, None) if num_others == 1 => {
                let named = labels.into_iter().find_map(|(kind, word, name)| {
                    let name = name.as_ref()?;
                    Some(mesh.labelled(kind, word, name, place))
                });
                let found = match (named, &self.node, &self.part, &self.all_but) {
                    (Some(found), ..) => found?,
                    (_, Some(node), ..) => mesh.of_node(node, place)?,
                    (_, _, Some(part), _) => mesh.of_part(part, place)?,
                    (.., Some(others)) => {
                        let others = others.vertices(mesh, place)?;
                        let others: HashSet<usize> = others.into_iter().collect();
                        let all = mesh.used().map(|(vertex, _)| vertex);
                        all.filter(|vertex| !others.contains(vertex)).collect()
                    }
                    _ => Vec::new(),
                };
                (found, "nothing is left of the mesh")
            }
            (Some(Cuboid { min, max }), None) if num_others == 0 => {
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
            (None, Some(Sphere { center, radius })) if num_others == 0 => {
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
                    "must select its vertices in exactly one way: by indices, or by one of \
                               \"box\", \"sphere\", \"object\", \"group\", \"material\", \"node\", \
                               \"part\" and \"all_but\""
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
                f.write_str(
                    "a list of vertex indices, or an object with one of \"box\", \"sphere\", \
                     \"object\", \"group\", \"material\", \"node\", \"part\" and \"all_but\"",
                )
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Selection, A::Error> {
                Vec::deserialize(SeqAccessDeserializer::new(seq)).map(Selection::Numbers)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Selection, A::Error> {
                Region::deserialize(MapAccessDeserializer::new(map))
                    .map(|region| Selection::Region(Box::new(region)))
            }
        }

        deserializer.deserialize_any(Either)
    }
}
