//! The assembled operator.

use std::marker::PhantomData;
use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, Surface, scalar};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use cotan_parallel::{self as parallel, Chunks};
use nalgebra::Vector3;
use nalgebra_sparse::CsrMatrix;

use crate::exact::{exact_units, round_to, round_to_exact_sums};
use crate::graph::Graph;
use crate::intrinsic::IntrinsicTriangulation;
use crate::rings::OneRings;
use crate::scheme::{Copies, LaplacianScheme, SchemeError, Symmetry};

/// Weights on a graph, ready to be applied and factorized. They come from a scheme on a surface,
/// with one row per vertex, or from any other source.
///
/// The weights are rounded (by at most a few units in the last place of the largest weight
/// nearby) so that every sum of weights in a row is *exact*. The rows of [`Operator::matrix`]
/// then sum to exactly zero in any order of summation, and constants lie in its null space
/// without error.
#[derive(Clone, Debug)]
pub struct Operator<T: Scalar> {
    graph: Arc<Graph>,
    /// Stored row by row, in double precision for any T: next to the huge weight of a single
    /// needle, the weights of its neighbours would otherwise lose their digits.
    weights: Vec<f64>,
    symmetry: Symmetry,
    triangles: Option<Arc<IntrinsicTriangulation>>,
    number: PhantomData<fn(T) -> T>,
}

impl<T: Scalar> Operator<T> {
    /// Asks `scheme` for the weights of `surface`, then checks and rounds them. The graph is that
    /// of the scheme: the one-rings of the mesh for all built-in schemes but
    /// [`IntrinsicDelaunay`](crate::IntrinsicDelaunay).
    ///
    /// # Errors
    /// The errors of the scheme, and [`SchemeError::NonFiniteWeight`], which names the edge.
    pub fn assemble<S: LaplacianScheme<T> + ?Sized>(
        scheme: &S,
        surface: &Surface<'_, T>,
    ) -> Result<Self, SchemeError> {
        scheme.operator(&OneRings::new(surface.mesh()), surface)
    }

    /// The operator on the one-rings of the mesh, with the weights of its halfedges.
    ///
    /// # Errors
    /// Same as [`Self::assemble`].
    pub fn assemble_on<S: LaplacianScheme<T> + ?Sized>(
        rings: &OneRings,
        scheme: &S,
        surface: &Surface<'_, T>,
    ) -> Result<Self, SchemeError> {
        let mesh = surface.mesh();
        let mut chosen = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
        scheme.weights(surface, &mut chosen)?;
        if scheme.symmetry() == Symmetry::Symmetric {
            check_symmetry(scheme, surface, &chosen)?;
        }
        let weights = weights_of_rows(rings, scheme, &chosen)?;
        Self::new(rings.graph().clone(), weights, scheme.symmetry()).map_err(|k| {
            let h = rings.halfedges_of(k)[0];
            SchemeError::NonFiniteWeight {
                scheme: scheme.name().into(),
                vertices: [mesh.origin(h), mesh.target(h)],
            }
        })
    }

    /// Creates the operator with these weights, stored row by row, on any graph.
    ///
    /// # Errors
    /// The index of a weight that is not finite, or whose row has no finite sum.
    ///
    /// # Panics
    /// If the number of weights differs from the number of entries of the graph.
    pub fn new(
        graph: Arc<Graph>,
        mut weights: Vec<f64>,
        symmetry: Symmetry,
    ) -> Result<Self, usize> {
        assert_eq!(weights.len(), graph.num_entries(), "one weight per entry");
        // A weight whose row sum overflows becomes non-finite as well.
        round_to_exact_sums(&graph, &mut weights);
        match weights.iter().position(|w| !w.is_finite()) {
            Some(place) => Err(place),
            None => Ok(Self {
                graph,
                weights,
                symmetry,
                triangles: None,
                number: PhantomData,
            }),
        }
    }

    /// The same operator with the triangles whose sides are its graph.
    pub(crate) fn with_triangles(mut self, triangles: Option<Arc<IntrinsicTriangulation>>) -> Self {
        self.triangles = triangles;
        self
    }

    /// The weights w_ij row by row, in the order of [`Graph::neighbours`].
    #[inline]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The sparsity pattern.
    #[inline]
    pub fn graph(&self) -> &Arc<Graph> {
        &self.graph
    }

