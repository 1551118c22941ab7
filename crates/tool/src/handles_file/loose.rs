//! The parts of a mesh without handles.

use std::fmt;

use cotan_io::ProcessingMesh;

use super::{Constraint, FileVertices, Goal, HandlePlace};

/// Handles that hold the components of a mesh without handles in place.
///
/// The `Display` text is a warning about this.
#[derive(Clone, PartialEq, Debug)]
pub struct Loose {
    /// Every vertex of those components, in order; never empty.
    pub constraints: Vec<Constraint>,
    /// Number of components.
    pub num_components: usize,
    /// The first of the vertices, as an index of the file.
    pub first_vertex: usize,
}

impl Loose {
    /// Finds the components without a handle; `None` if all have one.
    ///
    /// Vertices are document indices.
    pub fn of(
        constraints: &[Constraint],
        processing: &ProcessingMesh,
        file_vertices: Option<&FileVertices>,
    ) -> Option<Self> {
        let components = processing.mesh().components();
        let mut is_held = vec![false; components.count()];
        for v in constraints
            .iter()
            .filter_map(|c| processing.vertex(c.vertex))
        {
            is_held[components.of(v)] = true;
        }
        let vertices = processing.mesh().vertices();
        let mut loose: Vec<usize> = vertices
            .filter(|&v| !is_held[components.of(v)])
            .map(|v| processing.document_vertex(v))
            .collect();
        // The mesh may be numbered differently.
        loose.sort_unstable();
        let &first = loose.first()?;
        let hold = |vertex| Constraint {
            vertex,
            goal: Goal::Stay,
            weight: None,
            turn: None,
            place: HandlePlace::Loose,
        };
        Some(Self {
            constraints: loose.into_iter().map(hold).collect(),
            num_components: is_held.iter().filter(|is_held| !**is_held).count(),
            first_vertex: file_vertices.map_or(first, |file| file.vertex(first)),
        })
    }
}

impl fmt::Display for Loose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (s, verb) = match self.num_components {
            1 => ("", "has"),
            _ => ("s", "have"),
        };
        write!(
            f,
            "{} component{s} without a handle ({} vertices, from vertex {}) {verb} been held in place",
            self.num_components,
            self.constraints.len(),
            self.first_vertex
        )
    }
}
