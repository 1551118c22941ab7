//! Shortest paths along edges.
//!
//! **Source**: Dijkstra 1959, A note on two problems in connexion with graphs.

use std::collections::BinaryHeap;

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeId, VertexId, VertexMap};

use crate::reached::Reached;

/// The shortest paths along edges from some sources to all vertices.
#[derive(Clone, PartialEq, Debug)]
pub struct EdgePaths {
    distances: VertexMap<f64>,
    /// The halfedge that arrives at each vertex, with its origin.
    arriving: VertexMap<Option<(HalfedgeId, VertexId)>>,
}

impl EdgePaths {
    /// Finds the paths. Sources that are no vertices of the mesh are ignored.
    ///
    /// Takes O(n log n). Of several paths of exactly the same length, the one found first, which
    /// depends on the numbering.
    #[must_use]
    pub fn from<'m, T: Scalar>(surface: impl Into<Surface<'m, T>>, sources: &[VertexId]) -> Self {
        let surface = surface.into();
        let mesh = surface.mesh();
        let mut paths = Self {
            distances: VertexMap::filled(mesh.num_vertices(), f64::INFINITY),
            arriving: VertexMap::filled(mesh.num_vertices(), None),
        };
        let mut heap = BinaryHeap::new();
        for &vertex in sources {
            if let Some(distance) = paths.distances.get_mut(vertex) {
                *distance = 0.0;
                heap.push(Reached::at(vertex, 0.0));
            }
        }
        while let Some(Reached { distance, vertex }) = heap.pop() {
            if distance > paths.distances[vertex] {
                continue;
            }
            for h in mesh.outgoing_halfedges(vertex) {
                let target = mesh.target(h);
                let along = distance + surface.halfedge_vector(h).map(T::as_f64).norm();
                if along < paths.distances[target] {
                    paths.distances[target] = along;
                    paths.arriving[target] = Some((h, vertex));
                    heap.push(Reached::at(target, along));
                }
            }
        }
        paths
    }

    /// The length of the shortest path to each vertex; infinite where no path leads.
    ///
    /// **Units**: length. Never less than the distance along the surface.
    pub fn distances(&self) -> &VertexMap<f64> {
        &self.distances
    }

    /// The halfedges of the path to a vertex, from the source. Empty for a source and for a vertex
    /// that no path reaches.
    #[must_use]
    pub fn path_to(&self, vertex: VertexId) -> Vec<HalfedgeId> {
        let mut path = Vec::new();
        let mut at = vertex;
        while let Some(&Some((h, from))) = self.arriving.get(at) {
            path.push(h);
            at = from;
        }
        path.reverse();
        path
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::bumpy_plane;
    use cotan_geometry::testing::surfaces;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn on_a_grid_paths_follow_its_lines() {
        let shape = bumpy_plane::<f64>([4.0, 4.0], [4, 4], 0.0);
        let paths = EdgePaths::from(&shape, &[VertexId::new(0)]);
        let far = paths.distances().values().fold(0.0_f64, |m, d| m.max(*d));
        // Four diagonals, or eight sides where the diagonals run the other way.
        assert!((far - 8.0).abs() < 1e-12 || (far - 4.0 * 2.0_f64.sqrt()).abs() < 1e-12);
    }

    proptest! {
        #[test]
        fn a_path_has_the_length_of_its_edges_and_no_edge_shortens_it(
            shape in surfaces(), source in any::<prop::sample::Index>(),
        ) {
            let source = VertexId::new(source.index(shape.num_vertices()));
            let paths = EdgePaths::from(&shape, &[source]);
            let surface = shape.surface();
            let mesh = shape.connectivity();
            for v in mesh.vertices() {
                let path = paths.path_to(v);
                let length: f64 = path.iter().map(|h| surface.halfedge_vector(*h).norm()).sum();
                prop_assert!((length - paths.distances()[v]).abs() < 1e-12 * (1.0 + length));
                let mut at = source;
                for h in path {
                    prop_assert_eq!(mesh.origin(h), at);
                    at = mesh.target(h);
                }
                prop_assert_eq!(at, v);
            }
            for h in mesh.halfedges() {
                let through = paths.distances()[mesh.origin(h)] + surface.halfedge_vector(h).norm();
                prop_assert!(paths.distances()[mesh.target(h)] <= through);
            }
        }
    }
}
