//! Mass matrices of piecewise linear functions.
//!
//! ```text
//! consistent      M_ij = ∫ φ_i φ_j        (A/6 on the diagonal, A/12 off it, per triangle)
//! barycentric     M_ii = ∫ φ_i            (A/3 per triangle)
//! mixed Voronoi   M_ii = area of the surface nearest to i, within the triangles around it
//! ```
//!
//! All of them sum to the area of the surface. The masses belong to the usual Laplacian with ½:
//! next to the weights of this workspace they are doubled; see the
//! [crate documentation](crate#the-usual-½).

use cotan_geometry::{Scalar, Surface, face_area_vector, maps, scalar, triangle_cotangents};
use cotan_halfedge::{FaceId, HalfedgeId, VertexMap};
use nalgebra_sparse::CsrMatrix;

use crate::rings::OneRings;

/// A diagonal mass matrix.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Lumping {
    /// A third of each triangle around the vertex.
    #[default]
    Barycentric,
    /// The part of each triangle that is nearest to the vertex; in an obtuse triangle half of it
    /// for the obtuse corner and a quarter for the other two.
    ///
    /// **Source**: Meyer, Desbrun, Schröder, Barr 2003, Discrete differential-geometry operators
    /// for triangulated 2-manifolds, section 3.3 and figure 4.
    MixedVoronoi,
}

/// The diagonal of a lumped mass matrix: the dual area of each vertex.
///
/// **Shapes**: one entry per vertex. **Units**: area. They sum to the area of the surface; those of
/// vertices with only degenerate triangles are 0.
#[must_use]
pub fn lumped_masses<T: Scalar>(surface: &Surface<'_, T>, lumping: Lumping) -> VertexMap<T> {
    match lumping {
        Lumping::Barycentric => surface.dual_areas(),
        Lumping::MixedVoronoi => {
            let mesh = surface.mesh();
            maps::filled(mesh.num_vertices(), |v| {
                mesh.vertex_faces(v).fold(T::zero(), |sum, f| {
                    let corners = mesh.triangle(f);
                    let k = corners.iter().position(|c| *c == v).unwrap_or(0);
                    sum + voronoi_share(surface, f, k)
                })
            })
        }
    }
}

/// The area of a face that belongs to its corner `k`.
fn voronoi_share<T: Scalar>(surface: &Surface<'_, T>, face: FaceId, k: usize) -> T {
    let corners = surface.mesh().triangle(face);
    let at = |by: usize| surface.position(corners[(k + by) % 3]);
    let (p, q, r) = (at(0), at(1), at(2));
    let area = face_area_vector(surface, face).norm();
    let [of_p, of_q, of_r] = triangle_cotangents(&p, &q, &r);
    if of_p < T::zero() {
        area * scalar(0.5)
    } else if of_q < T::zero() || of_r < T::zero() {
        area * scalar(0.25)
    } else {
        ((q - p).norm_squared() * of_r + (r - p).norm_squared() * of_q) * scalar(0.125)
    }
}

/// The consistent mass matrix ∫ φ_i φ_j of the hat functions φ.
///
/// **Shape**: n × n, indexed by row, which is a vertex unless vertices have copies; columns
/// ascending. **Units**: area.
#[must_use]
pub fn consistent_mass_matrix<T: Scalar>(surface: &Surface<'_, T>) -> CsrMatrix<T> {
    let mesh = surface.mesh();
    let rings = OneRings::new(mesh);
    let n = mesh.num_rows();
    let of_face = |f: Option<FaceId>| f.map_or(T::zero(), |f| face_area_vector(surface, f).norm());
    let twelfth = scalar::<T>(1.0 / 12.0);
    let areas = surface.dual_areas();
    let mut diagonal = mesh.to_rows(&areas);
    for (copy, row) in mesh.copies() {
        diagonal[row] += areas[copy];
    }
    let diagonal = diagonal.map(|a| *a * scalar(0.5));
    let rows = cotan_parallel::filled(n, |i| {
        let mut row: Vec<(usize, T)> = rings
            .ring(i)
            .map(|(j, k)| {
                let both = |h: &HalfedgeId| of_face(mesh.face(*h)) + of_face(mesh.face(h.twin()));
                let halfedges = rings.halfedges_of(k).iter();
                let all = halfedges.map(both).fold(T::zero(), |sum, area| sum + area);
                (j.index(), all * twelfth)
            })
            .collect();
        let place = row.partition_point(|(j, _)| *j < i);
        row.insert(place, (i, diagonal.as_slice()[i]));
        row
    });
    csr(n, n, rows)
}

