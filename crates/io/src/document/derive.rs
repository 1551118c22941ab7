//! A document of another connectivity, with attributes interpolated from the corners of this one.
//!
//! [`Assembly`](crate::Assembly) copies elements of several documents instead.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::Document;
use crate::attributes::{Attributes, COLOR, CornerProperty, Labels, NORMAL, Property, UV, Values};
use crate::error::IoError;
use crate::faces::FaceList;

/// A new mesh whose corners lie on faces of a document.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Derivation {
    /// The new positions.
    pub positions: Vec<Point3<f64>>,
    /// The new faces, as indices of new vertices.
    pub faces: FaceList,
    /// Per new face: the face of the document that it lies on.
    pub face_sources: Vec<usize>,
    /// Per new corner, in face order: corners of the document, counted through all faces, and
    /// their weights, which sum to 1.
    pub corner_sources: Vec<Vec<(usize, f64)>>,
}

/// A document made by [`Document::derive`].
#[derive(Clone, Debug)]
pub struct Derived {
    /// The document.
    pub document: Document,
    /// The losses, for warnings: properties that were left out.
    pub losses: Vec<String>,
}

impl Document {
    /// Creates a document of another connectivity with the attributes of this one.
    ///
    /// Texture coordinates, colours and other decimal numbers are interpolated; whole numbers are
    /// those of the corner with the largest weight; names (groups, materials) and values per face
    /// are those of the source face. Normals and lists are left out, as the losses tell.
    ///
    /// # Errors
    /// [`IoError`] if the new mesh is invalid or the attributes of this one cannot be read.
    pub fn derive(&self, derivation: Derivation) -> Result<Derived, IoError> {
        let old = self.attributes()?;
        let (num_corners, num_faces) = (self.faces().num_corners(), self.faces().len());
        let is_inside = derivation.face_sources.iter().all(|&f| f < num_faces)
            && derivation
                .corner_sources
                .iter()
                .flatten()
                .all(|&(c, _)| c < num_corners);
        let new_corners = derivation.faces.num_corners();
        let is_complete = derivation.face_sources.len() == derivation.faces.len()
            && derivation.corner_sources.len() == new_corners;
        if !is_inside || !is_complete {
            return Err(IoError::Attributes {
                problem: "the sources do not match the faces and corners".to_owned(),
            });
        }
        let work = Transfer {
            derivation: &derivation,
            vertex_of_corner: self.faces().iter().flatten().copied().collect(),
        };
        let mut losses = Vec::new();
        let mut attributes = Attributes {
            comments: old.comments.clone(),
            libraries: old.libraries.clone(),
            labels: old
                .labels
                .iter()
                .map(|labels| work.labels(labels))
                .collect(),
            ..Attributes::default()
        };
        for property in &old.vertices {
            match work.kind(&property.name, &property.values) {
                Some(kind) => work.vertex_property(property, kind, &mut attributes),
                None => losses.push(lost(&property.name, "vertices")),
            }
        }
        for property in &old.faces {
            let elements = derivation.face_sources.iter().copied();
            if property.name == NORMAL {
                losses.push(lost(&property.name, "faces"));
            } else {
                attributes.faces.push(Property {
                    values: property.values.gather(property.components, elements),
                    ..property.clone()
                });
            }
        }
        for property in &old.corners {
            match work.kind(&property.name, &property.values) {
                Some(kind) => attributes
                    .corners
                    .push(work.corner_property(property, kind)),
                None => losses.push(lost(&property.name, "corners")),
            }
        }
        let materials = self.materials()?;
        let Derivation {
            positions, faces, ..
        } = derivation;
        let document = Self::new(positions, faces)?.with_attributes(attributes)?;
        let document = if self.has_materials(&materials) {
            document.with_materials(materials)?
        } else {
            document
        };
        Ok(Derived { document, losses })
    }

    fn has_materials(&self, materials: &crate::material::Materials) -> bool {
        !materials.list.is_empty()
    }
}

fn lost(name: &str, of: &str) -> String {
    format!("{name} of {of} is left out: it belongs to the old faces")
}

/// The treatment of a property.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Interpolated,
    /// The value with the largest weight.
    Chosen,
}

struct Transfer<'a> {
    derivation: &'a Derivation,
    vertex_of_corner: Vec<u32>,
}

