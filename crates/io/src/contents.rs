//! The contents of a new file: a document written in a format that it was not read from.

use std::borrow::Cow;
use std::collections::HashSet;

use nalgebra::Point3;

use crate::attributes::{Attributes, CornerProperty, LabelKind, Property, Values};
use crate::faces::FaceList;
use crate::instances::Expanded;
use crate::material::Materials;
use crate::recut::{Polygons, Recuts};
use crate::weld;

/// The contents of a new file.
///
/// Vertices are welded. Where the old format splits a vertex at a seam, the properties that
/// differ there have become corner properties.
pub(crate) struct Contents<'a> {
    pub(crate) positions: Cow<'a, [Point3<f64>]>,
    pub(crate) faces: Cow<'a, FaceList>,
    pub(crate) attributes: Cow<'a, Attributes>,
    /// The materials that the new file itself describes.
    pub(crate) materials: Materials,
}

impl<'a> Contents<'a> {
    /// Welds a mesh with all its instances.
    pub(crate) fn new(mesh: Expanded<'a>, materials: Materials) -> Self {
        let Expanded {
            positions,
            faces,
            attributes,
            places,
        } = mesh;
        if places
            .iter()
            .enumerate()
            .all(|(v, &place)| v == place as usize)
        {
            return Self {
                positions,
                faces,
                attributes,
                materials,
            };
        }
        // The representatives of the places keep their relative order.
        let kept: Vec<usize> = (0..positions.len())
            .filter(|&v| places[v] as usize == v)
            .collect();
        let mut number = vec![0u32; positions.len()];
        (0u32..).zip(&kept).for_each(|(n, &v)| number[v] = n);
        let polygons = faces
            .iter()
            .map(|polygon| -> Vec<u32> {
                let place = |&v: &u32| number[places[v as usize] as usize];
                polygon.iter().map(place).collect()
            })
            .collect();
        Self {
            positions: kept.iter().map(|&v| positions[v]).collect(),
            attributes: Cow::Owned(welded(attributes.into_owned(), &faces, &kept, &places)),
            faces: Cow::Owned(polygons),
            materials,
        }
    }

    /// Lists what a format without names of faces and without materials drops.
    pub(crate) fn lost_names(&self) -> impl Iterator<Item = String> {
        let attributes = self.attributes.as_ref();
        let libraries =
            (!attributes.libraries.is_empty()).then(|| "the material libraries".to_owned());
        labels_named(attributes)
            .chain(self.materials.lost_altogether(attributes))
            .chain(libraries)
    }

    /// Determines how polygons are cut for a triangle format in which vertices at the same
    /// position are one.
    ///
    /// The cut matches that of the surface, except where exact welding alone makes faces meet.
    pub(crate) fn recuts(&self) -> Recuts {
        if self.faces.iter().all(|polygon| polygon.len() <= 3) {
            return Recuts::default();
        }
        let places = weld::exact(&self.positions, |_| 0);
        Recuts::new(Polygons {
            faces: &self.faces,
            places: &places,
            positions: &self.positions,
        })
    }
}

/// The attributes of the `kept` vertices; properties that differ at one of the `places` become
/// corner properties.
fn welded(attributes: Attributes, faces: &FaceList, kept: &[usize], places: &[u32]) -> Attributes {
    let mut welded = Attributes {
        vertices: Vec::new(),
        ..attributes
    };
    for property in attributes.vertices {
        if differs(&property, places) && !matches!(property.values, Values::Lists { .. }) {
            welded.corners.push(CornerProperty {
                name: property.name,
                components: property.components,
                values: property.values,
                indices: faces.corners().to_vec(),
            });
        } else {
            let kept = kept.iter().copied();
            welded.vertices.push(Property {
                values: property.values.gather(property.components, kept),
                ..property
            });
        }
    }
    welded
}

/// Returns `true` if vertices at one place differ in a property.
fn differs(property: &Property, places: &[u32]) -> bool {
    let k = property.components;
    let value = |v: usize, i: usize| property.values.get(k * v + i).map(f64::to_bits);
    places.iter().enumerate().any(|(v, &place)| {
        place as usize != v && (0..k).any(|i| value(v, i) != value(place as usize, i))
    })
}

/// Lists the names of properties for a warning, each once.
pub(crate) fn named<'a>(kind: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    let mut seen = HashSet::new();
    let names: Vec<&str> = names.filter(|name| seen.insert(*name)).collect();
    match names.as_slice() {
        [] => None,
        [name] => Some(format!("the {kind} property {name}")),
        names => Some(format!("the {kind} properties {}", names.join(", "))),
    }
}

/// Lists lost properties of vertices, faces and corners, given by their names.
pub(crate) fn lost_properties<'a>(
    vertices: impl Iterator<Item = &'a Property>,
    faces: impl Iterator<Item = &'a Property>,
    corners: impl Iterator<Item = &'a CornerProperty>,
) -> Vec<String> {
    [
        named("vertex", vertices.map(|p| p.name.as_str())),
        named("face", faces.map(|p| p.name.as_str())),
        named("corner", corners.map(|p| p.name.as_str())),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Lists the kinds of face labels for a warning.
fn labels_named(attributes: &Attributes) -> impl Iterator<Item = String> {
    attributes.labels.iter().map(|labels| {
        let words = match labels.kind {
            LabelKind::Object => "the names of objects",
            LabelKind::Group => "groups",
            LabelKind::Material => "materials",
            LabelKind::Smoothing => "smoothing groups",
        };
        words.to_owned()
    })
}