    /// The triangles whose sides are the pairs of the graph, if these are not the edges of a mesh;
    /// `None` on the one-rings of a mesh.
    pub fn triangles(&self) -> Option<&Arc<IntrinsicTriangulation>> {
        self.triangles.as_ref()
    }

    /// The symmetry of the weights.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// Number of unknowns, which is the number of rows and of columns.
    pub fn num_rows(&self) -> usize {
        self.graph.num_rows()
    }

    /// Mean over the rows of |Σ_j w_ij|. This is the scale of the diagonal, to which the weights
    /// of soft handles are relative.
    pub fn mean_diagonal(&self) -> f64 {
        let n = self.num_rows();
        let row_sum = |i| self.weights[self.graph.range(i)].iter().sum::<f64>();
        let sums = (0..n).map(|i| row_sum(i).abs());
        sums.sum::<f64>() / n.max(1) as f64
    }

    /// Computes ℓ_i = Σ_j w_ij (v_j − v_i) for each row. The result is exactly zero where all v
    /// are equal.
    ///
    /// # Panics
    /// If `positions` or `out` does not have one entry per vertex.
    pub fn apply(&self, positions: &Positions<T>, out: &mut VertexMap<Vector3<T>>) {
        assert_eq!(positions.len(), self.num_rows(), "one position a vertex");
        assert_eq!(
            out.len(),
            self.num_rows(),
            "one Laplacian coordinate a vertex"
        );
        parallel::fill(out.as_mut_slice(), |i| {
            self.apply_at(positions, i).map(T::of_f64)
        });
    }

    /// Computes ℓ of row `i`, in double precision.
    ///
    /// # Panics
    /// If there is no such vertex, or if there are fewer positions than vertices.
    #[inline]
    pub fn apply_at(&self, positions: &Positions<T>, i: usize) -> Vector3<f64> {
        let x = positions.as_slice();
        let mut sum = Vector3::zeros();
        let row = self.graph.range(i);
        for (j, w) in self.graph.neighbours()[row.clone()]
            .iter()
            .zip(&self.weights[row])
        {
            sum += (x[j.index()] - x[i]).map(T::as_f64) * *w;
        }
        sum
    }

    /// Computes ℓ_i = Σ_j w_ij (u_j − u_i) for one number per vertex.
    ///
    /// # Panics
    /// If there is not one value per row.
    #[must_use]
    pub fn apply_to_values(&self, values: &VertexMap<T>) -> VertexMap<T> {
        assert_eq!(values.len(), self.num_rows(), "one value per vertex");
        let u = values.as_slice();
        let mut out = VertexMap::filled(values.len(), T::zero());
        parallel::fill(out.as_mut_slice(), |i| {
            let row = self.graph.row(i);
            let terms = row.map(|(j, k)| self.weights[k] * (u[j.index()] - u[i]).as_f64());
            T::of_f64(terms.sum())
        });
        out
    }

    /// The usual stiffness matrix with ½ cot: half of [`Self::matrix`]. With the cotangent weights
    /// its entries are ∫ ∇φ_i · ∇φ_j.
    ///
    /// **Shape**: n × n, indexed by vertex, columns ascending.
    pub fn stiffness_matrix(&self) -> CsrMatrix<T> {
        let mut matrix = self.matrix();
        let half = scalar::<T>(0.5);
        matrix.values_mut().iter_mut().for_each(|k| *k *= half);
        matrix
    }

    /// Returns the operator as a sparse matrix: **−L**, with Σ_j w_ij on the diagonal and −w_ij
    /// off the diagonal, so that it is positive semi-definite for the cotangent scheme.
    ///
    /// **Shape**: n × n, indexed by vertex, columns ascending. Each row sums to exactly zero.
    ///
    /// # Panics
    /// Never: the pattern is sorted and within bounds by construction.
    pub fn matrix(&self) -> CsrMatrix<T> {
        /// Rows per task.
        const CHUNKS: Chunks = Chunks::of(2048);
        let n = self.num_rows();
        // Rounded again if T is coarser than f64; unchanged otherwise.
        let weights: Vec<T> = self.weights.iter().map(|w| T::of_f64(*w)).collect();
        let units = exact_units(&self.graph, &weights);
        let blocks = CHUNKS.map(0..n, |_, rows| {
            let (mut columns, mut values) = (Vec::new(), Vec::new());
            for i in rows {
                self.push_row(i, &weights, &units, &mut columns, &mut values);
            }
            (columns, values)
        });
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        // Each row has a diagonal entry in addition to its ring.
        offsets.extend((0..n).map(|i| self.graph.range(i).end + i + 1));
        let mut columns = Vec::with_capacity(weights.len() + n);
        let mut values = Vec::with_capacity(weights.len() + n);
        for (block_columns, block_values) in blocks {
            columns.extend(block_columns);
            values.extend(block_values);
        }
        CsrMatrix::try_from_csr_data(n, n, offsets, columns, values)
            .expect("sorted rows within bounds")
    }

