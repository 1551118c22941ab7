//! The vertices held by the handles of a file, in the file, the document and the surface.

use std::collections::HashSet;

use cotan_io::{Document, LabelKind, ProcessingMesh};
use nalgebra::Point3;

use super::constraint::{Constraint, Goal};
use super::error::{HandlePlace, HandlesError};
use super::part_settings::PartWord;
use super::{FileVertices, Kind};
use crate::nodes;
use crate::part_names::{PartNames, listed};

/// The vertices that handles refer to.
pub(super) struct Vertices<'a> {
    pub(super) document: &'a Document,
    pub(super) processing: &'a ProcessingMesh,
    pub(super) file_vertices: Option<&'a FileVertices>,
}

impl Vertices<'_> {
    /// Number of vertices in the file.
    pub(super) fn len(&self) -> usize {
        match self.file_vertices {
            Some(file) => file.num_vertices(),
            None => self.document.positions().len(),
        }
    }

    /// The document vertices derived from a file vertex.
    fn copies(&self, vertex: usize) -> impl Iterator<Item = usize> {
        let copies = self.file_vertices.map(|file| file.copies(vertex));
        let own = copies.is_none().then_some(vertex);
        own.into_iter()
            .chain(copies.into_iter().flatten().map(|&(_, v)| v))
    }

    /// Converts the constraints to document indices, with welded vertices held once.
    ///
    /// If several vertices of one handle are one vertex of the surface, the first determines the
    /// target.
    pub(super) fn on_surface(&self, constraints: &[Constraint], kind: Kind) -> Vec<Constraint> {
        let positions = self.document.positions();
        let mut seen = HashSet::new();
        let mut held = Vec::with_capacity(constraints.len());
        for constraint in constraints {
            for copy in self.copies(constraint.vertex) {
                let Some(id) = self.processing.vertex(copy) else {
                    continue;
                };
                // All moved vertices of a .sel file form one handle, and so do all fixed ones.
                let handle = match kind {
                    Kind::Sel => None,
                    Kind::Json | Kind::Text => Some(constraint.place),
                };
                let is_fixed = constraint.goal == Goal::Stay;
                if !seen.insert((handle, is_fixed, id)) {
                    continue;
                }
                let vertex = self.processing.document_vertex(id);
                let goal = match (constraint.goal, positions.get(copy), positions.get(vertex)) {
                    (Goal::To(target), Some(own), Some(first)) if target == *own => {
                        Goal::To(*first)
                    }
                    // A vertex keeps its offset from the one that it is welded to.
                    (Goal::To(target), Some(own), Some(first)) if own != first => {
                        Goal::To(target - (own - first))
                    }
                    (goal, ..) => goal,
                };
                held.push(Constraint {
                    vertex,
                    goal,
                    ..*constraint
                });
            }
        }
        held
    }

    /// The position of a file vertex that a face uses.
    pub(super) fn position(
        &self,
        vertex: usize,
        place: HandlePlace,
    ) -> Result<Point3<f64>, HandlesError> {
        let first = self.copies(vertex).next();
        let Some(position) = first.and_then(|v| self.document.positions().get(v)) else {
            return Err(HandlesError::OutOfRange {
                place,
                vertex,
                num_vertices: self.len(),
            });
        };
        match self.is_used(vertex) {
            true => Ok(*position),
            false => Err(HandlesError::Unreferenced { place, vertex }),
        }
    }

    /// The file vertex of a document vertex.
    fn in_file(&self, vertex: usize) -> usize {
        self.file_vertices
            .map_or(vertex, |file| file.vertex(vertex))
    }

    /// The file vertices of the faces with a label; `word` is its kind in messages.
    pub(super) fn labelled(
        &self,
        kind: LabelKind,
        word: &str,
        name: &str,
        place: HandlePlace,
    ) -> Result<Vec<usize>, HandlesError> {
        let invalid = |problem: String| HandlesError::Invalid { place, problem };
        let attributes = self.document.attributes();
        let attributes = attributes.map_err(|error| {
            invalid(format!("names a {word}, but the file has errors: {error}"))
        })?;
        let Some(labels) = attributes.label(kind) else {
            return Err(invalid(format!("names a {word}, but the file names none")));
        };
        // A face in several groups has their names separated by spaces.
        let is_named = |label: &String| label == name || label.split(' ').any(|own| own == name);
        let is_wanted: Vec<bool> = labels.names.iter().map(is_named).collect();
        if !is_wanted.contains(&true) {
            let known = listed(labels.names.iter().map(String::as_str));
            return Err(invalid(format!(
                "names the {word} \"{name}\", which the file does not have; the names are {known}"
            )));
        }
        let faces = self.document.faces().iter().zip(&labels.faces);
        let wanted = faces.filter(|(_, label)| is_wanted.get(**label as usize) == Some(&true));
        let vertices = wanted.flat_map(|(face, _)| face.iter().map(|v| *v as usize));
        Ok(self.used_of(vertices))
    }

    /// The file vertices of a node's mesh, or of the meshes below a node that has none.
    pub(super) fn of_node(
        &self,
        name: &str,
        place: HandlePlace,
    ) -> Result<Vec<usize>, HandlesError> {
        let invalid = |problem: String| HandlesError::Invalid { place, problem };
        let nodes = self.document.nodes();
        if nodes.is_empty() {
            let problem = "names a node, but only a glTF has nodes; name an object, a group, a \
                           material or a part";
            return Err(invalid(problem.into()));
        }
        if !nodes.iter().any(|node| node.name == name) {
            let names = nodes.iter().map(|node| node.name.as_str());
            let known = listed(names.filter(|name| !name.is_empty()));
            return Err(invalid(format!(
                "names the node \"{name}\", which the file does not have; the names are {known}"
            )));
        }
        let parts = nodes::parts_of(nodes, name);
        let parts = parts
            .iter()
            .filter_map(|part| self.document.parts().get(*part));
        let faces = parts.flat_map(|part| part.faces.clone());
        let faces = faces.filter_map(|face| self.document.faces().get(face));
        Ok(self.used_of(faces.flatten().map(|v| *v as usize)))
    }

    /// The file vertices of a part.
    pub(super) fn of_part(
        &self,
        part: &PartWord,
        place: HandlePlace,
    ) -> Result<Vec<usize>, HandlesError> {
        let invalid = |problem: String| HandlesError::Invalid { place, problem };
        let names = PartNames::new(self.document, self.processing);
        let names = names
            .map_err(|error| invalid(format!("names a part, but the file has errors: {error}")))?;
        let found = part.find(&names);
        let found = found.map_err(|error| invalid(format!("names a part: {error}")))?;
        let components = self.processing.mesh().components();
        let all = self.processing.mesh().vertices();
        let own = all.filter(|v| found.contains(&components.of(*v)));
        Ok(self.used_of(own.map(|v| self.processing.document_vertex(v))))
    }

    /// File vertices of document vertices that faces use, in order and each once.
    fn used_of(&self, vertices: impl Iterator<Item = usize>) -> Vec<usize> {
        let mut vertices: Vec<usize> = vertices.map(|v| self.in_file(v)).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices.retain(|v| self.is_used(*v));
        vertices
    }

    fn is_used(&self, vertex: usize) -> bool {
        self.copies(vertex)
            .any(|v| self.processing.vertex(v).is_some())
    }

    /// The file vertices that a face uses, in order.
    pub(super) fn used(&self) -> impl Iterator<Item = (usize, Point3<f64>)> {
        (0..self.len())
            .filter(|&vertex| self.is_used(vertex))
            .filter_map(|vertex| {
                let first = self.copies(vertex).next()?;
                Some((vertex, *self.document.positions().get(first)?))
            })
    }
}
