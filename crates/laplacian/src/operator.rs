//! The assembled operator.

use std::marker::PhantomData;
use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, Surface, scalar};
use cotan_halfedge::{HalfedgeMap, VertexMap};
use nalgebra::Vector3;
use nalgebra_sparse::CsrMatrix;
use rayon::prelude::*;

use crate::exact::{exact_units, round_to, round_to_exact_sums};
use crate::rings::OneRings;
use crate::scheme::{LaplacianScheme, SchemeError, Symmetry};

/// The weights that a scheme chose on one surface, ready to be applied and factorized.
///
/// The weights are rounded (by at most a few units in the last place of the largest weight
/// nearby) so that every sum of weights around a vertex is *exact*: the rows of
/// [`Operator::matrix`] sum to zero exactly, whatever the order of the summation, and a constant
/// is in its null space without an error.
#[derive(Clone, Debug)]
pub struct Operator<T: Scalar> {
    rings: Arc<OneRings>,
    /// In double precision whatever T is: beside the huge weight of one needle those of its
    /// neighbours would lose their digits.
    weights: HalfedgeMap<f64>,
    /// The same weights in the order of the rings, for sums that run every iteration.
    rows: Vec<f64>,
    symmetry: Symmetry,
    cotangent_floor: Option<f64>,
    number: PhantomData<fn(T) -> T>,
}

impl<T: Scalar> Operator<T> {
    /// Asks `scheme` for the weights of `surface`, checks and rounds them.
    ///
    /// # Errors
    /// What the scheme reports, and [`SchemeError::NonFiniteWeight`] naming the edge.
    pub fn assemble<S: LaplacianScheme<T> + ?Sized>(
        scheme: &S,
        surface: &Surface<'_, T>,
    ) -> Result<Self, SchemeError> {
        let rings = Arc::new(OneRings::new(surface.mesh()));
        Self::assemble_on(rings, scheme, surface)
    }

    /// As [`Self::assemble`], with the one-rings of the mesh already at hand.
    ///
    /// # Errors
    /// As [`Self::assemble`].
    pub fn assemble_on<S: LaplacianScheme<T> + ?Sized>(
        rings: Arc<OneRings>,
        scheme: &S,
        surface: &Surface<'_, T>,
    ) -> Result<Self, SchemeError> {
        let mesh = surface.mesh();
        let mut chosen = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
        scheme.weights(surface, &mut chosen)?;
        if scheme.symmetry() == Symmetry::Symmetric {
            check_symmetry(scheme, surface, &chosen)?;
        }
        let mut weights = chosen.map(|w| w.as_f64());
        // A weight whose row sum overflows comes out as not finite too.
        round_to_exact_sums(&rings, mesh, &mut weights);
        if let Some((h, _)) = weights.iter().find(|(_, w)| !w.is_finite()) {
            return Err(SchemeError::NonFiniteWeight {
                scheme: scheme.name().into(),
                vertices: [mesh.origin(h), mesh.target(h)],
            });
        }
        let rows = rings.halfedges().iter().map(|&h| weights[h]).collect();
        Ok(Self {
            rings,
            weights,
            rows,
            symmetry: scheme.symmetry(),
            cotangent_floor: scheme.cotangent_floor(),
            number: PhantomData,
        })
    }

    /// The weight w_ij of every halfedge i→j.
    pub fn weights(&self) -> &HalfedgeMap<f64> {
        &self.weights
    }

    /// The weights row after row: entry k belongs to the halfedge at place k of
    /// [`OneRings::halfedges`].
    #[inline]
    pub fn row_weights(&self) -> &[f64] {
        &self.rows
    }

    /// The sparsity pattern.
    #[inline]
    pub fn rings(&self) -> &Arc<OneRings> {
        &self.rings
    }

    /// Whether w_ij = w_ji for every edge.
    pub fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    /// [`LaplacianScheme::cotangent_floor`] of the scheme that chose the weights.
    pub fn cotangent_floor(&self) -> Option<f64> {
        self.cotangent_floor
    }

    /// Number of vertices: of rows and of columns.
    pub fn num_vertices(&self) -> usize {
        self.rings.num_vertices()
    }

    /// Mean over the vertices of |Σ_j w_ij|: the size of the diagonal, to which the weights of
    /// soft handles are relative.
    pub fn mean_diagonal(&self) -> f64 {
        let n = self.num_vertices();
        let row_sum = |i| self.rows[self.rings.range(i)].iter().sum::<f64>();
        let sums = (0..n).map(|i| row_sum(i).abs());
        sums.sum::<f64>() / n.max(1) as f64
    }

    /// ℓ_i = Σ_j w_ij (v_j − v_i) of every vertex. Exactly zero where all v are equal.
    ///
    /// # Panics
    /// If `positions` or `out` has not one entry a vertex.
    pub fn apply(&self, positions: &Positions<T>, out: &mut VertexMap<Vector3<T>>) {
        assert_eq!(
            positions.len(),
            self.num_vertices(),
            "one position a vertex"
        );
        assert_eq!(
            out.len(),
            self.num_vertices(),
            "one Laplacian coordinate a vertex"
        );
        out.as_mut_slice()
            .par_iter_mut()
            .enumerate()
            .with_min_len(1 << 11)
            .for_each(|(i, ell)| *ell = self.apply_at(positions, i).map(T::of_f64));
    }