    /// Appends row `i` of the matrix, with the diagonal in its sorted position.
    fn push_row(
        &self,
        i: usize,
        weights: &[T],
        units: &[T],
        columns: &mut Vec<usize>,
        values: &mut Vec<T>,
    ) {
        let start = columns.len();
        let place = self.graph.row(i).filter(|(j, _)| j.index() < i).count();
        let mut sum = T::zero();
        for (k, (j, at)) in self.graph.row(i).enumerate() {
            if k == place {
                columns.push(i);
                values.push(T::zero());
            }
            let weight = round_to(weights[at], units[i].max(units[j.index()]));
            sum += weight;
            columns.push(j.index());
            values.push(-weight);
        }
        if columns.len() == start + place {
            columns.push(i);
            values.push(T::zero());
        }
        values[start + place] = sum;
    }
}

/// The weights of the entries, row by row.
fn weights_of_rows<T: Scalar, S: LaplacianScheme<T> + ?Sized>(
    rings: &OneRings,
    scheme: &S,
    chosen: &HalfedgeMap<T>,
) -> Result<Vec<f64>, SchemeError> {
    if !rings.is_shared() {
        let weights = rings.halfedges().iter();
        return Ok(weights.map(|&h| chosen[h].as_f64()).collect());
    }
    let copies = scheme.copies();
    if copies == Copies::Refused {
        return Err(SchemeError::Copies {
            scheme: scheme.name().into(),
        });
    }
    let weight = |k: usize| {
        let halfedges = rings.halfedges_of(k);
        let sum: f64 = halfedges.iter().map(|&h| chosen[h].as_f64()).sum();
        match copies {
            Copies::Mean => sum / halfedges.len() as f64,
            Copies::Sum | Copies::Refused => sum,
        }
    };
    Ok((0..rings.graph().num_entries()).map(weight).collect())
}

/// Checks that a scheme that claims to be symmetric is symmetric up to rounding.
fn check_symmetry<T: Scalar, S: LaplacianScheme<T> + ?Sized>(
    scheme: &S,
    surface: &Surface<'_, T>,
    weights: &HalfedgeMap<T>,
) -> Result<(), SchemeError> {
    let mesh = surface.mesh();
    let tolerance = T::default_epsilon() * scalar(1e3);
    let differs = |a: T, b: T| (a - b).abs() > tolerance * a.abs().max(b.abs());
    match mesh
        .edges()
        .map(|e| e.halfedges())
        .find(|[h, twin]| differs(weights[*h], weights[*twin]))
    {
        None => Ok(()),
        Some([h, _]) => Err(SchemeError::Unsuitable {
            scheme: scheme.name().into(),
            reason: format!(
                "it says that it is symmetric, but weighs the edge between vertices {} and {} \
                 differently from either end; let it answer Symmetry::General",
                mesh.origin(h),
                mesh.target(h)
            ),
        }),
    }
}

