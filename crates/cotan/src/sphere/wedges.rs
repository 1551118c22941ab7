//! Triangles around a vertex with high valence, searched by their angle.
//!
//! The boxes of thin triangles that meet in one point overlap, and a bounding-box tree returns
//! all of them. Around such a vertex c with the ring r₀, r₁, … the sign of det(c, r_k, d) tells
//! on which side of the arc from c to r_k a direction d lies. Within a wedge of less than half a
//! turn these signs fall from 1 to −1 along the ring, so bisection finds the one triangle, or the
//! two at an arc.

use cotan_geometry::Scalar;
use cotan_halfedge::{FaceId, HalfedgeMesh, VertexId};
use nalgebra::Vector3;

use super::locate::side;
use super::map::SphereMap;

/// Valence from which the triangles around a vertex are searched by their angle.
const HIGH_VALENCE: usize = 128;

/// Angle of a wedge in radians, small enough that its box is not much larger than the wedge.
const WIDTH: f64 = 0.8;

/// Consecutive triangles around a vertex, spanning less than half a turn.
#[derive(Clone, Debug)]
pub(crate) struct Wedge {
    center: Vector3<f64>,
    /// The vertices opposite the centre, counter-clockwise; one more than there are faces.
    ring: Vec<VertexId>,
    faces: Vec<FaceId>,
    /// The lowest of `faces`.
    lowest: FaceId,
}

/// The wedges of a map, and the faces that are not in any wedge, in ascending order.
pub(crate) fn wedges<T: Scalar>(map: &SphereMap<T>) -> (Vec<Wedge>, Vec<FaceId>) {
    let mesh = map.mesh();
    let mut wedges = Vec::new();
    let mut is_taken = vec![false; mesh.num_faces()];
    for v in mesh.vertices() {
        if mesh.outgoing_halfedges(v).nth(HIGH_VALENCE).is_none() {
            continue;
        }
        let mut fan = fan(mesh, v);
        fan.retain(|&(_, _, face)| !is_taken[face.index()]);
        for wedge in cut(map, v, &fan) {
            wedge.faces.iter().for_each(|f| is_taken[f.index()] = true);
            wedges.push(wedge);
        }
    }
    let rest = mesh.faces().filter(|f| !is_taken[f.index()]).collect();
    (wedges, rest)
}

/// The faces around a vertex, counter-clockwise, each with the two vertices opposite it.
fn fan(mesh: &HalfedgeMesh, v: VertexId) -> Vec<(VertexId, VertexId, FaceId)> {
    let of = |h| {
        let face = mesh.face(h)?;
        Some((mesh.target(h), mesh.target(mesh.next(h)), face))
    };
    let mut fan: Vec<_> = mesh.outgoing_halfedges(v).filter_map(of).collect();
    if let [first, second, ..] = fan[..]
        && first.1 != second.0
    {
        fan.reverse();
    }
    fan
}

/// The wedges of a fan: runs of consecutive faces. Single faces are left out.
fn cut<T: Scalar>(
    map: &SphereMap<T>,
    v: VertexId,
    fan: &[(VertexId, VertexId, FaceId)],
) -> Vec<Wedge> {
    let center = direction(map, v);
    let mut wedges = Vec::new();
    let mut start = 0;
    while start < fan.len() {
        let mut angle = 0.0;
        let mut end = start;
        while end < fan.len() && (end == start || fan[end].0 == fan[end - 1].1) {
            let [a, b] = [fan[end].0, fan[end].1].map(|r| direction(map, r));
            angle += angle_at(&center, &a, &b);
            if angle > WIDTH && end > start {
                break;
            }
            end += 1;
        }
        let (first, last) = (fan[start].0, fan[end - 1].1);
        let is_less_than_half_a_turn =
            side(&center, &direction(map, first), &direction(map, last)) > 0.0;
        if end > start + 1 && is_less_than_half_a_turn {
            let faces: Vec<FaceId> = fan[start..end].iter().map(|f| f.2).collect();
            let lowest = faces.iter().copied().fold(faces[0], FaceId::min);
            let ring = fan[start..end].iter().map(|f| f.0).chain([last]).collect();
            wedges.push(Wedge {
                center,
                ring,
                faces,
                lowest,
            });
        }
        start = end;
    }
    wedges
}

fn direction<T: Scalar>(map: &SphereMap<T>, v: VertexId) -> Vector3<f64> {
    map.positions()[v].coords.map(T::as_f64)
}

/// The angle at c between the arcs to a and b, from 0 to π.
fn angle_at(c: &Vector3<f64>, a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    c.cross(a).angle(&c.cross(b))
}

impl Wedge {
    /// Corners of a box around the wedge.
    pub(crate) fn corners<T: Scalar>(&self, map: &SphereMap<T>) -> [Vector3<f64>; 2] {
        self.ring.iter().fold([self.center; 2], |[low, high], &v| {
            let p = direction(map, v);
            [low.inf(&p), high.sup(&p)]
        })
    }

    /// The faces that a direction may pierce, without missing any: one face, or the two at an
    /// arc. At the centre, where all faces meet, the lowest one.
    pub(crate) fn candidates<T: Scalar>(
        &self,
        map: &SphereMap<T>,
        d: &Vector3<f64>,
    ) -> [Option<FaceId>; 2] {
        let side_of = |v: &VertexId| side(&self.center, &direction(map, *v), d);
        let behind = self.ring.partition_point(|v| side_of(v) >= 0.0);
        let Some(k) = behind.checked_sub(1) else {
            return [None; 2];
        };
        if side_of(&self.ring[k]) > 0.0 {
            return [self.faces.get(k).copied(), None];
        }
        if k + 1 == self.ring.len() && side_of(&self.ring[0]) == 0.0 {
            return [Some(self.lowest), None];
        }
        let before = k.checked_sub(1).map(|k| self.faces[k]);
        [before, self.faces.get(k).copied()]
    }
}
