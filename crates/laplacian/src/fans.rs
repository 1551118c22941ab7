//! Sums over the triangles around each vertex of a surface, in a single pass.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, far_cotangents, scalar};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_parallel::Chunks;
use nalgebra::Vector3;

use crate::rings::OneRings;

/// The neighbours of each vertex in counter-clockwise order, so that two consecutive ones are the
/// other corners of a triangle. Stored vertex by vertex, with the same lengths as [`OneRings`]
/// unless vertices have copies. Neighbours are rows, and so are the sums: those of copies are
/// added.
///
/// Each triangle is visited once per corner. That is three times the arithmetic of a loop over
/// triangles, but avoids scattered sums, which cannot be parallelized and are bound by memory
/// latency.
#[derive(Clone, Debug)]
pub struct Fans {
    rings: Arc<OneRings>,
    neighbours: Vec<VertexId>,
    /// True if the fan ends at a boundary instead of closing.
    is_open: VertexMap<bool>,
    copies: Option<Copies>,
}

/// The fans of a mesh with copies of vertices.
#[derive(Clone, Debug)]
struct Copies {
    /// The first neighbour of each vertex, followed by the number of all.
    starts: Vec<u32>,
    /// Per row its first copy in `of_rows`, followed by the number of all.
    first: Vec<u32>,
    of_rows: Vec<u32>,
}

impl Copies {
    fn new(mesh: &HalfedgeMesh) -> Self {
        let mut starts = vec![0];
        let mut end = 0;
        for v in mesh.vertices() {
            end += mesh.valence(v) as u32;
            starts.push(end);
        }
        let mut pairs: Vec<(usize, u32)> = mesh
            .copies()
            .map(|(copy, row)| (row.index(), copy.index() as u32))
            .collect();
        pairs.sort_unstable();
        let mut first = vec![0; mesh.num_rows() + 1];
        pairs.iter().for_each(|(row, _)| first[row + 1] += 1);
        for i in 0..mesh.num_rows() {
            first[i + 1] += first[i];
        }
        Self {
            starts,
            first,
            of_rows: pairs.into_iter().map(|(_, copy)| copy).collect(),
        }
    }

    fn of_row(&self, i: usize) -> &[u32] {
        &self.of_rows[self.first[i] as usize..self.first[i + 1] as usize]
    }
}

/// Sums over the triangles around each vertex.
///
/// Where copies of a vertex share a row, the row has the sums over all of them. Area vectors of
/// pieces with opposite orientations then cancel.
///
/// **Shapes**: one entry per row, which is a vertex unless vertices have copies. **Units**: those
/// of the positions; areas are integrated.
#[derive(Clone, PartialEq, Debug)]
pub struct FanSums<T: Scalar> {
    /// Σ A_T over the triangles T around the vertex.
    pub areas: VertexMap<T>,
    /// Σ of their area vectors; an area vector is half the cross product of two edges.
    pub area_vectors: VertexMap<Vector3<T>>,
}

impl<T: Scalar> Default for FanSums<T> {
    /// Sums for zero vertices.
    fn default() -> Self {
        Self {
            areas: VertexMap::default(),
            area_vectors: VertexMap::default(),
        }
    }
}

impl<T: Scalar> FanSums<T> {
    /// Resizes the sums to `num_vertices` entries.
    pub fn resize(&mut self, num_vertices: usize) {
        if self.areas.len() != num_vertices {
            self.areas = VertexMap::filled(num_vertices, T::zero());
            self.area_vectors = VertexMap::filled(num_vertices, Vector3::zeros());
        }
    }
}

/// Sums over the fan of one vertex, with areas doubled.
struct Sums<T: Scalar> {
    laplacian: Vector3<T>,
    vector: Vector3<T>,
    area: T,
}

