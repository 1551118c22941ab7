//! Edge flips that even out the valences or enlarge the smallest angle, and removal of vertices
//! with only three triangles.

use cotan_halfedge::{EdgeId, FaceId, HalfedgeMesh, VertexId};
use nalgebra::Point3;

use crate::angles::triangle_cotangents;
use crate::areas::triangle_area_vector;

/// The quantity that a flip has to improve.
#[derive(Clone, Copy)]
pub(super) enum Goal {
    /// The sum over the four corners of (valence − 6)², provided that no angle drops below 20°.
    Valence,
    /// The smallest angle of the two triangles.
    Angle,
}

/// Flips edges in passes over edges without common corners, until a pass finds no improvement.
/// Returns `None` if the faces are not a manifold.
pub(super) fn flip_edges(points: &[Point3<f64>], faces: &mut [[u32; 3]], goal: Goal) -> Option<()> {
    for _ in 0..MAX_PASSES {
        let mesh = HalfedgeMesh::from_faces(points.len(), faces).ok()?;
        let mut touched = vec![false; points.len()];
        let mut num_flips = 0;
        for e in mesh.edges() {
            let Some(flip) = Flip::of(points, &mesh, e, goal) else {
                continue;
            };
            let corners = flip.triangles.as_flattened();
            if corners.iter().any(|&v| touched[v as usize]) {
                continue;
            }
            corners.iter().for_each(|&v| touched[v as usize] = true);
            for (face, triangle) in flip.faces.into_iter().zip(flip.triangles) {
                faces[face.index()] = triangle;
            }
            num_flips += 1;
        }
        if num_flips == 0 {
            break;
        }
    }
    Some(())
}

/// Removes vertices with three neighbours, whose triangles can never be well shaped, and replaces
/// each group of three triangles by one. Returns `None` if the faces are not a manifold.
pub(super) fn remove_valence_three(
    points: &mut Vec<Point3<f64>>,
    faces: &mut Vec<[u32; 3]>,
) -> Option<()> {
    let mesh = HalfedgeMesh::from_faces(points.len(), faces).ok()?;
    let mut is_removed = vec![false; points.len()];
    let mut touched = vec![false; points.len()];
    let mut keep_face = vec![true; faces.len()];
    for v in mesh.vertices().filter(|&v| mesh.valence(v) == 3) {
        let ring: Vec<VertexId> = mesh.one_ring(v).collect();
        let is_free = |v: &VertexId| !touched[v.index()] && mesh.valence(*v) > 3;
        if !ring.iter().all(is_free) {
            continue;
        }
        ring.iter().for_each(|v| touched[v.index()] = true);
        is_removed[v.index()] = true;
        for (k, f) in mesh.vertex_faces(v).enumerate() {
            keep_face[f.index()] = k == 0;
            if let ([a, b, c], 0) = (&ring[..], k) {
                faces[f.index()] = [a, b, c].map(|v| v.index() as u32);
            }
        }
    }
    renumber(points, faces, &is_removed, &keep_face);
    Some(())
}

/// Drops removed vertices and faces, and renumbers the remaining vertices without gaps.
fn renumber(
    points: &mut Vec<Point3<f64>>,
    faces: &mut Vec<[u32; 3]>,
    is_removed: &[bool],
    keep_face: &[bool],
) {
    let mut number = 0;
    let new_numbers: Vec<u32> = is_removed
        .iter()
        .map(|&removed| {
            let this = number;
            number += u32::from(!removed);
            this
        })
        .collect();
    let mut removed = is_removed.iter();
    points.retain(|_| removed.next() == Some(&false));
    let mut keep = keep_face.iter();
    faces.retain(|_| keep.next() == Some(&true));
    for face in faces {
        *face = face.map(|v| new_numbers[v as usize]);
    }
}

/// A measure that grows with the smallest angle of two triangles: the negative cotangent of that
/// angle, which needs no platform-dependent function.
pub(super) fn quality(points: &[Point3<f64>], triangles: &[[u32; 3]; 2]) -> f64 {
    -triangles
        .iter()
        .flat_map(|t| {
            let [a, b, c] = t.map(|v| points[v as usize]);
            triangle_cotangents(&a, &b, &c)
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

/// Two faces and their replacement.
///
/// ```text
///       c              c
///     ╱   ╲          ╱ │ ╲
///    a ──▶ b   to   a  │  b
///     ╲   ╱          ╲ │ ╱
///       d              d
/// ```
struct Flip {
    faces: [FaceId; 2],
    triangles: [[u32; 3]; 2],
}

impl Flip {
    /// Returns the flip of an edge if it is possible and improves the goal.
    fn of(points: &[Point3<f64>], mesh: &HalfedgeMesh, e: EdgeId, goal: Goal) -> Option<Self> {
        let [h, twin] = e.halfedges();
        let faces = [mesh.face(h)?, mesh.face(twin)?];
        let [a, b] = [mesh.origin(h), mesh.target(h)];
        let [c, d] = [h, twin].map(|h| mesh.target(mesh.next(h)));
        let [i, j, k, l] = [a, b, c, d].map(|v: VertexId| v.index() as u32);
        let (old, new) = ([[i, j, k], [j, i, l]], [[k, l, j], [l, k, i]]);
        let valences = [a, b, c, d].map(|v| mesh.valence(v) as i32);
        let is_better = match goal {
            Goal::Valence => {
                valence_gain(valences) > 0 && quality(points, &new) > -COTANGENT_OF_20_DEGREES
            }
            // The margin keeps rounding from flipping an edge back and forth.
            Goal::Angle => quality(points, &new) > quality(points, &old) + 1e-9,
        };
        // A vertex must keep at least three edges.
        let is_possible = valences[0] > 3 && valences[1] > 3;
        let stays_flat = || cosine_at_edge(points, &new) > MIN_COSINE;
        (is_better && is_possible && stays_flat() && mesh.halfedge_between(c, d).is_none())
            .then_some(Self {
                faces,
                triangles: new,
            })
    }
}

/// The decrease of Σ (valence − 6)² if the first two vertices lose an edge to the other two.
fn valence_gain(valences: [i32; 4]) -> i32 {
    let deviation = |change: i32, v: i32| (v + change - 6).pow(2);
    let [a, b, c, d] = valences;
    let before: i32 = valences.into_iter().map(|v| deviation(0, v)).sum();
    before - deviation(-1, a) - deviation(-1, b) - deviation(1, c) - deviation(1, d)
}

/// Cosine of the angle between the normals of two triangles, or NaN if one has no area.
fn cosine_at_edge(points: &[Point3<f64>], triangles: &[[u32; 3]; 2]) -> f64 {
    let [n, m] = triangles.map(|t| {
        let [a, b, c] = t.map(|v| points[v as usize]);
        triangle_area_vector(&a, &b, &c)
    });
    n.dot(&m) / (n.norm() * m.norm())
}

/// A few passes find nearly all flips; any others are left undone.
const MAX_PASSES: usize = 8;

const COTANGENT_OF_20_DEGREES: f64 = 2.747;

/// 60° between the normals: beyond that a flip would cut off the tip of a limb.
const MIN_COSINE: f64 = 0.5;
