//! The nearest point of the original surface, found by walking from a triangle close by.
//!
//! A vertex that remeshing moves stays on its own sheet of a thin part, where a search through
//! space could jump to the other side.

use cotan_geometry::Scalar;
use cotan_halfedge::{FaceId, VertexMap};
use nalgebra::Vector3;

use crate::features::Place;
use crate::triangles::{NONE, Triangles, next, prev};

/// A point on a triangle of a surface.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct SurfacePoint {
    /// The triangle.
    pub face: FaceId,
    /// The weights of its corners, in the order of its halfedges; they sum to 1.
    pub barycentric: [f64; 3],
}

impl SurfacePoint {
    /// The value at this point of a quantity that is given per corner of the triangle.
    pub fn interpolate<T: Scalar>(&self, values: [T; 3]) -> T {
        let [a, b, c] = self.barycentric.map(T::of_f64);
        values[0] * a + values[1] * b + values[2] * c
    }
}

/// The values at points of a surface of a quantity per vertex.
///
/// **Shapes**: `values` has an entry per vertex of the surface's mesh.
pub fn interpolated<T: Scalar>(
    mesh: &cotan_halfedge::HalfedgeMesh,
    points: &VertexMap<SurfacePoint>,
    values: &VertexMap<T>,
) -> VertexMap<T> {
    points.map(|point| point.interpolate(mesh.triangle(point.face).map(|v| values[v])))
}

/// A nearest point while walking.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    pub(crate) face: u32,
    pub(crate) point: Vector3<f64>,
    pub(crate) barycentric: [f64; 3],
    distance_squared: f64,
}

impl Nearest {
    pub(crate) fn on_surface(&self) -> SurfacePoint {
        SurfacePoint {
            face: FaceId::new(self.face as usize),
            barycentric: self.barycentric,
        }
    }
}

/// Walks from `face` to the triangle nearest to `point`, as long as a triangle that shares a
/// vertex with the current one is nearer.
pub(crate) fn walk(original: &Triangles, face: u32, point: Vector3<f64>) -> Nearest {
    let mut best = on_triangle(original, face, point);
    // Each step is strictly nearer, so the walk ends; the bound is for rounding.
    for _ in 0..MOST_STEPS {
        let start = best.face;
        for v in original.corners(start) {
            for h in original.ring(v) {
                if h / 3 != start {
                    let other = on_triangle(original, h / 3, point);
                    if other.distance_squared < best.distance_squared {
                        best = other;
                    }
                }
            }
        }
        if best.face == start {
            break;
        }
    }
    best
}

/// Walks along a line of `original` from the edge of `h` to the point nearest to `point`, not
/// beyond corners. Returns the edge and the point.
pub(crate) fn walk_line(
    original: &Triangles,
    places: &[Place],
    h: u32,
    point: Vector3<f64>,
) -> (u32, Vector3<f64>) {
    let mut best = (h, on_segment(original, h, point));
    for _ in 0..MOST_STEPS {
        let start = best.0;
        for v in [original.origin(start), original.target(start)] {
            if places[v as usize] != Place::Line {
                continue;
            }
            for other in original.edges_at(v).filter(|&g| original.tag(g) != NONE) {
                let near = on_segment(original, other, point);
                if (near - point).norm_squared() < (best.1 - point).norm_squared() {
                    best = (original.edge_of(other), near);
                }
            }
        }
        if best.0 == start {
            break;
        }
    }
    best
}

fn on_segment(original: &Triangles, h: u32, p: Vector3<f64>) -> Vector3<f64> {
    let (a, b) = (
        original.point(original.origin(h)),
        original.point(original.target(h)),
    );
    let along = b - a;
    let length_squared = along.norm_squared();
    if length_squared > 0.0 {
        a + along * ((p - a).dot(&along) / length_squared).clamp(0.0, 1.0)
    } else {
        a
    }
}

/// The nearest point of a triangle.
///
/// **Source**: C. Ericson, "Real-Time Collision Detection", section 5.1.5.
fn on_triangle(original: &Triangles, face: u32, p: Vector3<f64>) -> Nearest {
    let h = 3 * face;
    let [a, b, c] = [h, next(h), prev(h)].map(|h| original.point(original.origin(h)));
    let barycentric = barycentric_of_nearest(a, b, c, p);
    let [x, y, z] = barycentric;
    let point = if x == 1.0 {
        a
    } else if y == 1.0 {
        b
    } else if z == 1.0 {
        c
    } else {
        a * x + b * y + c * z
    };
    Nearest {
        face,
        point,
        barycentric,
        distance_squared: (p - point).norm_squared(),
    }
}

fn barycentric_of_nearest(
    a: Vector3<f64>,
    b: Vector3<f64>,
    c: Vector3<f64>,
    p: Vector3<f64>,
) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 && d1 - d3 > 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 && d2 - d6 > 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    let (from_b, from_c) = (d4 - d3, d5 - d6);
    if va <= 0.0 && from_b >= 0.0 && from_c >= 0.0 && from_b + from_c > 0.0 {
        let t = from_b / (from_b + from_c);
        return [0.0, 1.0 - t, t];
    }
    let sum = va + vb + vc;
    if sum > 0.0 {
        let (y, z) = (vb / sum, vc / sum);
        [1.0 - y - z, y, z]
    } else {
        // A triangle without area, seen from a point that rounds onto it.
        [1.0, 0.0, 0.0]
    }
}

const MOST_STEPS: usize = 10_000;