impl Fans {
    /// Builds the fans of a mesh from its one-rings.
    pub fn new(mesh: &HalfedgeMesh, rings: Arc<OneRings>) -> Self {
        let mut neighbours = Vec::with_capacity(mesh.num_halfedges());
        for v in mesh.vertices() {
            neighbours.extend(mesh.one_ring(v).map(|j| mesh.row_of(j)));
        }
        Self {
            rings,
            neighbours,
            is_open: VertexMap::from_fn(mesh.num_vertices(), |v| mesh.is_boundary_vertex(v)),
            copies: mesh.has_copies().then(|| Copies::new(mesh)),
        }
    }

    /// The fan of a vertex, which may be a copy.
    #[inline]
    fn fan(&self, v: usize) -> &[VertexId] {
        match &self.copies {
            None => &self.neighbours[self.rings.graph().range(v)],
            Some(copies) => {
                &self.neighbours[copies.starts[v] as usize..copies.starts[v + 1] as usize]
            }
        }
    }

    /// The copies of row `i`, other than the vertex with the same index.
    #[inline]
    pub fn copies_of(&self, i: usize) -> &[u32] {
        self.copies.as_ref().map_or(&[], |copies| copies.of_row(i))
    }

    /// The one-rings of the same mesh.
    pub fn rings(&self) -> &Arc<OneRings> {
        &self.rings
    }

    /// Computes the areas and area vectors around each vertex.
    ///
    /// # Panics
    /// If there are fewer positions than vertices.
    pub fn areas<T: Scalar>(&self, positions: &Positions<T>, out: &mut FanSums<T>) {
        let n = self.rings.num_rows();
        out.resize(n);
        let half = scalar::<T>(0.5);
        let outputs = (out.areas.as_mut_slice(), out.area_vectors.as_mut_slice());
        CHUNKS.update(outputs, |i, (area, vector)| {
            let sums = self.sums(positions, i, None);
            (*area, *vector) = (sums.area * half, sums.vector * half);
        });
    }

    /// Like [`Self::areas`], and also computes ℓ_i = Σ_j w_ij (v_j − v_i) with the cotangent
    /// weights of these positions. Triangles thinner than `floor` are adjusted as in
    /// [`crate::Cotangent`]. The weights are never stored.
    ///
    /// # Panics
    /// If there are fewer positions than vertices, or if `laplacian` does not have one entry per
    /// vertex.
    pub fn areas_and_cotangent_laplacian<T: Scalar>(
        &self,
        positions: &Positions<T>,
        floor: T,
        laplacian: &mut VertexMap<Vector3<T>>,
        out: &mut FanSums<T>,
    ) {
        let n = self.rings.num_rows();
        assert_eq!(laplacian.len(), n, "one Laplacian coordinate per vertex");
        out.resize(n);
        let half = scalar::<T>(0.5);
        let outputs = (
            laplacian.as_mut_slice(),
            out.areas.as_mut_slice(),
            out.area_vectors.as_mut_slice(),
        );
        CHUNKS.update(outputs, |i, (ell, area, vector)| {
            let sums = self.sums(positions, i, Some(floor));
            *ell = sums.laplacian;
            (*area, *vector) = (sums.area * half, sums.vector * half);
        });
    }

    /// Returns Σ of the area vectors of the triangles around vertex `v` of row `i`, in double
    /// precision. A vertex that is not a copy is its own row. Unlike the sums per row, this belongs
    /// to one oriented piece of the surface.
    ///
    /// # Panics
    /// If there is no such vertex, or there are fewer positions than rows.
    #[inline]
    pub fn area_vector<T: Scalar>(
        &self,
        positions: &Positions<T>,
        v: usize,
        i: usize,
    ) -> Vector3<f64> {
        let x = positions.as_slice();
        let fan = self.fan(v);
        let edge = |j: &VertexId| (x[j.index()] - x[i]).map(T::as_f64);
        let mut sum = Vector3::zeros();
        for pair in fan.windows(2) {
            sum += edge(&pair[0]).cross(&edge(&pair[1]));
        }
        if let ([first, .., last], false) = (fan, self.is_open.as_slice()[v]) {
            sum += edge(last).cross(&edge(first));
        }
        sum * 0.5
    }

