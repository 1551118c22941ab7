//! Cotangent weights that stay small on slivers.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{FaceId, HalfedgeMap, HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Cotangent, LaplacianScheme, SchemeError, Symmetry};
use nalgebra::Point3;

use super::interior::{clear_boundary_rows, symmetry_of_interior};
use super::parallel::filled;

/// Cotangent weights whose slivers are mollified, without the rows of boundary vertices.
///
/// A triangle with edges a ≥ b, c and a slack b + c − a below δ a, δ = 0.03, gets the cotangents of
/// one whose edges are all longer by e = (δ a − (b + c − a)) / (1 − δ), and whose slack is then
/// exactly δ times its longest edge. The weights are those of a triangle, so that the matrix stays
/// positive semi-definite, and no cotangent is above 35. Other triangles have the cotangents of
/// [`super::InteriorCotangent`], to the bit.
///
/// **Source**: intrinsic mollification (Sharp and Crane 2020), here per face and relative to its
/// longest edge.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MollifiedCotangent {
    symmetry: Symmetry,
}

impl MollifiedCotangent {
    /// The weights for `mesh`.
    pub fn of(mesh: &HalfedgeMesh) -> Self {
        Self {
            symmetry: symmetry_of_interior(mesh),
        }
    }
}

impl<T: Scalar> LaplacianScheme<T> for MollifiedCotangent {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        mollified_cotangents(surface, out);
        for e in surface.mesh().edges() {
            let [h, twin] = e.halfedges();
            let weight = out[h] + out[twin];
            (out[h], out[twin]) = (weight, weight);
        }
        if self.symmetry == Symmetry::General {
            clear_boundary_rows(surface.mesh(), out);
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn name(&self) -> &str {
        "mollified cotangent"
    }
}

/// The mollified cotangent of the angle opposite each halfedge in its triangle, 0 on the boundary.
pub(crate) fn mollified_cotangents<T: Scalar>(surface: &Surface<'_, T>, out: &mut HalfedgeMap<T>) {
    Cotangent::default().opposite_cotangents(surface, out);
    let mesh = surface.mesh();
    for f in mesh.faces() {
        if let Some(cotangents) = of_sliver(surface, f) {
            let h = mesh.face_halfedge(f);
            // The first halfedge leaves corner a and lies opposite c.
            [out[mesh.next(h)], out[mesh.prev(h)], out[h]] = cotangents.map(T::of_f64);
        }
    }
}

/// The areas of vertices, each at least a twentieth of the largest in its ring.
///
/// The cell of a vertex between slivers is next to nothing, and a curvature, which is divided by
/// it, next to infinite; its neighbours would take their share of that.
pub(crate) fn with_floor(mesh: &HalfedgeMesh, areas: &VertexMap<f64>) -> VertexMap<f64> {
    filled(areas.len(), |v: VertexId| {
        let largest = mesh.one_ring(v).map(|j| areas[j]).fold(0.0, f64::max);
        areas[v].max(LEAST_AREA * largest)
    })
}

/// The cotangents of the angles at the corners of a face that is a sliver.
fn of_sliver<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> Option<[f64; 3]> {
    let [a, b, c] = surface.mesh().triangle(face).map(|v| at(surface, v));
    // Opposite the corners a, b, c.
    let edges = [c - b, a - c, b - a];
    let size = edges.iter().map(|e| e.amax()).fold(0.0, f64::max);
    if !(size > 0.0 && size.is_finite()) {
        return None;
    }
    let lengths = edges.map(|e| (e / size).norm());
    let longest = lengths.into_iter().fold(0.0, f64::max);
    let slack = lengths.iter().sum::<f64>() - 2.0 * longest;
    let missing = SLACK * longest - slack;
    if !(missing > 0.0) {
        return None;
    }
    let [a, b, c] = lengths.map(|l| l + missing / (1.0 - SLACK));
    // Heron's formula, which is accurate here: no factor is below δ times the longest edge.
    let quadruple = ((a + b + c) * (b + c - a) * (c + a - b) * (a + b - c)).sqrt();
    let [a, b, c] = [a, b, c].map(|l| l * l);
    Some([b + c - a, c + a - b, a + b - c].map(|doubled| doubled / quadruple))
}

fn at<T: Scalar>(surface: &Surface<'_, T>, v: VertexId) -> Point3<f64> {
    surface.position(v).map(T::as_f64)
}

/// δ: angles of the altered triangles lie above 160° or below 2°. From 0.01 to 0.1 the result is
/// the same to three digits.
const SLACK: f64 = 0.03;

/// Of the largest area in the ring; neighbours of a mesh without slivers differ by less.
const LEAST_AREA: f64 = 0.05;
