//! Measures of a merged surface.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{EdgeId, VertexId, VertexMap};

/// Measures of a seam, for reports.
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct SeamReport {
    /// Number of cuts that were joined.
    pub loops: usize,
    /// Number of faces between the two surfaces.
    pub faces: usize,
    /// Number of vertices between the two surfaces.
    pub vertices: usize,
    /// Number of selected faces of either mesh that were dropped: attached by a corner only, or in
    /// a small piece.
    pub dropped: [usize; 2],
    /// Number of vertices of the two meshes that the blend moved.
    pub moved: usize,
    /// Dihedral angle that 95 % of the edges of the seam do not exceed, and the largest. In
    /// degrees.
    pub dihedral: [f64; 2],
    /// The same of all edges outside the band.
    pub dihedral_elsewhere: [f64; 2],
    /// Smallest corner angle in the band, and of the inputs there. In degrees.
    pub smallest_angle: [f64; 2],
    /// Number of faces that intersect others: in the result, and in the kept parts by themselves.
    pub self_intersections: [usize; 2],
}

/// Absolute dihedral angles in degrees: the 95 % quantile and the largest.
pub(super) fn dihedral<T: Scalar>(
    surface: &Surface<'_, T>,
    counts: impl Fn(EdgeId) -> bool,
) -> [f64; 2] {
    let angles = surface.dihedral_angles();
    let mesh = surface.mesh();
    let mut chosen: Vec<f64> = mesh
        .edges()
        .filter(|&e| !mesh.is_boundary_edge(e) && counts(e))
        .map(|e| angles[e].as_f64().abs().to_degrees())
        .collect();
    chosen.sort_by(f64::total_cmp);
    let Some(&largest) = chosen.last() else {
        return [0.0, 0.0];
    };
    [chosen[(chosen.len() - 1) * 95 / 100], largest]
}

/// The smallest corner angle, in degrees, of the faces that have a vertex in the band and are
/// accepted by `counts`; 180 if there is none.
pub(super) fn smallest_angle<T: Scalar>(
    surface: &Surface<'_, T>,
    rings: &VertexMap<usize>,
    band: usize,
    counts: impl Fn([VertexId; 3]) -> bool,
) -> f64 {
    let mesh = surface.mesh();
    let angles = surface.corner_angles();
    let mut smallest = 180.0_f64;
    for f in mesh.faces() {
        let corners = mesh.triangle(f);
        if counts(corners) && corners.iter().any(|&v| rings[v] <= band) {
            for h in mesh.face_halfedges(f) {
                smallest = smallest.min(angles[h].as_f64().to_degrees());
            }
        }
    }
    smallest
}
