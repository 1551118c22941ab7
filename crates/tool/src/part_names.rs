//! The parts of a model by the names that its file has for them.
//!
//! A part is a connected component of the surface, numbered in the order of the file. Its name is
//! that of its node or object (a mesh of a glTF), its group or its material, whichever of these
//! tells most parts apart. The others can be used as well.

use cotan_io::{Document, IoError, LabelKind, Labels, ProcessingMesh};
use thiserror::Error;

use crate::nodes;

/// The parts of a model.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PartNames {
    /// In the order of the file.
    parts: Vec<NamedPart>,
    /// The number of each component of the surface.
    number_of: Vec<usize>,
}

/// A part of a model.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct NamedPart {
    /// Its name in the file; empty if it has none.
    pub name: String,
    /// The component of the surface.
    pub component: usize,
    /// Its other names: of its nodes and the nodes above them, its object, group and material.
    others: Vec<String>,
}

/// A part that the model does not have.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("there is no part {word}; {known}")]
pub struct UnknownPart {
    /// The name or number that was given.
    pub word: String,
    /// The parts that exist.
    pub known: String,
}

impl PartNames {
    /// Finds the parts of a document's surface and their names.
    ///
    /// # Errors
    /// [`IoError`] for labels that cannot be read.
    pub fn new(document: &Document, processing: &ProcessingMesh) -> Result<Self, IoError> {
        let mesh = processing.mesh();
        let components = mesh.components();
        let mut first_vertex = vec![usize::MAX; components.count()];
        for v in mesh.vertices() {
            let first = &mut first_vertex[components.of(v)];
            *first = (*first).min(processing.document_vertex(v));
        }
        let mut first_face = vec![usize::MAX; components.count()];
        for face in mesh.faces() {
            let Some(v) = mesh.face_vertices(face).next() else {
                continue;
            };
            let first = &mut first_face[components.of(v)];
            *first = (*first).min(processing.document_face(face));
        }
        let mut order: Vec<usize> = (0..components.count()).collect();
        order.sort_by_key(|c| first_vertex[*c]);
        let (names, mut others) = match components.count() {
            1 => (vec![String::new()], vec![Vec::new()]),
            _ => names(document, &first_face)?,
        };
        let mut number_of = vec![0; order.len()];
        for (number, &component) in order.iter().enumerate() {
            number_of[component] = number;
        }
        let mut part = |component: &usize| NamedPart {
            name: names[*component].clone(),
            component: *component,
            others: std::mem::take(&mut others[*component]),
        };
        Ok(Self {
            parts: order.iter().map(&mut part).collect(),
            number_of,
        })
    }

    /// The parts, in the order of the file.
    pub fn parts(&self) -> &[NamedPart] {
        &self.parts
    }

    /// The number of a component of the surface.
    pub fn number_of(&self, component: usize) -> usize {
        self.number_of.get(component).copied().unwrap_or(component)
    }

    /// The components that a name or number means. Several parts may have the same name.
    ///
    /// # Errors
    /// [`UnknownPart`] with the names that exist.
    pub fn find(&self, word: &str) -> Result<Vec<usize>, UnknownPart> {
        let components = |is_meant: &dyn Fn(&NamedPart) -> bool| -> Vec<usize> {
            let parts = self.parts.iter().filter(|part| is_meant(part));
            parts.map(|part| part.component).collect()
        };
        for named in [
            components(&|part| part.name == word && !word.is_empty()),
            components(&|part| part.others.iter().any(|other| other == word)),
        ] {
            if !named.is_empty() {
                return Ok(named);
            }
        }
        let number = word.parse::<usize>().ok();
        match number.and_then(|number| self.parts.get(number)) {
            Some(part) => Ok(vec![part.component]),
            None => Err(UnknownPart {
                word: word.to_owned(),
                known: self.known(),
            }),
        }
    }

    fn known(&self) -> String {
        let count = self.parts.len();
        let numbers = format!("the model has {count} parts, numbered from 0");
        let names: Vec<&str> = self.parts.iter().map(|part| part.name.as_str()).collect();
        match listed(names.into_iter().filter(|name| !name.is_empty())) {
            names if names.is_empty() => numbers,
            names => format!("{numbers}; the names are {names}"),
        }
    }
}

/// Names, each once, separated by commas; the first ones of many.
pub(crate) fn listed<'a>(names: impl Iterator<Item = &'a str>) -> String {
    const MOST: usize = 20;
    let mut distinct: Vec<&str> = Vec::new();
    for name in names {
        if !distinct.contains(&name) {
            if distinct.len() == MOST {
                distinct.push("…");
                break;
            }
            distinct.push(name);
        }
    }
    distinct.join(", ")
}

/// The name of each component and its other names, by one of its faces.
fn names(document: &Document, faces: &[usize]) -> Result<(Vec<String>, Vec<Vec<String>>), IoError> {
    let attributes = document.attributes()?;
    let parts = document.parts();
    let of_nodes = nodes::names_of(document.nodes(), parts.len());
    let of_nodes = |face: usize| {
        // A part without faces begins where the next one does.
        let part = parts.partition_point(|part| part.faces.end <= face);
        of_nodes.get(part).map_or(&[][..], Vec::as_slice)
    };
    let mut others: Vec<Vec<String>> = Vec::with_capacity(faces.len());
    for &face in faces {
        others.push(of_nodes(face).iter().map(|&name| name.to_owned()).collect());
    }
    let name = |labels: &Labels, face: usize| {
        let index = labels.faces.get(face).copied();
        let name = index.and_then(|index| labels.names.get(index as usize));
        name.cloned().unwrap_or_default()
    };
    let mut best: (usize, Vec<String>) = (0, vec![String::new(); faces.len()]);
    let mut choose = |names: Vec<String>| {
        let mut distinct: Vec<&String> = names.iter().filter(|name| !name.is_empty()).collect();
        distinct.sort_unstable();
        distinct.dedup();
        if distinct.len() > best.0 {
            best = (distinct.len(), names);
        }
    };
    let first = |names: &Vec<String>| names.first().cloned().unwrap_or_default();
    choose(others.iter().map(first).collect());
    for kind in [LabelKind::Object, LabelKind::Group, LabelKind::Material] {
        let Some(labels) = attributes.label(kind) else {
            continue;
        };
        let names: Vec<String> = faces.iter().map(|face| name(labels, *face)).collect();
        for (others, name) in others.iter_mut().zip(&names) {
            if !name.is_empty() && !others.contains(name) {
                others.push(name.clone());
            }
        }
        choose(names);
    }
    Ok((best.1, others))
}
