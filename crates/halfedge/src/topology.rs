//! Topology of the surface: components, boundary loops, Euler characteristic, genus.
//!
//! All of it follows from Euler's formula for an oriented surface with c components, b boundary
//! loops and total genus g: V − E + F = 2c − 2g − b.

use crate::disjoint_sets::DisjointSets;
use crate::ids::{HalfedgeId, NONE, VertexId};
use crate::map::{HalfedgeMap, VertexMap};
use crate::mesh::HalfedgeMesh;

/// The connected components of a mesh, indexed from 0 in the order of their lowest vertex.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Components {
    of_vertex: VertexMap<u32>,
    sizes: Vec<usize>,
}

impl Components {
    /// Number of components.
    pub fn count(&self) -> usize {
        self.sizes.len()
    }

    /// The component of `vertex`.
    ///
    /// # Panics
    /// If the mesh has no such vertex.
    pub fn of(&self, vertex: VertexId) -> usize {
        self.of_vertex[vertex] as usize
    }

    /// The component of each vertex.
    pub fn of_vertices(&self) -> &VertexMap<u32> {
        &self.of_vertex
    }

    /// The number of vertices of each component.
    pub fn sizes(&self) -> &[usize] {
        &self.sizes
    }
}

/// The element counts of a component and the quantities derived from them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ComponentTopology {
    /// Number of vertices.
    pub num_vertices: usize,
    /// Number of edges.
    pub num_edges: usize,
    /// Number of faces.
    pub num_faces: usize,
    /// Number of boundary loops.
    pub num_boundary_loops: usize,
}

impl ComponentTopology {
    /// V − E + F.
    #[must_use]
    pub fn euler_characteristic(&self) -> i64 {
        self.num_vertices as i64 - self.num_edges as i64 + self.num_faces as i64
    }

    /// Number of handles: (2 − χ − b) / 2, where b is the number of boundary loops.
    ///
    /// It is 0 for a sphere and for a disc with or without holes, and 1 for a torus.
    #[must_use]
    pub fn genus(&self) -> usize {
        let twice = 2 - self.euler_characteristic() - self.num_boundary_loops as i64;
        usize::try_from(twice / 2).unwrap_or(0)
    }

    /// Returns true if the component has no boundary.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.num_boundary_loops == 0
    }
}

impl HalfedgeMesh {
    /// The connected components, ordered by their lowest vertex. Pieces that share a row belong to
    /// the same component. O(n).
    ///
    /// ```
    /// use cotan_halfedge::{HalfedgeMesh, VertexId};
    /// let mesh = HalfedgeMesh::from_faces(6, &[[0, 2, 4], [1, 3, 5]])?;
    /// let components = mesh.components();
    /// assert_eq!(components.sizes(), [3, 3]);
    /// assert_eq!(components.of(VertexId::new(4)), 0);
    /// # Ok::<(), cotan_halfedge::BuildError>(())
    /// ```
    pub fn components(&self) -> Components {
        let pieces = self.pieces();
        match self.has_copies() {
            true => self.joined(&pieces),
            false => pieces,
        }
    }

    /// Joins the pieces that share a row.
    fn joined(&self, pieces: &Components) -> Components {
        let mut sets = DisjointSets::new(pieces.count());
        for (copy, row) in self.copies() {
            sets.join(pieces.of_vertex[copy], pieces.of_vertex[row]);
        }
        // Pieces are ordered by their lowest vertex, and so are the lowest pieces of the sets.
        let (number_of, count) = sets.numbered();
        let mut sizes = vec![0; count];
        for (number, size) in number_of.iter().zip(&pieces.sizes) {
            sizes[*number as usize] += size;
        }
        Components {
            of_vertex: pieces.of_vertex.map(|&piece| number_of[piece as usize]),
            sizes,
        }
    }

    /// The components of the half-edge structure alone: pieces that share rows are separate. The
    /// same as [`Self::components`] if no vertex has copies. O(n).
    pub fn pieces(&self) -> Components {
        let mut of_vertex = VertexMap::filled(self.num_vertices(), NONE);
        let mut sizes = Vec::new();
        let mut open = Vec::new();
        for seed in self.vertices() {
            if of_vertex[seed] != NONE {
                continue;
            }
            let number = sizes.len() as u32;
            let mut size = 0;
            of_vertex[seed] = number;
            open.push(seed);
            while let Some(vertex) = open.pop() {
                size += 1;
                for neighbour in self.one_ring(vertex) {
                    if of_vertex[neighbour] == NONE {
                        of_vertex[neighbour] = number;
                        open.push(neighbour);
                    }
                }
            }
            sizes.push(size);
        }
        Components { of_vertex, sizes }
    }

