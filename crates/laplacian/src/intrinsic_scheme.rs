//! The cotangent weights of the intrinsic Delaunay triangulation.

use std::sync::Arc;

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::fans::{FanSums, Fans};
use crate::graph::{Graph, RowId};
use crate::intrinsic::{IntrinsicTriangulation, MOLLIFICATION};
use crate::operator::Operator;
use crate::reweighted::not_finite;
use crate::rings::OneRings;
use crate::scheme::{LaplacianScheme, SchemeError, Symmetry};

/// w_ij = cot α_ij + cot β_ij on the intrinsic Delaunay triangulation of the surface.
///
/// The weights are never negative, so the operator has the maximum principle whatever the shape of
/// the triangles. Its graph has the edges of the intrinsic triangulation and not those of the mesh:
/// use [`Operator::assemble`], which asks [`LaplacianScheme::operator`], and find the triangles in
/// [`Operator::triangles`]. Edges from a vertex to itself have no effect, and several edges between
/// two vertices are one entry.
///
/// Not defined for a mesh that was cut into pieces.
///
/// **Source**: Bobenko and Springborn 2007, A discrete Laplace-Beltrami operator for simplicial
/// surfaces. See [`IntrinsicTriangulation`] for the boundary, which differs.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct IntrinsicDelaunay {
    /// The smallest amount by which two sides of a triangle exceed the third, relative to the mean
    /// edge length; see [`IntrinsicTriangulation::new`].
    pub mollification: f64,
}

impl Default for IntrinsicDelaunay {
    fn default() -> Self {
        Self {
            mollification: MOLLIFICATION,
        }
    }
}

impl IntrinsicDelaunay {
    /// The Delaunay triangulation of a surface.
    pub fn triangulate<T: Scalar>(&self, surface: &Surface<'_, T>) -> IntrinsicTriangulation {
        let mut triangulation = IntrinsicTriangulation::new(surface, self.mollification);
        triangulation.flip_to_delaunay();
        triangulation
    }
}

impl IntrinsicTriangulation {
    /// The operator with the cotangent weights of these triangles, one row per vertex.
    ///
    /// Weights below 0 by rounding are 0.
    ///
    /// # Errors
    /// [`SchemeError::NonFiniteWeight`], for lengths that are not finite.
    pub fn operator<T: Scalar>(&self) -> Result<Operator<T>, SchemeError> {
        let rows = self.rows();
        let mut offsets = Vec::with_capacity(rows.len() + 1);
        offsets.push(0);
        let (mut neighbours, mut weights) = (Vec::new(), Vec::new());
        for row in rows {
            for (j, weight) in row {
                neighbours.push(RowId::new(j as usize));
                weights.push(weight);
            }
            offsets.push(neighbours.len() as u32);
        }
        let graph = Arc::new(Graph::from_rows(offsets, neighbours));
        // Both directions of an edge are sums of the same numbers, in different orders.
        let symmetric = |k: usize| {
            let back = graph.reverse()[k] as usize;
            weights[k.min(back)].max(0.0)
        };
        let weights = (0..weights.len()).map(symmetric).collect();
        let operator = Operator::new(graph.clone(), weights, Symmetry::Symmetric);
        operator.map_err(|k| not_finite(NAME, &graph, k))
    }

    /// The neighbours of each vertex in ascending order, with their weights.
    fn rows(&self) -> Vec<Vec<(u32, f64)>> {
        let mut rows: Vec<Vec<(u32, f64)>> = vec![Vec::with_capacity(12); self.num_vertices()];
        for t in 0..self.num_triangles() {
            let (triangle, share) = (self.triangle(t), self.share(t));
            let cotangents = triangle.opposite_cotangents();
            for k in 0..3 {
                let [i, j] = [k, (k + 1) % 3].map(|k| triangle.vertices[k].index());
                if i != j {
                    rows[i].push((j as u32, share * cotangents[k]));
                    rows[j].push((i as u32, share * cotangents[k]));
                }
            }
        }
        parallel::update(rows.as_mut_slice(), |_, row| {
            // Stable: the sum is taken in the order of the triangles.
            row.sort_by_key(|(j, _)| *j);
            row.dedup_by(|next, sum| {
                let is_same = next.0 == sum.0;
                if is_same {
                    sum.1 += next.1;
                }
                is_same
            });
        });
        rows
    }
}

impl<T: Scalar> LaplacianScheme<T> for IntrinsicDelaunay {
    /// The weights of those edges of the mesh that are edges of the triangulation too; 0 for the
    /// others. The rest of the operator is not on the mesh's edges.
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        let triangulation = self.triangulate(surface);
        out.as_mut_slice().fill(T::zero());
        for t in 0..triangulation.num_triangles() {
            let cotangents = triangulation.triangle(t).opposite_cotangents();
            let share = triangulation.share(t);
            for (h, cotangent) in triangulation.halfedges(t).into_iter().zip(cotangents) {
                if let Some(h) = h {
                    let weight = T::of_f64(share * cotangent);
                    out[h] += weight;
                    out[h.twin()] += weight;
                }
            }
        }
        out.values_mut().for_each(|w| *w = w.max(T::zero()));
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn operator(
        &self,
        _rings: &OneRings,
        surface: &Surface<'_, T>,
    ) -> Result<Operator<T>, SchemeError> {
        if surface.mesh().has_copies() {
            return Err(SchemeError::Copies {
                scheme: NAME.into(),
            });
        }
        let triangles = self.triangulate(surface);
        Ok(triangles
            .operator()?
            .with_triangles(Some(Arc::new(triangles))))
    }