/// The product of [`consistent_mass_matrix`] and one number per vertex, without the matrix.
///
/// **Shapes**: one entry per vertex.
///
/// # Panics
/// If there is not one value per vertex.
#[must_use]
pub fn apply_consistent_mass<T: Scalar>(
    surface: &Surface<'_, T>,
    values: &VertexMap<T>,
) -> VertexMap<T> {
    let mesh = surface.mesh();
    assert_eq!(values.len(), mesh.num_vertices(), "one value per vertex");
    let twelfth = scalar::<T>(1.0 / 12.0);
    maps::filled(mesh.num_vertices(), |v| {
        mesh.vertex_faces(v).fold(T::zero(), |sum, f| {
            let corners = mesh.triangle(f);
            let total = corners.iter().fold(values[v], |sum, c| sum + values[*c]);
            sum + face_area_vector(surface, f).norm() * twelfth * total
        })
    })
}

/// A diagonal matrix.
#[must_use]
pub fn diagonal_matrix<T: Scalar>(diagonal: &VertexMap<T>) -> CsrMatrix<T> {
    let rows = diagonal.values().enumerate().map(|(i, d)| vec![(i, *d)]);
    csr(diagonal.len(), diagonal.len(), rows.collect())
}

/// A matrix of rows with ascending columns.
pub(crate) fn csr<T: Scalar>(
    num_rows: usize,
    num_columns: usize,
    rows: Vec<Vec<(usize, T)>>,
) -> CsrMatrix<T> {
    let mut offsets = Vec::with_capacity(num_rows + 1);
    offsets.push(0);
    let (mut columns, mut values) = (Vec::new(), Vec::new());
    for row in rows {
        for (column, value) in row {
            columns.push(column);
            values.push(value);
        }
        offsets.push(columns.len());
    }
    CsrMatrix::try_from_csr_data(num_rows, num_columns, offsets, columns, values)
        .expect("sorted rows within bounds")
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bar, icosphere};
    use cotan_geometry::testing::surfaces;
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn masses_sum_to_the_area(shape in surfaces()) {
            let surface = shape.surface();
            let area = surface.area();
            for lumping in [Lumping::Barycentric, Lumping::MixedVoronoi] {
                let masses = lumped_masses(&surface, lumping);
                prop_assert!(masses.values().all(|m| *m >= 0.0));
                prop_assert!((masses.values().sum::<f64>() - area).abs() < 1e-12 * area);
            }
            let ones = VertexMap::filled(shape.num_vertices(), 1.0);
            let lumped = lumped_masses(&surface, Lumping::Barycentric);
            let rows = apply_consistent_mass(&surface, &ones);
            for (a, b) in rows.values().zip(lumped.values()) {
                prop_assert!((a - b).abs() < 1e-12 * area);
            }
        }

        #[test]
        fn the_consistent_matrix_integrates_squares_of_linear_functions(shape in surfaces()) {
            let surface = shape.surface();
            let x = shape.positions().map(|p| p.x);
            // ∫ x² over a triangle, exactly, by the midpoints of its sides.
            let exact: f64 = shape
                .connectivity()
                .faces()
                .map(|f| {
                    let [a, b, c] = shape.connectivity().triangle(f).map(|v| x[v]);
                    let middle = |a: f64, b: f64| (0.5 * (a + b)).powi(2);
                    face_area_vector(&surface, f).norm()
                        * (middle(a, b) + middle(b, c) + middle(c, a)) / 3.0
                })
                .sum();
            let applied = apply_consistent_mass(&surface, &x);
            let energy: f64 = applied.values().zip(x.values()).map(|(a, b)| a * b).sum();
            prop_assert!((energy - exact).abs() < 1e-11 * (1.0 + exact));
            let column = DVector::from_vec(x.into_vec());
            let product = &consistent_mass_matrix(&surface) * &column;
            for (a, b) in product.iter().zip(applied.values()) {
                prop_assert!((a - b).abs() < 1e-11 * (1.0 + exact));
            }
        }
    }

    #[test]
    fn voronoi_cells_of_a_square_grid_are_squares() {
        let shape = bar::<f64>([2.0, 2.0, 2.0], [4, 4, 4]);
        let masses = lumped_masses(&shape.surface(), Lumping::MixedVoronoi);
        let inner = masses.values().filter(|m| (**m - 0.25).abs() < 1e-12);
        // All but the corners, where three quarters of a square meet.
        assert_eq!(inner.count(), shape.num_vertices() - 8);
        let single = icosphere::<f32>(2);
        let sum: f32 = lumped_masses(&single.surface(), Lumping::MixedVoronoi)
            .values()
            .sum();
        assert!((sum / single.surface().area() as f32 - 1.0).abs() < 1e-5);
        assert_eq!(diagonal_matrix(&masses).nnz(), shape.num_vertices());
    }
}
