//! Lines along which a function on the surface has a given value.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeId, HalfedgeMesh, VertexMap};
use nalgebra::Point3;

/// A line on a surface: straight on every face, from edge to edge.
#[derive(Clone, PartialEq, Debug)]
pub struct Isoline<T: Scalar> {
    /// The points. A closed line does not repeat its first point.
    pub points: Vec<Point3<T>>,
    /// True if the line is closed.
    pub is_closed: bool,
}

/// The lines along which a function that is linear on each face has the value `level`.
///
/// Larger values are to the left of a line as seen from the outside. A vertex with exactly this
/// value counts as above it, so a line never branches; it may touch the vertex. A face whose three
/// corners have the value carries no line. Lines begin and end at the boundary, and then come
/// first. Values that are infinite or NaN are above every level.
///
/// **Shapes**: one value per vertex.
///
/// # Panics
/// If there is not one value per vertex.
#[must_use]
pub fn isolines<'m, T: Scalar>(
    surface: impl Into<Surface<'m, T>>,
    values: &VertexMap<f64>,
    level: f64,
) -> Vec<Isoline<T>> {
    let surface = surface.into();
    let mesh = surface.mesh();
    assert_eq!(values.len(), mesh.num_vertices(), "one value per vertex");
    let is_below = |h: HalfedgeId| values[mesh.origin(h)] < level;
    // A line enters a face through the halfedge that rises and leaves it through the one that
    // falls, so that the larger values are on its left.
    let enters = |h: HalfedgeId| !is_below(h) && is_below(h.twin());
    let mut is_done = vec![false; mesh.num_halfedges()];
    let at_boundary = |h: &HalfedgeId| mesh.is_boundary_halfedge(h.twin());
    let starts = mesh.halfedges().filter(at_boundary);
    let mut lines = Vec::new();
    for h in starts.chain(mesh.halfedges()) {
        if is_done[h.index()] || mesh.is_boundary_halfedge(h) || !enters(h) {
            continue;
        }
        let (crossed, is_closed) = follow(mesh, h, enters, &mut is_done);
        let points = crossed
            .iter()
            .map(|h| crossing(&surface, values, level, *h));
        lines.push(Isoline {
            points: points.collect(),
            is_closed,
        });
    }
    lines
}

/// The halfedges through which a line enters faces, from `start` to where it leaves the surface or
/// closes.
fn follow(
    mesh: &HalfedgeMesh,
    start: HalfedgeId,
    enters: impl Fn(HalfedgeId) -> bool,
    is_done: &mut [bool],
) -> (Vec<HalfedgeId>, bool) {
    let (mut crossed, mut h) = (vec![start], start);
    loop {
        is_done[h.index()] = true;
        // Of the other two halfedges of the face exactly one is left through.
        let mut exit = mesh.next(h);
        while exit != h && !enters(exit.twin()) {
            exit = mesh.next(exit);
        }
        h = exit.twin();
        if h == start {
            return (crossed, true);
        }
        crossed.push(h);
        if mesh.is_boundary_halfedge(h) || is_done[h.index()] {
            return (crossed, false);
        }
    }
}

/// The point of an edge with the wanted value.
fn crossing<T: Scalar>(
    surface: &Surface<'_, T>,
    values: &VertexMap<f64>,
    level: f64,
    halfedge: HalfedgeId,
) -> Point3<T> {
    // The same arithmetic from either side.
    let h = halfedge.edge().halfedge();
    let [from, to] = [h, h.twin()].map(|h| surface.mesh().origin(h));
    let share = (level - values[from]) / (values[to] - values[from]);
    let share = if share.is_finite() {
        share.clamp(0.0, 1.0)
    } else if values[from] < level {
        0.0
    } else {
        1.0
    };
    surface.position(from) + surface.halfedge_vector(h) * T::of_f64(share)
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bumpy_plane, icosphere};
    use cotan_geometry::testing::{directions, surfaces};
    use proptest::prelude::*;
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn parallels_of_a_sphere_are_closed_circles_around_its_pole() {
        let shape = icosphere::<f64>(4);
        let heights = shape.positions().map(|p| p.z);
        for level in [-0.7, 0.013, 0.5] {
            let lines = isolines(&shape, &heights, level);
            let [line] = lines.as_slice() else {
                panic!("{} lines", lines.len());
            };
            assert!(line.is_closed);
            let ends = line.points.iter().zip(line.points.iter().cycle().skip(1));
            let length: f64 = ends.clone().map(|(a, b)| (b - a).norm()).sum();
            let exact = 2.0 * PI * (1.0 - level * level).sqrt();
            assert!((length / exact - 1.0).abs() < 0.01);
            assert!(line.points.iter().all(|p| (p.z - level).abs() < 1e-12));
            // Counter-clockwise around the pole: larger heights are on the left.
            let turn: f64 = ends.map(|(a, b)| a.x * b.y - a.y * b.x).sum();
            assert!(turn > 0.0);
        }
        assert!(isolines(&shape, &heights, 2.0).is_empty());
    }

    #[test]
    fn lines_of_a_plane_run_from_border_to_border() {
        let shape = bumpy_plane::<f32>([2.0, 2.0], [5, 5], 0.0);
        let values = shape
            .positions()
            .map(|p| f64::from(p.x) + 0.1 * f64::from(p.y));
        let middle = 0.5
            * (values.values().fold(f64::INFINITY, |m, v| m.min(*v))
                + values.values().fold(f64::NEG_INFINITY, |m, v| m.max(*v)));
        let lines = isolines(&shape, &values, middle + 0.01);
        let [line] = lines.as_slice() else {
            panic!("{} lines", lines.len());
        };
        assert!(!line.is_closed);
        let length = (line.points[0] - line.points[line.points.len() - 1]).norm();
        assert!((length - 2.0 * 1.01_f32.sqrt()).abs() < 1e-4);
    }

    proptest! {
        #[test]
        fn every_edge_across_the_level_is_crossed_once(
            shape in surfaces(), direction in directions(), share in 0.0..1.0_f64,
        ) {
            let values = shape.positions().map(|p| direction.dot(&p.coords));
            let low = values.values().fold(f64::INFINITY, |m, v| m.min(*v));
            let high = values.values().fold(f64::NEG_INFINITY, |m, v| m.max(*v));
            let level = low + share * (high - low);
            let mesh = shape.connectivity();
            let is_across = |e: &cotan_halfedge::EdgeId| {
                let [a, b] = mesh.edge_vertices(*e).map(|v| values[v] < level);
                a != b
            };
            let lines = isolines(&shape, &values, level);
            let points: usize = lines.iter().map(|l| l.points.len()).sum();
            prop_assert_eq!(points, mesh.edges().filter(is_across).count());
            for p in lines.iter().flat_map(|l| &l.points) {
                prop_assert!((direction.dot(&p.coords) - level).abs() < 1e-9 * (1.0 + level.abs()));
            }
        }
    }
}
