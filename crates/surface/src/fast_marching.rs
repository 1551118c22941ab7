//! Distances near some vertices, by fast marching.

use std::collections::BinaryHeap;

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};

use crate::reached::Reached;

/// The distance of each vertex from the nearest source along the surface, up to `limit`;
/// infinite beyond it.
///
/// Distances spread from vertex to vertex in order of their size, across each triangle as if it
/// were flat. On a plane without obtuse triangles the error is a few per cent of an edge.
///
/// **Source**: Kimmel and Sethian, "Computing geodesic paths on manifolds", 1998. Obtuse
/// triangles are not split; across them the distance is that along edges.
///
/// Sources that are no vertices of the mesh are ignored. Copies of a vertex have one distance.
#[must_use]
pub fn distances_within<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    sources: &[VertexId],
    limit: f64,
) -> VertexMap<f64> {
    let surface = surface.into();
    let mesh = surface.mesh();
    let n = mesh.num_vertices();
    let mut distances = VertexMap::filled(n, f64::INFINITY);
    let mut is_done = vec![false; n];
    let mut queue = BinaryHeap::new();
    let same = copies_of(mesh);
    for &vertex in sources {
        if let Some(distance) = distances.get_mut(vertex) {
            *distance = 0.0;
            queue.push(Reached::at(vertex, 0.0));
        }
    }
    while let Some(Reached {
        distance,
        vertex: v,
    }) = queue.pop()
    {
        if is_done[v.index()] || distance > limit {
            continue;
        }
        is_done[v.index()] = true;
        for &copy in same.get(mesh.row_of(v).index()).into_iter().flatten() {
            if distance < distances[copy] {
                distances[copy] = distance;
                queue.push(Reached::at(copy, distance));
            }
        }
        for h in mesh.outgoing_halfedges(v) {
            let j = mesh.target(h);
            let mut relax = |to: VertexId, distance: f64| {
                if distance < distances[to] {
                    distances[to] = distance;
                    queue.push(Reached::at(to, distance));
                }
            };
            relax(j, distance + edge(&surface, v, j));
        }
        for f in mesh.vertex_faces(v) {
            let [a, b, c] = mesh.triangle(f);
            for [to, p, q] in [[a, b, c], [b, c, a], [c, a, b]] {
                if to == v || !is_done[p.index()] || !is_done[q.index()] {
                    continue;
                }
                let across = across(&surface, [to, p, q], [distances[p], distances[q]]);
                if let Some(distance) = across.filter(|d| *d < distances[to]) {
                    distances[to] = distance;
                    queue.push(Reached::at(to, distance));
                }
            }
        }
    }
    distances.values_mut().for_each(|d| {
        if *d > limit {
            *d = f64::INFINITY;
        }
    });
    distances
}

/// Per row all its vertices, if any vertex has copies.
fn copies_of(mesh: &HalfedgeMesh) -> Vec<Vec<VertexId>> {
    let mut same = Vec::new();
    if mesh.has_copies() {
        same.resize(mesh.num_rows(), Vec::new());
    }
    for (copy, row) in mesh.copies() {
        let here: &mut Vec<VertexId> = &mut same[row.index()];
        if here.is_empty() {
            here.push(row);
        }
        here.push(copy);
    }
    same
}

/// The distance at the corner `to` of a flat triangle whose other corners p and q have these
/// distances from a point in its plane, on the other side of pq. `None` if the straight line to
/// that point does not cross pq.
fn across<T: Scalar>(
    surface: &Surface<'_, T>,
    [to, p, q]: [VertexId; 3],
    [at_p, at_q]: [f64; 2],
) -> Option<f64> {
    let [to, p, q] = [to, p, q].map(|v| surface.position(v).map(T::as_f64));
    let along = q - p;
    let length = along.norm();
    // The triangle with pq on the x axis, p at 0.
    let x = (to - p).dot(&along) / length;
    let y = ((to - p).norm_squared() - x * x).max(0.0).sqrt();
    let source_x = (at_p * at_p - at_q * at_q + length * length) / (2.0 * length);
    let square = at_p * at_p - source_x * source_x;
    if !(square >= 0.0) {
        return None;
    }
    let source_y = square.sqrt();
    let crossing = source_x + (x - source_x) * source_y / (source_y + y);
    let is_between = crossing >= 0.0 && crossing <= length;
    is_between.then(|| ((x - source_x).powi(2) + (y + source_y).powi(2)).sqrt())
}

fn edge<T: Scalar>(surface: &Surface<'_, T>, a: VertexId, b: VertexId) -> f64 {
    (surface.position(b) - surface.position(a))
        .map(T::as_f64)
        .norm()
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bumpy_plane, icosphere};

    use super::*;

    #[test]
    fn distances_on_a_plane_are_straight() {
        let shape = bumpy_plane::<f64>([2.0, 2.0], [40, 40], 0.0);
        let source = VertexId::new(20 * 41 + 20);
        let found = distances_within(&shape, &[source], f64::INFINITY);
        let centre = shape.positions()[source];
        for (v, p) in shape.positions().iter() {
            let off = (found[v] - (p - centre).norm()).abs();
            assert!(off < 0.5 * 0.05, "{v:?}: {off}");
        }
    }

    #[test]
    fn distances_on_a_sphere_are_arcs_up_to_the_limit() {
        let shape = icosphere::<f64>(4);
        let source = VertexId::new(0);
        let top = shape.positions()[source].coords;
        let found = distances_within(&shape, &[source], 1.5);
        for (v, p) in shape.positions().iter() {
            let arc = p.coords.dot(&top).clamp(-1.0, 1.0).acos();
            if arc < 1.4 {
                assert!((found[v] - arc).abs() < 0.03, "{arc}: {}", found[v]);
            }
            if arc > 1.6 {
                assert_eq!(found[v], f64::INFINITY);
            }
        }
    }
}
