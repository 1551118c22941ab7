//! Cotangent weights that stay bounded on slivers.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{FaceId, HalfedgeMap, HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{Copies, Cotangent, LaplacianScheme, SchemeError, Symmetry};
use nalgebra::Point3;

use super::interior::Interior;
use super::parallel::filled;

/// Cotangent weights with mollified slivers and without the rows of boundary vertices, or of
/// vertices with copies.
///
/// If a triangle with edges a ≥ b, c has a slack b + c − a below δ a, with δ = 0.03, each edge is
/// lengthened by e = (δ a − (b + c − a)) / (1 − δ), which makes the slack exactly δ times the
/// longest edge, and the cotangents of the resulting triangle are used. The weights are those of
/// actual triangles, so the matrix remains positive semi-definite, and no cotangent exceeds 35.
/// All other triangles have exactly the cotangents of [`super::InteriorCotangent`].
///
/// **Source**: intrinsic mollification (Sharp and Crane 2020), applied here per face and relative
/// to the longest edge of the face.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct MollifiedCotangent {
    symmetry: Symmetry,
}

impl MollifiedCotangent {
    /// Creates the weights for `mesh`.
    pub fn of(mesh: &HalfedgeMesh) -> Self {
        Self {
            symmetry: Interior::Fans.symmetry(mesh),
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
            Interior::Fans.clear_others(surface.mesh(), out);
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn copies(&self) -> Copies {
        Copies::Sum
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
            // The first halfedge starts at corner a and is opposite c.
            [out[mesh.next(h)], out[mesh.prev(h)], out[h]] = cotangents.map(T::of_f64);
        }
    }
}

/// The vertex areas, each raised to at least a twentieth of the largest in its ring.
///
/// A vertex between slivers has almost no area, and its curvature, which is divided by the area,
/// is nearly infinite. Its neighbours would be affected by that.
pub(crate) fn with_floor(mesh: &HalfedgeMesh, areas: &VertexMap<f64>) -> VertexMap<f64> {
    filled(areas.len(), |v: VertexId| {
        let largest = mesh
            .one_ring(v)
            .map(|j| areas[mesh.row_of(j)])
            .fold(0.0, f64::max);
        areas[v].max(MIN_AREA * largest)
    })
}

/// The cotangents at the corners of a sliver; `None` for any other face.
fn of_sliver<T: Scalar>(surface: &Surface<'_, T>, face: FaceId) -> Option<[f64; 3]> {
    let [a, b, c] = surface.mesh().triangle(face).map(|v| at(surface, v));
    // Opposite the corners a, b and c.
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
    // Heron's formula, which is accurate here because no factor is below δ times the longest
    // edge.
    let quadruple = ((a + b + c) * (b + c - a) * (c + a - b) * (a + b - c)).sqrt();
    let [a, b, c] = [a, b, c].map(|l| l * l);
    Some([b + c - a, c + a - b, a + b - c].map(|doubled| doubled / quadruple))
}

fn at<T: Scalar>(surface: &Surface<'_, T>, v: VertexId) -> Point3<f64> {
    surface.position(v).map(T::as_f64)
}

/// δ: affected triangles have angles above 160° or below 2°. From 0.01 to 0.1 the result agrees
/// to three digits.
const SLACK: f64 = 0.03;

/// Relative to the largest area in the ring. Without slivers, neighbouring areas differ by less.
const MIN_AREA: f64 = 0.05;