/// Computes ℓ_i = Σ_j w_ij (v_j − v_i) in parallel with the weights of a scheme, which need not
/// belong to an operator.
///
/// # Errors
/// [`SchemeError::Copies`] for a scheme that cannot weight copies of vertices, if there are any.
///
/// # Panics
/// If there are fewer positions than rows, or `out` does not have one entry per row.
pub fn apply_weights<T: Scalar, S: LaplacianScheme<T> + ?Sized>(
    rings: &OneRings,
    scheme: &S,
    weights: &HalfedgeMap<T>,
    positions: &Positions<T>,
    out: &mut VertexMap<Vector3<T>>,
) -> Result<(), SchemeError> {
    assert!(positions.len() >= rings.num_rows(), "one position a row");
    assert_eq!(
        out.len(),
        rings.num_rows(),
        "one Laplacian coordinate a row"
    );
    assert_eq!(
        weights.len(),
        rings.halfedges().len(),
        "one weight a halfedge"
    );
    let positions = positions.as_slice();
    if rings.is_shared() {
        let weights = weights_of_rows(rings, scheme, weights)?;
        parallel::fill(out.as_mut_slice(), |i| {
            let mut sum = Vector3::zeros();
            for (j, k) in rings.ring(i) {
                sum += (positions[j.index()] - positions[i]) * T::of_f64(weights[k]);
            }
            sum
        });
        return Ok(());
    }
    let halfedges = rings.halfedges();
    parallel::fill(out.as_mut_slice(), |i| {
        let mut sum = Vector3::zeros();
        for (j, k) in rings.ring(i) {
            sum += (positions[j.index()] - positions[i]) * weights[halfedges[k]];
        }
        sum
    });
    Ok(())
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::surfaces;
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;
    use crate::schemes::{ClampedCotangent, Cotangent, EdgeLength, Tutte, Uniform};

    fn schemes() -> Vec<Box<dyn LaplacianScheme<f64>>> {
        vec![
            Box::new(Cotangent::default()),
            Box::new(ClampedCotangent::default()),
            Box::new(Tutte),
            Box::new(Uniform),
            Box::new(EdgeLength),
        ]
    }

    proptest! {
        #[test]
        fn the_matrix_is_the_negative_of_the_operator(shape in surfaces()) {
            let surface = shape.surface();
            for scheme in schemes() {
                let operator = Operator::assemble(&*scheme, &surface)?;
                let matrix = operator.matrix();
                let mut ell = VertexMap::filled(shape.positions().len(), Vector3::zeros());
                operator.apply(shape.positions(), &mut ell);
                for axis in 0..3 {
                    let x = DVector::from_iterator(
                        shape.positions().len(),
                        shape.positions().values().map(|p| p[axis]),
                    );
                    let product = &matrix * &x;
                    for (row, ell) in product.iter().zip(ell.values()) {
                        prop_assert!((row + ell[axis]).abs() <= 1e-9 * (1.0 + x.amax()));
                    }
                }
            }
        }

        #[test]
        fn rounding_keeps_symmetry_and_hardly_changes_a_weight(shape in surfaces()) {
            let surface = shape.surface();
            for scheme in schemes() {
                let operator = Operator::assemble(&*scheme, &surface)?;
                let mut weights =
                    HalfedgeMap::filled(surface.mesh().num_halfedges(), 0.0);
                scheme.weights(&surface, &mut weights)?;
                let largest = weights.values().fold(0.0f64, |m, w| m.max(w.abs()));
                let rings = OneRings::new(surface.mesh());
                for (k, w) in operator.weights().iter().enumerate() {
                    prop_assert!((w - weights[rings.halfedges()[k]]).abs() <= 1e-13 * largest);
                    if operator.symmetry() == Symmetry::Symmetric {
                        let back = operator.graph().reverse()[k] as usize;
                        prop_assert_eq!(*w, operator.weights()[back]);
                    }
                }
            }
        }

        #[test]
        fn a_scaled_and_moved_mesh_has_the_same_weights(
            shape in surfaces(), scale in 0.01f64..100.0,
        ) {
            let moved = shape.positions().map(|p| p * scale + Vector3::new(3.0, -2.0, 1.0));
            for scheme in schemes() {
                let before = Operator::assemble(&*scheme, &shape.surface())?;
                let after = Operator::assemble(&*scheme, &shape.surface().with_positions(&moved))?;
                for (a, b) in before.weights().iter().zip(after.weights()) {
                    prop_assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()));
                }
            }
        }
    }

    #[test]
    fn a_needle_leaves_the_weights_beside_it_their_digits_in_single_precision() {
        let double = cotan_geometry::shapes::icosphere::<f64>(2);
        let mut shape = cotan_geometry::shapes::icosphere::<f32>(2);
        let v = cotan_halfedge::VertexId::new(0);
        let neighbour = shape.connectivity().one_ring(v).next().unwrap();
        let edge = shape.positions()[neighbour] - shape.positions()[v];
        shape.positions_mut()[v.index()] = shape.positions()[neighbour] - edge * 1e-4;
        let positions = shape.positions().map(|p| p.map(f64::from));
        let double = double.surface().with_positions(&positions).mesh();
        let exact = Operator::assemble(
            &Cotangent::default(),
            &Surface::new(double, &positions).unwrap(),
        )
        .unwrap();
        let single = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        assert!(exact.weights().iter().any(|w| *w > 1e3));
        for (a, b) in exact.weights().iter().zip(single.weights()) {
            // Single precision loses digits in the positions, not in the rounding.
            assert!((a - b).abs() <= 2e-2 * a.abs().max(1.0), "{a} {b}");
        }
    }

    #[test]
    fn a_scheme_that_only_says_that_it_is_symmetric_is_refused() {
        struct Lopsided;
        impl LaplacianScheme<f64> for Lopsided {
            fn weights(
                &self,
                surface: &Surface<'_, f64>,
                out: &mut HalfedgeMap<f64>,
            ) -> Result<(), SchemeError> {
                Tutte.weights(surface, out)
            }
            fn symmetry(&self) -> Symmetry {
                Symmetry::Symmetric
            }
        }
        let shape = cotan_geometry::shapes::icosphere::<f64>(1);
        let error = Operator::assemble(&Lopsided, &shape.surface()).unwrap_err();
        assert!(error.to_string().contains("Symmetry::General"), "{error}");
    }

    /// The graph of two spheres plus one pair that is not an edge: rows need not come from a
    /// mesh.
    #[test]
    fn a_graph_may_have_pairs_that_are_no_edges() {
        let shape = cotan_geometry::shapes::icosphere::<f64>(1);
        let n = shape.positions().len();
        let one = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let mut pairs = Vec::new();
        for i in 0..n {
            for (j, _) in one.graph().row(i) {
                let shifted = |row: usize| crate::RowId::new(row + n);
                pairs.push([crate::RowId::new(i), j]);
                pairs.push([shifted(i), shifted(j.index())]);
            }
        }
        pairs.push([crate::RowId::new(3), crate::RowId::new(n + 5)]);
        let graph = Arc::new(Graph::from_pairs(2 * n, &pairs));
        let mut weights = vec![0.5; graph.num_entries()];
        for i in 0..n {
            for (j, k) in graph.row(i).filter(|(j, _)| j.index() < n) {
                let place = one.graph().row(i).find(|(of_one, _)| *of_one == j);
                weights[k] = one.weights()[place.unwrap().1];
            }
        }
        let operator = Operator::<f64>::new(graph, weights, Symmetry::Symmetric).unwrap();
        let x: Positions<f64> = shape
            .positions()
            .values()
            .chain(shape.positions().values())
            .copied()
            .collect();
        let ell = operator.apply_at(&x, 3);
        let alone = one.apply_at(shape.positions(), 3);
        let further = (x.as_slice()[n + 5] - x.as_slice()[3]) * 0.5;
        assert!((ell - alone - further).norm() < 1e-14);
        let sums = &operator.matrix() * &DVector::from_element(2 * n, 1.0);
        assert!(sums.iter().all(|sum| *sum == 0.0));
    }

    #[test]
    fn a_constant_is_annihilated_exactly() {
        let shape = cotan_geometry::shapes::torus::<f64>(2.0, 0.7, 20, 11);
        let same = shape
            .positions()
            .map(|_| nalgebra::Point3::new(0.1, -0.7, 1e3));
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let mut ell = VertexMap::filled(same.len(), Vector3::x());
        operator.apply(&same, &mut ell);
        assert!(ell.values().all(|ell| *ell == Vector3::zeros()));
    }

    #[test]
    fn a_weight_that_is_not_finite_names_its_edge() {
        struct Broken;
        impl LaplacianScheme<f64> for Broken {
            fn weights(
                &self,
                _: &Surface<'_, f64>,
                out: &mut HalfedgeMap<f64>,
            ) -> Result<(), SchemeError> {
                out.as_mut_slice().fill(1.0);
                out.as_mut_slice()[5] = f64::NAN;
                Ok(())
            }
            fn symmetry(&self) -> Symmetry {
                Symmetry::General
            }
        }
        let shape = cotan_geometry::shapes::tetrahedron::<f64>();
        let h = cotan_halfedge::HalfedgeId::new(5);
        let vertices = [
            shape.connectivity().origin(h),
            shape.connectivity().target(h),
        ];
        let error = Operator::assemble(&Broken, &shape.surface()).unwrap_err();
        assert_eq!(
            error,
            SchemeError::NonFiniteWeight {
                scheme: "custom".into(),
                vertices
            }
        );
    }
}
