//! A document made of parts of others.
//!
//! Elements are copied, from several documents whose properties and materials are united.
//! [`Derivation`](crate::Derivation) is for one document: its values are interpolated.

use std::collections::BTreeSet;

use nalgebra::Point3;

use crate::attributes::{
    Attributes, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
use crate::document::Document;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::material::{Material, Materials, unique_names};

/// A vertex, face or corner of one of several documents. Corners are counted through all faces.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct DataSource {
    /// The index of the document.
    pub document: usize,
    /// The index of its element.
    pub element: usize,
}

/// The vertices and faces of a new document, each with the element of another document whose data
/// it gets: colours, texture coordinates, materials, groups, and other properties.
///
/// Normals are left out, because they are those of the old surfaces.
#[derive(Clone, Debug, Default)]
pub struct Assembly {
    /// The positions.
    pub positions: Vec<Point3<f64>>,
    /// The faces, as indices of these positions.
    pub faces: FaceList,
    /// For each vertex its source; without one it gets zeros.
    pub vertices: Vec<Option<DataSource>>,
    /// For each face its source.
    pub face_sources: Vec<Option<DataSource>>,
    /// For each corner of the faces its source.
    pub corners: Vec<Option<DataSource>>,
}

/// A document made of parts of others.
#[derive(Clone, Debug)]
pub struct Assembled {
    /// The document.
    pub document: Document,
    /// Everything that could not be combined, one sentence each.
    pub losses: Vec<String>,
}

impl Assembly {
    /// Creates the document.
    ///
    /// Properties of the same name become one. Where their types differ, those of the first
    /// document that has it are kept, and the loss is reported. Materials and their images are
    /// appended; equal names get numbers.
    ///
    /// # Errors
    /// [`IoError`] as for [`Document::new`], [`Document::attributes`] and
    /// [`Document::materials`], and [`IoError::Attributes`] if there is not one source for each
    /// vertex, face and corner.
    pub fn build(self, documents: &[&Document]) -> Result<Assembled, IoError> {
        let counts = [
            (self.vertices.len(), self.positions.len()),
            (self.face_sources.len(), self.faces.len()),
            (self.corners.len(), self.faces.num_corners()),
        ];
        if counts.iter().any(|(sources, elements)| sources != elements) {
            return Err(IoError::Attributes {
                problem: "there is not one source for each vertex, face and corner".to_owned(),
            });
        }
        let mut losses = BTreeSet::new();
        let mut parts = Vec::with_capacity(documents.len());
        for document in documents {
            parts.push(Contents {
                attributes: document.attributes()?.into_owned(),
                materials: document.materials()?,
            });
        }
        let at_corners = parts
            .iter()
            .any(|part| part.attributes.corner(UV).is_some())
            || documents.iter().any(|document| document.is_split());
        if at_corners {
            for (part, document) in parts.iter_mut().zip(documents) {
                move_uv_to_corners(&mut part.attributes, document.faces());
            }
        }
        let attributes = Attributes {
            vertices: properties(&parts, |a| &a.vertices, &self.vertices, &mut losses),
            faces: properties(&parts, |a| &a.faces, &self.face_sources, &mut losses),
            corners: corners(&parts, &self.corners, &mut losses),
            labels: labels(&parts, &self.face_sources),
            comments: parts
                .iter()
                .flat_map(|part| part.attributes.comments.clone())
                .collect(),
            libraries: parts
                .iter()
                .flat_map(|part| part.attributes.libraries.clone())
                .collect(),
        };
        let materials = materials(&parts);
        let document = Document::new(self.positions, self.faces)?.with_attributes(attributes)?;
        let document = match materials {
            Some(materials) => document.with_materials(materials)?,
            None => document,
        };
        Ok(Assembled {
            document,
            losses: losses.into_iter().collect(),
        })
    }
}

/// The data of one of the documents.
struct Contents {
    attributes: Attributes,
    materials: Materials,
}

/// Turns texture coordinates per vertex into ones per corner: where vertices that a format splits
/// along seams become one, each side keeps its own.
fn move_uv_to_corners(attributes: &mut Attributes, faces: &FaceList) {
    if attributes.corner(UV).is_some() {
        return;
    }
    let found = attributes.vertices.iter().position(|p| p.name == UV);
    let Some(index) = found else { return };
    let Property {
        name,
        components,
        values,
    } = attributes.vertices.remove(index);
    attributes.corners.push(CornerProperty {
        name,
        components,
        values,
        indices: faces.corners().to_vec(),
    });
}