impl Transfer<'_> {
    /// `None` for what is left out.
    fn kind(&self, name: &str, values: &Values) -> Option<Kind> {
        match values {
            _ if name == NORMAL => None,
            Values::Lists { .. } => None,
            Values::F32(_) | Values::F64(_) => Some(Kind::Interpolated),
            _ if name == COLOR || name == UV => Some(Kind::Interpolated),
            _ => Some(Kind::Chosen),
        }
    }

    fn labels(&self, labels: &Labels) -> Labels {
        let of = |&f: &usize| labels.faces.get(f).copied().unwrap_or(crate::NONE);
        Labels {
            faces: self.derivation.face_sources.iter().map(of).collect(),
            ..labels.clone()
        }
    }

    /// The numbers of a new corner, given the element of each old corner.
    fn value(
        &self,
        sources: &[(usize, f64)],
        components: usize,
        values: &Values,
        kind: Kind,
        element: impl Fn(usize) -> Option<usize>,
    ) -> Option<Vec<f64>> {
        let at = |e: usize, k: usize| values.get(e * components + k);
        match kind {
            Kind::Interpolated => (0..components)
                .map(|k| {
                    sources
                        .iter()
                        .map(|&(c, w)| Some(at(element(c)?, k)? * w))
                        .sum()
                })
                .collect(),
            Kind::Chosen => {
                let largest = sources.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
                let e = element(largest.0)?;
                (0..components).map(|k| at(e, k)).collect()
            }
        }
    }

    /// A property of vertices. Where the corners of a new vertex disagree, since it joins several
    /// old vertices, it becomes a property of corners.
    fn vertex_property(&self, property: &Property, kind: Kind, attributes: &mut Attributes) {
        let Property {
            components, values, ..
        } = property;
        let element = |c: usize| Some(self.vertex_of_corner[c] as usize);
        let corners = self.derivation.corner_sources.iter();
        let of_corners: Vec<Vec<f64>> = corners
            .map(|sources| {
                let value = self.value(sources, *components, values, kind, element);
                value.unwrap_or_else(|| vec![0.0; *components])
            })
            .collect();
        let mut of_vertex: Vec<Option<&Vec<f64>>> = vec![None; self.derivation.positions.len()];
        let mut agree = true;
        for (v, value) in self.derivation.faces.iter().flatten().zip(&of_corners) {
            let stored = of_vertex[*v as usize].get_or_insert(value);
            agree &= stored
                .iter()
                .zip(value)
                .all(|(a, b)| (a - b).abs() <= 1e-3 * (1.0 + a.abs()));
        }
        if agree {
            let mut new = property.values.gather(0, std::iter::empty());
            for value in of_vertex {
                for k in 0..*components {
                    new.push(value.map_or(0.0, |value| value[k]));
                }
            }
            attributes.vertices.push(Property {
                values: new,
                ..property.clone()
            });
        } else {
            let values = of_corners.into_iter().map(Some);
            attributes
                .corners
                .push(table(&property.name, *components, &property.values, values));
        }
    }

    fn corner_property(&self, property: &CornerProperty, kind: Kind) -> CornerProperty {
        let element = |c: usize| {
            let index = property
                .indices
                .get(c)
                .copied()
                .filter(|&i| i != crate::NONE)?;
            Some(index as usize)
        };
        let values = self.derivation.corner_sources.iter().map(|sources| {
            self.value(
                sources,
                property.components,
                &property.values,
                kind,
                element,
            )
        });
        table(
            &property.name,
            property.components,
            &property.values,
            values,
        )
    }
}

/// A table in which equal values appear once.
fn table(
    name: &str,
    components: usize,
    like: &Values,
    values: impl Iterator<Item = Option<Vec<f64>>>,
) -> CornerProperty {
    let mut entries = like.gather(0, std::iter::empty());
    let mut known: BTreeMap<Vec<u64>, u32> = BTreeMap::new();
    let indices = values
        .map(|value| {
            let Some(value) = value else {
                return crate::NONE;
            };
            let next = known.len() as u32;
            let bits = value.iter().map(|x| x.to_bits()).collect();
            *known.entry(bits).or_insert_with(|| {
                for x in value {
                    entries.push(x);
                }
                next
            })
        })
        .collect();
    CornerProperty {
        name: name.to_owned(),
        components,
        values: entries,
        indices,
    }
}
