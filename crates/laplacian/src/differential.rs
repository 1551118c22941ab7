//! Gradient of functions given at the vertices, and divergence of vector fields given per face.
//!
//! ```text
//! gradient      (∇u)_T = Σ_k u_k ∇φ_k,      ∇φ_k = N × e_k / 2A     (e_k opposite to corner k)
//! divergence    (div X)_i = −Σ_T A_T ∇φ_i · X_T                     (integrated over i's cell)
//! ```
//!
//! They are adjoint: Σ_i u_i (div X)_i = −Σ_T A_T (∇u)_T · X_T. So div X is half the flux of X
//! through the sides opposite to a vertex, which is the flux through the border of the cell that
//! joins the midpoints of edges. On a closed surface, and on one with a boundary that nothing
//! crosses, div X sums to zero. div ∇u = ½ ℓ(u) with the cotangent weights of this workspace.
//!
//! **Source**: Botsch, Kobbelt, Pauly, Alliez, Lévy 2010, Polygon mesh processing, sections 3.3.3
//! and 3.3.4.

use cotan_geometry::{Scalar, Surface, face_area_vector, maps, scalar};
use cotan_halfedge::{FaceId, FaceMap, VertexMap};
use nalgebra::Vector3;
use nalgebra_sparse::CsrMatrix;

use crate::masses::csr;

/// The gradients of the three hat functions of a face, in the order of its corners; zero for a face
/// without area.
///
/// **Units**: one over length.
pub fn hat_gradients<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> [Vector3<T>; 3] {
    let corners = surface.mesh().triangle(face).map(|v| surface.position(v));
    let area_vector = face_area_vector(surface, face);
    let squared = area_vector.norm_squared();
    if !(squared > T::zero()) {
        return [Vector3::zeros(); 3];
    }
    // N / 2A = area vector / 2A².
    let turned = area_vector / (squared * scalar(2.0));
    [0, 1, 2].map(|k| turned.cross(&(corners[(k + 2) % 3] - corners[(k + 1) % 3])))
}

/// The gradient of a function that is linear on each face, tangent to the face.
///
/// **Shapes**: one value per vertex; one vector per face. **Units**: those of the values over
/// length. Zero on faces without area. Exact: the gradient of a linear function of the position is
/// its projection to the face.
///
/// # Panics
/// If there is not one value per vertex.
#[must_use]
pub fn gradient<T: Scalar>(surface: &Surface<'_, T>, values: &VertexMap<T>) -> FaceMap<Vector3<T>> {
    let mesh = surface.mesh();
    assert_eq!(values.len(), mesh.num_vertices(), "one value per vertex");
    maps::filled(mesh.num_faces(), |f| {
        let corners = mesh.triangle(f);
        let [_, b, c] = hat_gradients(surface, f);
        let [u, v, w] = corners.map(|v| values[v]);
        // Differences: a constant has no gradient, exactly, and large values lose nothing.
        b * (v - u) + c * (w - u)
    })
}

/// The divergence of a vector field that is constant on each face, integrated over the cells of the
/// vertices.
///
/// **Shapes**: one vector per face; one value per vertex. **Units**: those of the field times
/// length. Components normal to a face do not count.
///
/// # Panics
/// If there is not one vector per face.
#[must_use]
pub fn divergence<T: Scalar>(
    surface: &Surface<'_, T>,
    field: &FaceMap<Vector3<T>>,
) -> VertexMap<T> {
    let mesh = surface.mesh();
    assert_eq!(field.len(), mesh.num_faces(), "one vector per face");
    maps::filled(mesh.num_vertices(), |v| {
        mesh.vertex_faces(v).fold(T::zero(), |sum, f| {
            let k = corner(surface, f, v);
            sum - flux_gradient(surface, f)[k].dot(&field[f])
        })
    })
}

/// The matrix of [`gradient`].
///
/// **Shape**: 3 m × n for m faces; rows 3 f, 3 f + 1 and 3 f + 2 are x, y and z of face f.
#[must_use]
pub fn gradient_matrix<T: Scalar>(surface: &Surface<'_, T>) -> CsrMatrix<T> {
    let mesh = surface.mesh();
    let rows = cotan_parallel::filled(3 * mesh.num_faces(), |row| {
        let (f, axis) = (FaceId::new(row / 3), row % 3);
        let hats = hat_gradients(surface, f);
        sorted([0, 1, 2].map(|k| (mesh.triangle(f)[k].index(), hats[k][axis])))
    });
    csr(3 * mesh.num_faces(), mesh.num_vertices(), rows)
}

/// The matrix of [`divergence`]: −Gᵀ A, with the gradient matrix G and the areas of the faces A.
///
/// **Shape**: n × 3 m.
#[must_use]
pub fn divergence_matrix<T: Scalar>(surface: &Surface<'_, T>) -> CsrMatrix<T> {
    let mesh = surface.mesh();
    let rows = cotan_parallel::filled(mesh.num_vertices(), |i| {
        let v = cotan_halfedge::VertexId::new(i);
        let entries = mesh.vertex_faces(v).flat_map(|f| {
            let hat = flux_gradient(surface, f)[corner(surface, f, v)];
            [0, 1, 2].map(|axis| (3 * f.index() + axis, -hat[axis]))
        });
        let mut row: Vec<(usize, T)> = entries.collect();
        row.sort_by_key(|(column, _)| *column);
        row
    });
    csr(mesh.num_vertices(), 3 * mesh.num_faces(), rows)
}