/// Every name in order of first use.
fn names<'a>(all: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names = Vec::new();
    for name in all {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn properties(
    parts: &[Contents],
    of: impl Fn(&Attributes) -> &Vec<Property>,
    sources: &[Option<DataSource>],
    losses: &mut BTreeSet<String>,
) -> Vec<Property> {
    let all = parts.iter().flat_map(|part| of(&part.attributes));
    let mut properties = Vec::new();
    for name in names(all.map(|p| p.name.as_str())) {
        if name == NORMAL {
            losses.insert(NORMALS_LOST.to_owned());
            continue;
        }
        // All values in one row; each part begins at its offset, if it has the property.
        let mut row: Option<Property> = None;
        let mut offsets = Vec::with_capacity(parts.len());
        for part in parts {
            let found = of(&part.attributes).iter().find(|p| p.name == name);
            let offset = match (found, &mut row) {
                (None, _) => None,
                (Some(p), None) => {
                    row = Some(p.clone());
                    Some(0)
                }
                (Some(p), Some(row)) => {
                    let before = row.values.len();
                    let fits = p.components == row.components && row.values.append(&p.values);
                    if !fits {
                        losses.insert(differing(name));
                    }
                    let size = match row.values {
                        Values::Lists { .. } => 1,
                        _ => row.components.max(1),
                    };
                    fits.then_some(before / size)
                }
            };
            offsets.push(offset);
        }
        let place = |source: &Option<DataSource>| {
            let source = (*source)?;
            let offset = offsets.get(source.document).copied().flatten()?;
            Some(offset + source.element)
        };
        if let Some(row) = row {
            let elements = sources.iter().map(|s| place(s).unwrap_or(NONE as usize));
            properties.push(Property {
                values: row.values.gather(row.components, elements),
                ..row
            });
        }
    }
    properties
}

fn corners(
    parts: &[Contents],
    sources: &[Option<DataSource>],
    losses: &mut BTreeSet<String>,
) -> Vec<CornerProperty> {
    let all = parts.iter().flat_map(|part| &part.attributes.corners);
    let mut properties = Vec::new();
    for name in names(all.map(|p| p.name.as_str())) {
        if name == NORMAL {
            losses.insert(NORMALS_LOST.to_owned());
            continue;
        }
        let mut table: Option<CornerProperty> = None;
        // For each part its indices and their offset in the table.
        let mut found: Vec<Option<(&[u32], u32)>> = Vec::with_capacity(parts.len());
        for part in parts {
            let of_part = match (part.attributes.corner(name), &mut table) {
                (None, _) => None,
                (Some(p), None) => {
                    table = Some(p.clone());
                    Some((&p.indices[..], 0))
                }
                (Some(p), Some(table)) => {
                    let before = table.values.len() / table.components.max(1);
                    let fits = p.components == table.components && table.values.append(&p.values);
                    if !fits {
                        losses.insert(differing(name));
                    }
                    fits.then_some((&p.indices[..], before as u32))
                }
            };
            found.push(of_part);
        }
        let index = |source: &Option<DataSource>| {
            let source = (*source)?;
            let (indices, offset) = (*found.get(source.document)?)?;
            let index = indices
                .get(source.element)
                .filter(|&&index| index != NONE)?;
            Some(index + offset)
        };
        if let Some(table) = table {
            properties.push(CornerProperty {
                indices: sources.iter().map(|s| index(s).unwrap_or(NONE)).collect(),
                ..table
            });
        }
    }
    properties
}

fn labels(parts: &[Contents], sources: &[Option<DataSource>]) -> Vec<Labels> {
    let mut kinds: Vec<LabelKind> = Vec::new();
    for labels in parts.iter().flat_map(|part| &part.attributes.labels) {
        if !kinds.contains(&labels.kind) {
            kinds.push(labels.kind);
        }
    }
    let of_kind = |kind| {
        let mut names = Vec::new();
        let mut found: Vec<Option<(&[u32], u32)>> = Vec::with_capacity(parts.len());
        for part in parts {
            let labels = part.attributes.label(kind);
            found.push(labels.map(|labels| (&labels.faces[..], names.len() as u32)));
            names.extend(
                labels
                    .into_iter()
                    .flat_map(|labels| labels.names.iter().cloned()),
            );
        }
        // Materials that are known are told apart; without them a name is all that there is.
        let is_known = parts.iter().any(|part| !part.materials.list.is_empty());
        if kind == LabelKind::Material && is_known {
            let own = names.iter().map(String::as_str);
            names = unique_names(own, "material", |name| Some(name.to_owned()));
        }
        let label = |source: &Option<DataSource>| {
            let source = (*source)?;
            let (faces, offset) = (*found.get(source.document)?)?;
            let label = faces.get(source.element).filter(|&&label| label != NONE)?;
            Some(label + offset)
        };
        Labels {
            kind,
            names,
            faces: sources.iter().map(|s| label(s).unwrap_or(NONE)).collect(),
        }
    };
    kinds.into_iter().map(of_kind).collect()
}

/// The materials of all parts; `None` if none are known.
fn materials(parts: &[Contents]) -> Option<Materials> {
    if parts.iter().all(|part| part.materials.is_empty()) {
        return None;
    }
    let mut used = Vec::new();
    let mut unused = Vec::new();
    let mut images = Vec::new();
    for part in parts {
        let names = part.attributes.label(LabelKind::Material);
        let names = names.map_or(&[][..], |labels| &labels.names[..]);
        let own = part.materials.list.iter().cloned().map(|mut material| {
            for texture in material.textures_mut().into_iter().flatten() {
                *texture += images.len();
            }
            material
        });
        let mut own = own.collect::<Vec<_>>().into_iter();
        for name in names {
            used.push(own.next().unwrap_or_else(|| Material::named(name.clone())));
        }
        unused.extend(own);
        images.extend(part.materials.images.iter().cloned());
    }
    used.extend(unused);
    let own = used.iter().map(|material| material.name.as_str());
    let unique = unique_names(own, "material", |name| Some(name.to_owned()));
    for (material, name) in used.iter_mut().zip(unique) {
        material.name = name;
    }
    let mut materials = Materials::new(used, images);
    for part in parts {
        materials
            .others
            .extend(part.materials.others.iter().cloned());
    }
    Some(materials)
}

fn differing(name: &str) -> String {
    format!("the property `{name}` differs in type; that of a later file is left out")
}

const NORMALS_LOST: &str = "normals are left out; most programs compute them";

#[cfg(test)]
mod tests {
    use super::*;
    use crate::format::Format;

    /// A triangle with UVs in a material, and a colour per vertex.
    fn triangle(material: &str, colors: Values) -> Document {
        let at = |x: f64, y: f64| Point3::new(x, y, 0.0);
        let faces: FaceList = [vec![0_u32, 1, 2]].into_iter().collect();
        let attributes = Attributes {
            vertices: vec![Property {
                name: "color".to_owned(),
                components: 3,
                values: colors,
            }],
            corners: vec![CornerProperty {
                name: "uv".to_owned(),
                components: 2,
                values: Values::F64(vec![0.0, 0.0, 1.0, 0.0, 0.5, 1.0]),
                indices: vec![0, 1, 2],
            }],
            labels: vec![Labels {
                kind: LabelKind::Material,
                names: vec![material.to_owned()],
                faces: vec![0],
            }],
            ..Attributes::default()
        };
        let document = Document::new(vec![at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0)], faces);
        let document = document.unwrap().with_attributes(attributes).unwrap();
        let mut skin = Material::named(material);
        skin.roughness = 0.25;
        document
            .with_materials(Materials::new(vec![skin], Vec::new()))
            .unwrap()
    }

    /// Both triangles, side by side.
    fn both(a: &Document, b: &Document) -> Assembled {
        let source = |k: usize| {
            Some(DataSource {
                document: k / 3,
                element: k % 3,
            })
        };
        let moved = b
            .positions()
            .iter()
            .map(|p| p + nalgebra::Vector3::x() * 2.0);
        let assembly = Assembly {
            positions: a.positions().iter().copied().chain(moved).collect(),
            faces: [vec![0_u32, 1, 2], vec![3, 4, 5]].into_iter().collect(),
            vertices: (0..6).map(source).collect(),
            face_sources: vec![source(0), source(3)],
            corners: (0..6).map(source).collect(),
        };
        assembly.build(&[a, b]).unwrap()
    }

    #[test]
    fn data_of_both_documents_are_there() {
        let colors = |first: u8| Values::U8((first..first + 9).collect());
        let (a, b) = (triangle("skin", colors(1)), triangle("skin", colors(101)));
        let Assembled { document, losses } = both(&a, &b);
        assert_eq!(losses, Vec::<String>::new());
        let attributes = document.attributes().unwrap();
        let Values::U8(colors) = &attributes.vertex("color").unwrap().values else {
            panic!("colours keep their type");
        };
        assert_eq!((colors[0], colors[9]), (1, 101));
        assert_eq!(attributes.corner("uv").unwrap().indices, [0, 1, 2, 3, 4, 5]);
        let labels = attributes.label(LabelKind::Material).unwrap();
        assert_eq!(labels.names, ["skin", "skin.1"]);
        assert_eq!(labels.faces, [0, 1]);
        let materials = document.materials().unwrap();
        assert_eq!(materials.list.len(), 2);
        assert!(materials.list.iter().all(|m| m.roughness == 0.25));
        for format in [Format::Obj, Format::Ply, Format::Glb] {
            let bytes = document.write(format).unwrap();
            assert!(!bytes.is_empty());
        }
    }

    #[test]
    fn differing_types_are_named() {
        let a = triangle("skin", Values::U8(vec![7; 9]));
        let b = triangle("bark", Values::F32(vec![0.5; 9]));
        let Assembled { document, losses } = both(&a, &b);
        assert_eq!(losses.len(), 1);
        assert!(losses[0].contains("`color`"), "{losses:?}");
        let attributes = document.attributes().unwrap();
        let Values::U8(colors) = &attributes.vertex("color").unwrap().values else {
            panic!("the first type stays");
        };
        assert_eq!((colors[0], colors[9]), (7, 0));
    }

    #[test]
    fn missing_sources_are_refused() {
        let a = triangle("skin", Values::U8(vec![7; 9]));
        let assembly = Assembly {
            positions: a.positions().to_vec(),
            faces: a.faces().clone(),
            ..Assembly::default()
        };
        assert!(matches!(
            assembly.build(&[&a]),
            Err(IoError::Attributes { .. })
        ));
    }
}
