//! Ties between parts of a mesh that no edge joins.

use cotan_geometry::Scalar;
use cotan_halfedge::{DisjointSets, HalfedgeMesh, VertexId, VertexMap};
use nalgebra::Vector3;

use crate::rest::Rest;

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

/// The ties of a rest shape as the system takes them.
pub(crate) fn in_system(ties: &[PointTie]) -> Vec<cotan_linear::Tie> {
    let tie = |tie: &PointTie| cotan_linear::Tie {
        weight: tie.weight,
        terms: tie.terms(),
    };
    ties.iter().map(tie).collect()
}

/// Adds the pull of the ties on a field that they want to be equal at both ends: −κ c (c · field).
pub(crate) fn add_pull<T: Scalar>(
    rest: &Rest<T>,
    field: &[Vector3<f64>],
    out: &mut VertexMap<Vector3<f64>>,
) {
    for tie in rest.ties() {
        let terms = tie.terms();
        let gap: Vector3<f64> = terms.iter().map(|(v, c)| field[v.index()] * *c).sum();
        for (v, c) in &terms {
            out[*v] -= gap * (tie.weight * c);
        }
    }
}

/// The component of every vertex, with components that are tied to each other as one; numbered by
/// their lowest vertices.
pub(crate) fn joined_components(mesh: &HalfedgeMesh, ties: &[PointTie]) -> (Vec<usize>, usize) {
    let components = mesh.components();
    let of_vertex = components.of_vertices();
    let mut sets = DisjointSets::new(components.count());
    for tie in ties {
        sets.join(of_vertex[tie.own[0].0], of_vertex[tie.on[0].0]);
    }
    let (numbers, count) = sets.numbered();
    let number = |c: &u32| numbers[*c as usize] as usize;
    (of_vertex.values().map(number).collect(), count)
}