    /// The halfedge with the lowest index of each boundary loop, in ascending order.
    ///
    /// [`HalfedgeMesh::boundary_loop`] continues from there.
    pub fn boundary_loops(&self) -> Vec<HalfedgeId> {
        let mut seen = HalfedgeMap::filled(self.num_halfedges(), false);
        let mut loops = Vec::new();
        for h in self.halfedges() {
            if !seen[h] && self.is_boundary_halfedge(h) {
                self.boundary_loop(h).for_each(|side| seen[side] = true);
                loops.push(h);
            }
        }
        loops
    }

    /// V − E + F of the whole mesh.
    pub fn euler_characteristic(&self) -> i64 {
        self.num_vertices() as i64 - self.num_edges() as i64 + self.num_faces() as i64
    }

    /// Returns true if there is no boundary, which includes the empty mesh.
    pub fn is_closed(&self) -> bool {
        !self.halfedges().any(|h| self.is_boundary_halfedge(h))
    }

    /// The element counts of each component, in the order of [`HalfedgeMesh::components`]; those of
    /// each piece, in the order of [`HalfedgeMesh::pieces`], if vertices have copies. O(n).
    pub fn topology(&self) -> Vec<ComponentTopology> {
        let components = self.pieces();
        let mut topology = vec![ComponentTopology::default(); components.count()];
        for (part, &num_vertices) in topology.iter_mut().zip(components.sizes()) {
            part.num_vertices = num_vertices;
        }
        for edge in self.edges() {
            topology[components.of(self.target(edge.halfedge()))].num_edges += 1;
        }
        for face in self.faces() {
            topology[components.of(self.target(self.face_halfedge(face)))].num_faces += 1;
        }
        for side in self.boundary_loops() {
            topology[components.of(self.target(side))].num_boundary_loops += 1;
        }
        topology
    }

    /// Number of handles, summed over all components. O(n).
    ///
    /// [`HalfedgeMesh::topology`] reports the genus of each component.
    pub fn genus(&self) -> usize {
        self.topology().iter().map(ComponentTopology::genus).sum()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::{self, TriangleFaces};

    #[test]
    fn sphere_torus_and_double_torus() {
        let torus = TriangleFaces::torus(4, 5);
        for (faces, genus) in [
            (TriangleFaces::icosahedron(), 0),
            (torus.clone(), 1),
            (torus.connected_sum(&torus), 2),
        ] {
            let mesh = faces.mesh().unwrap();
            assert!(mesh.is_closed());
            assert_eq!(mesh.boundary_loops(), []);
            assert_eq!(mesh.genus(), genus);
            assert_eq!(mesh.euler_characteristic(), 2 - 2 * genus as i64);
        }
    }

    #[test]
    fn disc_with_holes_has_a_loop_for_each_and_one_outside() {
        let mesh = TriangleFaces::disc(7, 5, 0b1101).mesh().unwrap();
        let loops = mesh.boundary_loops();
        assert_eq!(loops.len(), 4);
        assert!(loops.is_sorted());
        assert_eq!(mesh.genus(), 0);
        assert_eq!(mesh.euler_characteristic(), 2 - 4);
        let lengths: Vec<_> = loops
            .iter()
            .map(|&h| mesh.boundary_loop(h).count())
            .collect();
        assert_eq!(lengths, [24, 4, 4, 4]);
    }

    #[test]
    fn components_are_ordered_by_their_lowest_vertex() {
        let faces = [[0, 5, 6], [1, 2, 3], [6, 5, 4u32]];
        let mesh = HalfedgeMesh::from_faces(7, &faces).unwrap();
        let components = mesh.components();
        assert_eq!(components.of_vertices().as_slice(), [0, 1, 1, 1, 0, 0, 0]);
        assert_eq!(components.sizes(), [4, 3]);
        assert_eq!(mesh.topology()[1].num_faces, 1);
    }

    proptest! {
        #[test]
        fn eulers_formula(mesh in testing::arbitrary_mesh()) {
            testing::check_euler(&mesh)?;
        }

        #[test]
        fn genus_zero_meshes_have_none(mesh in testing::genus_zero()) {
            prop_assert!(mesh.is_closed());
            prop_assert_eq!(mesh.genus(), 0);
            prop_assert_eq!(mesh.components().count(), 1);
        }
    }
}