    /// ℓ of vertex number `i`, in double precision.
    ///
    /// # Panics
    /// If there is no such vertex, or fewer positions than vertices.
    #[inline]
    pub fn apply_at(&self, positions: &Positions<T>, i: usize) -> Vector3<f64> {
        let x = positions.as_slice();
        let mut sum = Vector3::zeros();
        let row = self.rings.range(i);
        for (j, w) in self.rings.neighbours()[row.clone()]
            .iter()
            .zip(&self.rows[row])
        {
            sum += (x[j.index()] - x[i]).map(T::as_f64) * *w;
        }
        sum
    }

    /// The operator as a sparse matrix: **−L**, with Σ_j w_ij on the diagonal and −w_ij beside it,
    /// so that it is positive semi-definite for the cotangent scheme.
    ///
    /// **Shape**: n × n, row and column = vertex number, columns ascending. Every row sums to
    /// exactly zero.
    ///
    /// # Panics
    /// Never: the pattern is sorted and within bounds by construction.
    pub fn matrix(&self) -> CsrMatrix<T> {
        /// Rows that one task fills.
        const CHUNK: usize = 2048;
        let n = self.num_vertices();
        // Rounded once more where T is coarser than f64; nothing changes where it is not.
        let weights = self.weights.map(|w| T::of_f64(*w));
        let units = exact_units(&self.rings, &weights);
        let blocks: Vec<(Vec<usize>, Vec<T>)> = (0..n.div_ceil(CHUNK))
            .into_par_iter()
            .map(|block| {
                let (mut columns, mut values) = (Vec::new(), Vec::new());
                for i in block * CHUNK..n.min((block + 1) * CHUNK) {
                    self.push_row(i, &weights, &units, &mut columns, &mut values);
                }
                (columns, values)
            })
            .collect();
        let mut offsets = Vec::with_capacity(n + 1);
        offsets.push(0);
        // Every row has a diagonal entry beside its ring.
        offsets.extend((0..n).map(|i| self.rings.range(i).end + i + 1));
        let mut columns = Vec::with_capacity(weights.len() + n);
        let mut values = Vec::with_capacity(weights.len() + n);
        for (block_columns, block_values) in blocks {
            columns.extend(block_columns);
            values.extend(block_values);
        }
        CsrMatrix::try_from_csr_data(n, n, offsets, columns, values)
            .expect("sorted rows within bounds")
    }

    /// Appends row `i` of the matrix, its diagonal in its place.
    fn push_row(
        &self,
        i: usize,
        weights: &HalfedgeMap<T>,
        units: &[T],
        columns: &mut Vec<usize>,
        values: &mut Vec<T>,
    ) {
        let start = columns.len();
        let place = self.rings.ring(i).filter(|(j, _)| j.index() < i).count();
        let mut sum = T::zero();
        for (k, (j, h)) in self.rings.ring(i).enumerate() {
            if k == place {
                columns.push(i);
                values.push(T::zero());
            }
            let weight = round_to(weights[h], units[i].max(units[j.index()]));
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

/// A scheme that says that it is symmetric must be, within rounding.
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

/// ℓ_i = Σ_j w_ij (v_j − v_i) with weights that need not belong to an operator, in parallel.
///
/// # Panics
/// If a map has not one entry an element.
pub fn apply_weights<T: Scalar>(
    rings: &OneRings,
    weights: &HalfedgeMap<T>,
    positions: &Positions<T>,
    out: &mut VertexMap<Vector3<T>>,
) {
    assert_eq!(
        positions.len(),
        rings.num_vertices(),
        "one position a vertex"
    );
    assert_eq!(
        out.len(),
        rings.num_vertices(),
        "one Laplacian coordinate a vertex"
    );
    assert_eq!(
        weights.len(),
        rings.halfedges().len(),
        "one weight a halfedge"
    );
    let positions = positions.as_slice();
    out.as_mut_slice()
        .par_iter_mut()
        .enumerate()
        .with_min_len(1 << 11)
        .for_each(|(i, ell)| {
            let mut sum = Vector3::zeros();
            for (j, h) in rings.ring(i) {
                sum += (positions[j.index()] - positions[i]) * weights[h];
            }
            *ell = sum;
        });
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
                for (h, w) in operator.weights().iter() {
                    prop_assert!((w - weights[h]).abs() <= 1e-13 * largest);
                    if operator.symmetry() == Symmetry::Symmetric {
                        prop_assert_eq!(*w, operator.weights()[h.twin()]);
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
                for (a, b) in before.weights().values().zip(after.weights().values()) {
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
        assert!(exact.weights().values().any(|w| *w > 1e3));
        for (a, b) in exact.weights().values().zip(single.weights().values()) {
            // What single precision loses is lost in the positions, not in the rounding.
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
