//! Laplacian weights without the rows of boundary vertices.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, HalfedgeMesh};
use cotan_laplacian::{Cotangent, LaplacianScheme, SchemeError, Symmetry};

/// Cotangent weights without the rows of boundary vertices, where Σ_j w_ij (v_j − v_i) is not a
/// curvature and would pull the rim inwards.
///
/// On a closed mesh this equals [`Cotangent`] and is symmetric. With a boundary it is not
/// symmetric: w_ij = 0 if i is on the boundary, while w_ji is kept.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct InteriorCotangent {
    symmetry: Symmetry,
}

impl InteriorCotangent {
    /// Creates the weights for `mesh`.
    pub fn of(mesh: &HalfedgeMesh) -> Self {
        Self {
            symmetry: symmetry_of_interior(mesh),
        }
    }
}

impl<T: Scalar> LaplacianScheme<T> for InteriorCotangent {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        Cotangent::default().weights(surface, out)?;
        if self.symmetry == Symmetry::General {
            clear_boundary_rows(surface.mesh(), out);
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn name(&self) -> &str {
        "interior cotangent"
    }
}

/// w_ij = 4√3 / valence(i), without rows for boundary vertices: the umbrella operator, scaled to
/// the size of the cotangent weights on a mesh of equilateral triangles.
///
/// It does not depend on the positions, so noise in them does not make the weights noisy.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct InteriorUmbrella;

impl<T: Scalar> LaplacianScheme<T> for InteriorUmbrella {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        let mesh = surface.mesh();
        for v in mesh.vertices() {
            let weight = T::of_f64(48.0_f64.sqrt() / mesh.valence(v).max(1) as f64);
            for h in mesh.outgoing_halfedges(v) {
                out[h] = weight;
            }
        }
        clear_boundary_rows(mesh, out);
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::General
    }

    fn name(&self) -> &str {
        "interior umbrella"
    }
}

/// The symmetry of weights that are symmetric until boundary rows are cleared.
pub(super) fn symmetry_of_interior(mesh: &HalfedgeMesh) -> Symmetry {
    if mesh.is_closed() {
        Symmetry::Symmetric
    } else {
        Symmetry::General
    }
}

/// Sets w_ij = 0 where i is on the boundary.
pub(super) fn clear_boundary_rows<T: Scalar>(mesh: &HalfedgeMesh, weights: &mut HalfedgeMap<T>) {
    for h in mesh.halfedges() {
        if mesh.is_boundary_vertex(mesh.origin(h)) {
            weights[h] = T::zero();
        }
    }
}
