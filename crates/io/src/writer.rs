//! New files: a document written in a format that it was not read from.

use std::borrow::Cow;
use std::collections::HashSet;

use nalgebra::Point3;

use crate::attributes::{Attributes, CornerProperty, LabelKind, Property, Values};
use crate::companions::{References, WriteOptions, Written};
use crate::document::Document;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::instances::Expanded;
use crate::material::Materials;
use crate::recut::{Polygons, Recuts};
use crate::{gltf, obj, off, ply, stl, weld};

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

impl Contents<'_> {
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

/// Writes the document as a new file, together with its companion files.
pub(crate) fn write(
    document: &Document,
    format: Format,
    options: &WriteOptions<'_>,
) -> Result<Written, IoError> {
    let contents = contents(document, format)?;
    let bytes = match format {
        Format::Obj => {
            let mut written = obj::write_new(&contents, options)?;
            if let Some(origin) = document.origin().filter(|_| document.keeps_libraries()) {
                let References { companions, left } = origin.references(&written.bytes)?;
                written.companions.extend(companions);
                written.left.extend(left);
            }
            return Ok(written);
        }
        Format::Off => off::write_new(&contents),
        Format::Ply => ply::write_new(&contents),
        Format::Stl => stl::write_new(&contents),
        Format::Gltf | Format::Glb => gltf::write_new(&contents, format),
    };
    Ok(Written::from(bytes?))
}

/// Lists what a new file of this format cannot represent.
pub(crate) fn losses(document: &Document, format: Format) -> Result<Vec<String>, IoError> {
    let contents = contents(document, format)?;
    Ok(match format {
        Format::Obj => obj::losses(&contents),
        Format::Off => off::losses(&contents),
        Format::Ply => ply::losses(&contents),
        Format::Stl => stl::losses(&contents),
        Format::Gltf | Format::Glb => gltf::losses(&contents),
    })
}

fn contents(document: &Document, format: Format) -> Result<Contents<'_>, IoError> {
    let Expanded {
        positions,
        faces,
        attributes,
        places,
    } = document.expanded()?;
    let materials = match format {
        Format::Obj if document.keeps_libraries() => Materials::default(),
        _ => document.materials_of(&attributes),
    };
    if places
        .iter()
        .enumerate()
        .all(|(v, &place)| v == place as usize)
    {
        return Ok(Contents {
            positions,
            faces,
            attributes,
            materials,
        });
    }
    // The representatives of the places keep their relative order.
    let kept: Vec<usize> = (0..positions.len())
        .filter(|&v| places[v] as usize == v)
        .collect();
    let mut number = vec![0u32; positions.len()];
    (0u32..).zip(&kept).for_each(|(n, &v)| number[v] = n);
    let attributes = attributes.into_owned();
    let mut welded = Attributes {
        vertices: Vec::new(),
        ..attributes
    };
    for property in attributes.vertices {
        if differs(&property, &places) && !matches!(property.values, Values::Lists { .. }) {
            welded.corners.push(CornerProperty {
                name: property.name,
                components: property.components,
                values: property.values,
                indices: faces.corners().to_vec(),
            });
        } else {
            welded.vertices.push(Property {
                values: property
                    .values
                    .gather(property.components, kept.iter().copied()),
                ..property
            });
        }
    }
    let polygons = faces
        .iter()
        .map(|polygon| -> Vec<u32> {
            let place = |&v: &u32| number[places[v as usize] as usize];
            polygon.iter().map(place).collect()
        })
        .collect();
    Ok(Contents {
        positions: kept.iter().map(|&v| positions[v]).collect(),
        faces: Cow::Owned(polygons),
        attributes: Cow::Owned(welded),
        materials,
    })
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

/// Lists the kinds of face labels for a warning.
pub(crate) fn labels_named(attributes: &Attributes) -> impl Iterator<Item = String> {
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
