//! What is summed over the triangles around every vertex of the current mesh, in one pass.

use cotan_geometry::{Positions, Scalar, far_cotangents, scalar, unit_or_zero};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::OneRings;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::state::Quantities;
use crate::vectors::CHUNK;

/// The neighbours of every vertex counter-clockwise, so that two that follow each other are the
/// other corners of a triangle; row after row, as long as the rows of [`OneRings`].
///
/// Every triangle is met at each of its corners: three times the arithmetic of a loop over triangles,
/// but no scattered sums, which cannot be shared out to threads and wait for memory.
#[derive(Debug)]
pub(crate) struct Fans {
    neighbours: Vec<VertexId>,
    /// Whether the fan ends at a boundary instead of closing.
    is_open: VertexMap<bool>,
}

/// Sums over the fan of one vertex.
struct Sums<T: Scalar> {
    laplacian: Vector3<T>,
    /// Twice the area vectors and areas.
    vector: Vector3<T>,
    area: T,
}

/// Where the quantities go; only those that are wanted are written.
pub(crate) struct Output<'a, T: Scalar> {
    pub(crate) laplacian: &'a mut VertexMap<Vector3<T>>,
    pub(crate) normals: &'a mut VertexMap<Vector3<T>>,
    pub(crate) areas: &'a mut VertexMap<T>,
    pub(crate) area_vectors: &'a mut VertexMap<Vector3<T>>,
}

impl Fans {
    /// Gathers the fans of a mesh with the given one-rings.
    pub(crate) fn new(mesh: &HalfedgeMesh, rings: &OneRings) -> Self {
        let mut neighbours = Vec::with_capacity(rings.neighbours().len());
        for v in mesh.vertices() {
            neighbours.extend(mesh.one_ring(v));
        }
        Self {
            neighbours,
            is_open: VertexMap::from_fn(mesh.num_vertices(), |v| mesh.is_boundary_vertex(v)),
        }
    }