    /// Sums over the fans of row `i`, without Laplacian coordinates if `floor` is `None`.
    #[inline]
    fn sums<T: Scalar>(&self, positions: &Positions<T>, i: usize, floor: Option<T>) -> Sums<T> {
        let mut sums = self.sums_of(positions, i, i, floor);
        for &copy in self.copies_of(i) {
            let more = self.sums_of(positions, copy as usize, i, floor);
            sums.laplacian += more.laplacian;
            sums.vector += more.vector;
            sums.area += more.area;
        }
        sums
    }

    /// Sums over the fan of vertex `v`, whose row is `i`.
    #[inline]
    fn sums_of<T: Scalar>(
        &self,
        positions: &Positions<T>,
        v: usize,
        i: usize,
        floor: Option<T>,
    ) -> Sums<T> {
        let x = positions.as_slice();
        let mut sums = Sums {
            laplacian: Vector3::zeros(),
            vector: Vector3::zeros(),
            area: T::zero(),
        };
        let mut fan = self.fan(v).iter();
        let edge = |j: &VertexId| x[j.index()] - x[i];
        let (Some(first), Some(last)) = (fan.clone().next(), fan.clone().next_back()) else {
            return sums;
        };
        let mut left = if self.is_open.as_slice()[v] {
            fan.next();
            edge(first)
        } else {
            edge(last)
        };
        for j in fan {
            let right = edge(j);
            let vector = left.cross(&right);
            let doubled_area = vector.norm();
            sums.vector += vector;
            sums.area += doubled_area;
            if let Some(floor) = floor {
                // Each edge is weighted by the cotangent of the opposite angle.
                let [at_left, at_right] = far_cotangents(&left, &right, doubled_area, floor);
                sums.laplacian += right * at_left + left * at_right;
            }
            left = right;
        }
        sums
    }
}

/// Vertices per task.
const CHUNKS: Chunks = Chunks::of(1024);

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use cotan_geometry::vertex_area_vectors;
    use cotan_halfedge::HalfedgeMap;
    use proptest::prelude::*;

    use super::*;
    use crate::{Cotangent, LaplacianScheme, apply_weights};

    proptest! {
        #[test]
        fn one_pass_measures_what_loops_over_triangles_measure(shape in surfaces()) {
            let surface = shape.surface();
            let (mesh, n) = (shape.connectivity(), shape.positions().len());
            let rings = Arc::new(OneRings::new(mesh));
            let fans = Fans::new(mesh, rings.clone());
            let scheme = Cotangent::default();
            let zeros = || VertexMap::filled(n, Vector3::zeros());
            let (mut laplacian, mut sums) = (zeros(), FanSums::default());
            fans.areas_and_cotangent_laplacian(
                shape.positions(), scheme.area_floor, &mut laplacian, &mut sums,
            );
            let mut alone = FanSums::default();
            fans.areas(shape.positions(), &mut alone);
            prop_assert_eq!(&alone, &sums);
            let mut weights = HalfedgeMap::filled(mesh.num_halfedges(), 0.0);
            scheme.weights(&surface, &mut weights)?;
            let mut expected = zeros();
            apply_weights(&rings, &scheme, &weights, shape.positions(), &mut expected)?;
            let by_face = surface.one_ring_areas();
            let vectors_by_face = vertex_area_vectors(&surface);
            let largest = weights.values().fold(1.0f64, |m, w| m.max(w.abs()));
            for (v, area) in sums.areas.iter() {
                let size = area.sqrt();
                prop_assert!((area - by_face[v]).abs() <= 1e-12 * area);
                let miss = (sums.area_vectors[v] - vectors_by_face[v]).norm();
                prop_assert!(miss <= 1e-12 * area);
                prop_assert!((laplacian[v] - expected[v]).norm() <= 1e-10 * largest * (1.0 + size));
            }
        }
    }
}