/// A ∇φ of the three corners: the gradients times the area of the face.
fn flux_gradient<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> [Vector3<T>; 3] {
    let area = face_area_vector(surface, face).norm();
    hat_gradients(surface, face).map(|hat| hat * area)
}

fn corner<T: Scalar>(
    surface: &Surface<'_, T>,
    face: FaceId,
    vertex: cotan_halfedge::VertexId,
) -> usize {
    let corners = surface.mesh().triangle(face);
    corners.iter().position(|c| *c == vertex).unwrap_or(0)
}

fn sorted<T: Scalar>(mut entries: [(usize, T); 3]) -> Vec<(usize, T)> {
    entries.sort_by_key(|(column, _)| *column);
    entries.to_vec()
}

#[cfg(test)]
mod tests {
    use cotan_geometry::testing::{closed_surfaces, directions, surfaces};
    use cotan_geometry::unit_or_zero;
    use nalgebra::DVector;
    use proptest::prelude::*;

    use super::*;
    use crate::{Cotangent, Operator};

    proptest! {
        #[test]
        fn the_gradient_of_a_linear_function_is_its_projection(
            shape in surfaces(), direction in directions(),
        ) {
            let surface = shape.surface();
            let values = shape.positions().map(|p| direction.dot(&p.coords));
            let field = gradient(&surface, &values);
            for (f, g) in field.iter() {
                let n = unit_or_zero(&face_area_vector(&surface, f));
                let expected = direction - n * n.dot(&direction);
                prop_assert!((g - expected).norm() < 1e-9);
            }
            let constant = VertexMap::filled(shape.num_vertices(), 1e6);
            prop_assert!(gradient(&surface, &constant).values().all(|g| *g == Vector3::zeros()));
        }

        #[test]
        fn the_flux_out_of_all_cells_is_zero(
            shape in closed_surfaces(), seed in prop::collection::vec(directions(), 8),
        ) {
            let surface = shape.surface();
            let field = FaceMap::from_fn(shape.num_faces(), |f| seed[f.index() % 8]);
            let flux = divergence(&surface, &field);
            let size: f64 = flux.values().map(|d: &f64| d.abs()).sum();
            prop_assert!(flux.values().sum::<f64>().abs() <= 1e-12 * (1.0 + size));
        }

        /// The divergence theorem on any set of vertices: what leaves its cells crosses their
        /// border, half a side of each triangle that is partly outside.
        #[test]
        fn the_divergence_of_a_region_is_the_flux_through_its_border(
            shape in surfaces(), seed in prop::collection::vec(directions(), 8), every in 2..5_usize,
        ) {
            let surface = shape.surface();
            let mesh = shape.connectivity();
            let field = FaceMap::from_fn(shape.num_faces(), |f| seed[f.index() % 8]);
            let is_inside = |v: cotan_halfedge::VertexId| v.index().is_multiple_of(every);
            let flux = divergence(&surface, &field);
            let inside: f64 = mesh.vertices().filter(|v| is_inside(*v)).map(|v| flux[v]).sum();
            let mut border = 0.0;
            for f in mesh.faces() {
                let corners = mesh.triangle(f);
                let p = corners.map(|v| surface.position(v));
                let normal = unit_or_zero(&face_area_vector(&surface, f));
                for k in 0..3 {
                    if is_inside(corners[k]) {
                        // From the midpoint of one side at the corner to that of the other.
                        let to_next = (p[(k + 1) % 3] - p[k]) * 0.5;
                        let to_last = (p[(k + 2) % 3] - p[k]) * 0.5;
                        border += (to_last - to_next).cross(&normal).dot(&field[f]);
                    }
                }
            }
            let size = surface.bounding_box().diagonal() * mesh.num_faces() as f64;
            prop_assert!((inside - border).abs() < 1e-12 * size, "{} {}", inside, border);
        }

        #[test]
        fn divergence_of_the_gradient_is_half_the_laplacian(shape in surfaces()) {
            let surface = shape.surface();
            let values = shape.positions().map(|p| p.x * p.x - 0.5 * p.y);
            let twice = divergence(&surface, &gradient(&surface, &values)).map(|d| 2.0 * d);
            let operator = Operator::assemble(&Cotangent::default(), &surface)?;
            let ell = operator.apply_to_values(&values);
            let size = ell.values().fold(1.0_f64, |m, l| m.max(l.abs()));
            for (a, b) in twice.values().zip(ell.values()) {
                prop_assert!((a - b).abs() < 1e-9 * size);
            }
            let column = DVector::from_vec(values.into_vec());
            let by_matrix = &divergence_matrix(&surface) * &(&gradient_matrix(&surface) * &column);
            let stiff = &operator.stiffness_matrix() * &column;
            for ((a, b), c) in twice.values().zip(by_matrix.iter()).zip(stiff.iter()) {
                prop_assert!((a - 2.0 * b).abs() < 1e-9 * size);
                prop_assert!((a + 2.0 * c).abs() < 1e-9 * size);
            }
        }
    }
}