    fn measure(
        &self,
        surface: &Surface<'_, T>,
        fans: &Fans,
        _weights: &mut HalfedgeMap<T>,
        laplacian: &mut VertexMap<Vector3<T>>,
        sums: &mut FanSums<T>,
    ) -> Result<(), SchemeError> {
        let operator: Operator<T> = self.triangulate(surface).operator()?;
        operator.apply(surface.positions(), laplacian);
        fans.areas(surface.positions(), sums);
        Ok(())
    }

    fn name(&self) -> &str {
        NAME
    }
}

const NAME: &str = "intrinsic Delaunay";

#[cfg(test)]
mod tests {
    use cotan_geometry::Mesh;
    use cotan_geometry::shapes::{bumpy_plane, icosphere};
    use cotan_geometry::testing::{rigid_motions, surfaces};
    use cotan_halfedge::{HalfedgeMesh, VertexId};
    use nalgebra::{DMatrix, Point3};
    use proptest::prelude::*;

    use super::*;
    use crate::Cotangent;

    proptest! {
        #[test]
        fn weights_are_never_negative(shape in surfaces(), thin in 0.01..1.0_f64) {
            let squeezed = shape.positions().map(|p| Point3::new(p.x, p.y, p.z * thin));
            let surface = shape.surface();
            let surface = surface.with_positions(&squeezed);
            let operator = Operator::<f64>::assemble(&IntrinsicDelaunay::default(), &surface)?;
            prop_assert!(operator.weights().iter().all(|w| *w >= 0.0));
            for k in 0..operator.weights().len() {
                let back = operator.graph().reverse()[k] as usize;
                prop_assert_eq!(operator.weights()[k], operator.weights()[back]);
            }
        }
    }

    /// −L as a dense matrix: which of several Delaunay triangulations was found does not show.
    fn matrix(shape: &Mesh<f64>) -> DMatrix<f64> {
        let operator = Operator::assemble(&IntrinsicDelaunay::default(), &shape.surface());
        (&operator.unwrap().matrix()).into()
    }

    fn thin(shape: &Mesh<f64>, factor: f64) -> Mesh<f64> {
        let squeezed = shape
            .positions()
            .map(|p| Point3::new(p.x, p.y, p.z * factor));
        Mesh::new(shape.connectivity().clone(), squeezed).unwrap()
    }

    proptest! {
        #[test]
        fn rigid_motions_and_scale_leave_the_weights(
            shape in surfaces(), factor in 0.1..1.0_f64, motion in rigid_motions(),
            scale in 0.1..10.0_f64,
        ) {
            let shape = thin(&shape, factor);
            let moved = shape.positions().map(|p| Point3::from((motion * p).coords * scale));
            let moved = Mesh::new(shape.connectivity().clone(), moved).unwrap();
            prop_assert!((matrix(&shape) - matrix(&moved)).amax() < 1e-4);
        }

        #[test]
        fn renumbering_commutes_with_the_weights(
            shape in surfaces(), factor in 0.1..1.0_f64, by in 1..1000_usize,
        ) {
            let shape = thin(&shape, factor);
            let (mesh, n) = (shape.connectivity(), shape.positions().len());
            let number = |i: usize| (i + by) % n;
            let mut positions = shape.positions().clone();
            for (v, p) in shape.positions().iter() {
                positions[VertexId::new(number(v.index()))] = *p;
            }
            let mut faces: Vec<[u32; 3]> = mesh
                .faces()
                .map(|f| mesh.triangle(f).map(|v| number(v.index()) as u32))
                .collect();
            faces.rotate_left(by % mesh.num_faces());
            let other = Mesh::new(HalfedgeMesh::from_faces(n, &faces).unwrap(), positions).unwrap();
            let (a, b) = (matrix(&shape), matrix(&other));
            for i in 0..n {
                for j in 0..n {
                    let off = (a[(i, j)] - b[(number(i), number(j))]).abs();
                    prop_assert!(off < 1e-4, "{i} {j} {off:e}");
                }
            }
        }
    }

    #[test]
    fn a_delaunay_mesh_has_its_cotangent_weights() {
        let shape = icosphere::<f64>(3);
        let surface = shape.surface();
        let own = Operator::assemble(&IntrinsicDelaunay::default(), &surface).unwrap();
        let cotangent = Operator::assemble(&Cotangent::default(), &surface).unwrap();
        assert_eq!(own.graph(), cotangent.graph());
        for (a, b) in own.weights().iter().zip(cotangent.weights()) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    #[test]
    fn linear_functions_of_a_sheared_plane_are_harmonic_away_from_the_border() {
        let shape = bumpy_plane::<f64>([2.0, 2.0], [12, 12], 0.0);
        let sheared = shape
            .positions()
            .map(|p| Point3::new(p.x + 3.0 * p.y, p.y, 0.0));
        let surface = shape.surface();
        let surface = surface.with_positions(&sheared);
        let own = Operator::assemble(&IntrinsicDelaunay::default(), &surface).unwrap();
        let cotangent = Operator::assemble(&Cotangent::default(), &surface).unwrap();
        assert!(cotangent.weights().iter().any(|w| *w < -0.1));
        // Near the border the mirrored copy takes part.
        let center = shape.surface().bounding_box().center();
        let is_inner = |p: &Point3<f64>| (p - center).amax() < 0.5;
        let mut inner = 0;
        for (v, _) in shape.positions().iter().filter(|(_, p)| is_inner(p)) {
            inner += 1;
            let ell = own.apply_at(&sheared, v.index()).norm();
            assert!(ell < 1e-12, "{v}: {ell}");
        }
        assert!(inner > 10);
    }
}