    /// Measures what is wanted; the Laplacian coordinates with cotangent weights of this floor.
    ///
    /// # Panics
    /// If a map has not one entry a vertex.
    pub(crate) fn measure<T: Scalar>(
        &self,
        rings: &OneRings,
        positions: &Positions<T>,
        wanted: Quantities,
        floor: T,
        out: Output<'_, T>,
    ) {
        let Output {
            laplacian,
            normals,
            areas,
            area_vectors,
        } = out;
        let n = rings.num_vertices();
        let lengths = [
            laplacian.len(),
            normals.len(),
            areas.len(),
            area_vectors.len(),
        ];
        assert!(lengths == [n; 4], "one entry a vertex");
        let half = scalar::<T>(0.5);
        laplacian
            .as_mut_slice()
            .par_chunks_mut(CHUNK)
            .zip(normals.as_mut_slice().par_chunks_mut(CHUNK))
            .zip(areas.as_mut_slice().par_chunks_mut(CHUNK))
            .zip(area_vectors.as_mut_slice().par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, (((laplacian, normals), areas), area_vectors))| {
                for k in 0..laplacian.len() {
                    let i = chunk * CHUNK + k;
                    let sums = if wanted.laplacian {
                        self.sums(rings, positions, i, Some(floor))
                    } else {
                        self.sums(rings, positions, i, None)
                    };
                    if wanted.laplacian {
                        laplacian[k] = sums.laplacian;
                    }
                    if wanted.normals {
                        normals[k] = unit_or_zero(&sums.vector);
                    }
                    if wanted.areas {
                        areas[k] = sums.area * half;
                    }
                    if wanted.area_vectors {
                        area_vectors[k] = sums.vector * half;
                    }
                }
            });
    }

    /// Sums over the fan of vertex `i`; without Laplacian coordinates if there is no floor.
    #[inline]
    fn sums<T: Scalar>(
        &self,
        rings: &OneRings,
        positions: &Positions<T>,
        i: usize,
        floor: Option<T>,
    ) -> Sums<T> {
        let x = positions.as_slice();
        let mut sums = Sums {
            laplacian: Vector3::zeros(),
            vector: Vector3::zeros(),
            area: T::zero(),
        };
        let mut fan = self.neighbours[rings.range(i)].iter();
        let edge = |j: &VertexId| x[j.index()] - x[i];
        let (Some(first), Some(last)) = (fan.clone().next(), fan.clone().next_back()) else {
            return sums;
        };
        let mut left = if self.is_open.as_slice()[i] {
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
                // Each edge is weighted by the cotangent of the angle that it does not touch.
                let [at_left, at_right] = far_cotangents(&left, &right, doubled_area, floor);
                sums.laplacian += right * at_left + left * at_right;
            }
            left = right;
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::icosphere;
    use cotan_geometry::testing::surfaces;
    use cotan_geometry::{one_ring_areas, vertex_area_vectors, vertex_normals};
    use cotan_laplacian::{Cotangent, LaplacianScheme, apply_weights};
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn one_pass_measures_what_loops_over_triangles_measure(shape in surfaces()) {
            let surface = shape.surface();
            let (mesh, n) = (shape.connectivity(), shape.positions().len());
            let rings = OneRings::new(mesh);
            let zeros = || VertexMap::filled(n, Vector3::zeros());
            let (mut laplacian, mut normals, mut area_vectors) = (zeros(), zeros(), zeros());
            let mut areas = VertexMap::filled(n, 0.0);
            let scheme = Cotangent::default();
            Fans::new(mesh, &rings).measure(
                &rings,
                shape.positions(),
                Quantities::ALL,
                scheme.area_floor,
                Output {
                    laplacian: &mut laplacian,
                    normals: &mut normals,
                    areas: &mut areas,
                    area_vectors: &mut area_vectors,
                },
            );
            let mut weights = cotan_halfedge::HalfedgeMap::filled(mesh.num_halfedges(), 0.0);
            scheme.weights(&surface, &mut weights)?;
            let mut expected = zeros();
            apply_weights(&rings, &weights, shape.positions(), &mut expected);
            let (by_face, normals_by_face) = (one_ring_areas(&surface), vertex_normals(&surface));
            let vectors_by_face = vertex_area_vectors(&surface);
            let largest = weights.values().fold(1.0f64, |m, w| m.max(w.abs()));
            for (v, area) in areas.iter() {
                let size = area.sqrt();
                prop_assert!((area - by_face[v]).abs() <= 1e-12 * area);
                prop_assert!((area_vectors[v] - vectors_by_face[v]).norm() <= 1e-12 * area);
                let sure = (vectors_by_face[v].norm() / area).max(1e-300);
                prop_assert!((normals[v] - normals_by_face[v]).norm() <= 1e-12 / sure);
                prop_assert!((laplacian[v] - expected[v]).norm() <= 1e-10 * largest * (1.0 + size));
            }
        }
    }

    #[test]
    fn what_is_not_wanted_is_left_alone() {
        let shape = icosphere::<f64>(1);
        let n = shape.positions().len();
        let rings = OneRings::new(shape.connectivity());
        let marked = VertexMap::filled(n, Vector3::repeat(7.0));
        let (mut laplacian, mut normals, mut vectors) =
            (marked.clone(), marked.clone(), marked.clone());
        let mut areas = VertexMap::filled(n, 7.0);
        let wanted = Quantities {
            areas: true,
            ..Quantities::NONE
        };
        Fans::new(shape.connectivity(), &rings).measure(
            &rings,
            shape.positions(),
            wanted,
            0.0,
            Output {
                laplacian: &mut laplacian,
                normals: &mut normals,
                areas: &mut areas,
                area_vectors: &mut vectors,
            },
        );
        assert!(
            [&laplacian, &normals, &vectors]
                .iter()
                .all(|m| **m == marked)
        );
        assert!(areas.values().all(|a| *a < 7.0));
    }
}
