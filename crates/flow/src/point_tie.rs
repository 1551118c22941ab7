//! A tie between two points of a mesh.

use cotan_halfedge::VertexId;

/// A tie between a point of the surface and one that it is close to, on another part of the mesh.
///
/// With c the shares of the first point, less those of the second, it adds to the energy
///
/// ```text
/// μ κ |Σ_k c_k x_k − R r⁰|²,      r⁰ = Σ_k c_k x⁰_k
/// ```
///
/// with R half the mean rotation at the first point and half that at the second; and the first
/// point's rotations are drawn to the second's as if that were a neighbour of weight f.
#[derive(Clone, PartialEq, Debug)]
pub struct PointTie {
    /// The first point: the corners of a triangle with their shares. A vertex is one corner of
    /// share 1.
    pub own: [(VertexId, f64); 3],
    /// The second point.
    pub on: [(VertexId, f64); 3],
    /// κ, in units of cotangents.
    pub weight: f64,
    /// f, between 0 and 1.
    pub nearness: f64,
}

impl PointTie {
    /// c: the vertices that count, each once.
    pub(crate) fn terms(&self) -> Vec<(VertexId, f64)> {
        let own = self.own.iter().copied();
        let on = self.on.iter().map(|(v, share)| (*v, -share));
        let mut terms: Vec<(VertexId, f64)> = own.chain(on).filter(|(_, c)| *c != 0.0).collect();
        terms.sort_by_key(|(v, _)| *v);
        terms.dedup_by(|later, kept| {
            let is_same = later.0 == kept.0;
            if is_same {
                kept.1 += later.1;
            }
            is_same
        });
        terms
    }
}
