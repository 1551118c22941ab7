//! Ties between parts of a mesh that no edge joins.

use cotan_geometry::Scalar;
use cotan_halfedge::{DisjointSets, HalfedgeMesh, VertexMap};
use nalgebra::Vector3;

use crate::point_tie::PointTie;
use crate::rest::Rest;

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
