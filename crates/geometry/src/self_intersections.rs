//! Self-intersections of a surface, found with a bounding-box tree and exact predicates.

use std::cmp::Ordering;

use cotan_halfedge::FaceId;
use cotan_parallel::Chunks;
use nalgebra::Point3;
use robust::{Coord, Coord3D, orient2d, orient3d};

use crate::bounds::BoundingBox;
use crate::scalar::Scalar;
use crate::surface::{Positions, Surface};
use crate::triangle_tree::{TriangleTree, triangle_corners};

/// See [`Surface::self_intersections`].
#[must_use]
pub(crate) fn self_intersections<T: Scalar>(surface: &Surface<'_, T>) -> Vec<FaceId> {
    let mesh = surface.mesh();
    let positions = unit_sized(surface.positions());
    let corners = |f| mesh.triangle(f).map(|v| v.index() as u32);
    let tree = TriangleTree::build(mesh.faces().map(corners).collect(), &positions);
    let crosses_any = |f: usize| {
        let own = tree.triangles()[f];
        let triangle = triangle_corners(own, &positions);
        let Some(bounds) = BoundingBox::of(&triangle) else {
            return false;
        };
        tree.any_overlapping(&bounds, MAX_BOXES, |other| {
            let shares_a_vertex = other.iter().any(|v| own.contains(v));
            !shares_a_vertex && triangles_cross(&triangle, &triangle_corners(other, &positions))
        })
    };
    CHUNKS.filter_map(mesh.num_faces(), |f| crosses_any(f).then(|| FaceId::new(f)))
}

/// The maximum number of overlapping boxes examined per face: around a vertex with a huge valence
/// all boxes overlap, and testing all pairs would take hours.
const MAX_BOXES: usize = 1000;

/// Returns true if two triangles cross, which means that each has points strictly on both sides
/// of the other's plane and they share a segment, or that they are coplanar and their interiors
/// overlap.
///
/// The result is exact for the given coordinates. Triangles that only touch do not cross, and a
/// triangle without area crosses nothing. The order of the corners does not matter.
///
/// **Source**: Guigue and Devillers 2003, Fast and robust triangle-triangle overlap test using
/// orientation predicates; here with strict inequalities.
pub fn triangles_cross(first: &[Point3<f64>; 3], second: &[Point3<f64>; 3]) -> bool {
    let sides = second.map(|p| side(first, &p));
    if sides.iter().all(|s| s.is_eq()) {
        return overlap_in_plane(first, second);
    }
    let Some(apex_of_second) = apex(sides) else {
        return false;
    };
    let Some(apex_of_first) = apex(first.map(|p| side(second, &p))) else {
        return false;
    };
    let ([mut first, mut second], above) = (
        [
            rotated(first, apex_of_first),
            rotated(second, apex_of_second),
        ],
        sides[apex_of_second],
    );
    // Orients both triangles so that each apex is above the other triangle's plane.
    if above.is_lt() {
        first.swap(1, 2);
    }
    if side(&second, &first[0]).is_lt() {
        second.swap(1, 2);
    }
    let ([p, q, r], [a, b, c]) = (first, second);
    // Both triangles meet the intersection line of the planes in an interval. The intervals
    // overlap if each begins before the other ends.
    side(&[p, q, a], &b).is_lt() && side(&[p, r, c], &a).is_lt()
}

/// The side of a triangle's plane on which a point lies; above is where the corners appear
/// counter-clockwise.
fn side([a, b, c]: &[Point3<f64>; 3], point: &Point3<f64>) -> Ordering {
    let coord = |p: &Point3<f64>| Coord3D {
        x: p.x,
        y: p.y,
        z: p.z,
    };
    // The crate's predicate is positive for a point below.
    let below = orient3d(coord(a), coord(b), coord(c), coord(point));
    0.0_f64.partial_cmp(&below).unwrap_or(Ordering::Equal)
}

/// The corner that is alone on its side of a plane, or `None` unless there are corners on both
/// sides.
fn apex(sides: [Ordering; 3]) -> Option<usize> {
    let has = |side| sides.contains(&side);
    if !(has(Ordering::Less) && has(Ordering::Greater)) {
        return None;
    }
    (0..3).find(|&k| {
        sides[k].is_ne() && sides[(k + 1) % 3] != sides[k] && sides[(k + 2) % 3] != sides[k]
    })
}

/// Rotates the corners so that `first` comes first, which preserves the orientation.
fn rotated(triangle: &[Point3<f64>; 3], first: usize) -> [Point3<f64>; 3] {
    [0, 1, 2].map(|k| triangle[(first + k) % 3])
}

/// Returns true if the interiors of two coplanar triangles overlap, that is, if no edge line
/// separates them.
fn overlap_in_plane(first: &[Point3<f64>; 3], second: &[Point3<f64>; 3]) -> bool {
    let [a, b, c] = first;
    let dropped = (b - a).cross(&(c - a)).iamax();
    let [x, y] = [(dropped + 1) % 3, (dropped + 2) % 3];
    let flat = |p: &Point3<f64>| Coord { x: p[x], y: p[y] };
    let [first, second] = [first, second].map(|t| [flat(&t[0]), flat(&t[1]), flat(&t[2])]);
    let is_separated = |t: &[Coord<f64>; 3], u: &[Coord<f64>; 3]| {
        let turn = orient2d(t[0], t[1], t[2]);
        turn == 0.0
            || (0..3).any(|k| {
                let (from, to) = (t[k], t[(k + 1) % 3]);
                u.iter()
                    .all(|p| orient2d(from, to, *p) * turn.signum() <= 0.0)
            })
    };
    !is_separated(&first, &second) && !is_separated(&second, &first)
}

/// Scales the positions by a power of two, which is exact, to coordinates of about 1, because
/// products of huge or tiny coordinates would overflow or underflow.
fn unit_sized<T: Scalar>(positions: &Positions<T>) -> Positions<f64> {
    let sizes = positions.values().map(|p| p.coords.amax().as_f64());
    let size = sizes.fold(f64::MIN_POSITIVE, f64::max);
    let exponent = size.log2().floor().clamp(-1000.0, 1000.0) as i32;
    let scale = 2.0_f64.powi(-exponent);
    positions.map(|p| p.map(|x| x.as_f64() * scale))
}

/// Faces per task; one search takes microseconds.
const CHUNKS: Chunks = Chunks::of(256);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::shapes::{bar, creature, cylinder, icosphere, torus};
    use crate::testing;
    use cotan_halfedge::HalfedgeMesh;
    use nalgebra::{Isometry3, Vector3};
    use proptest::prelude::*;

    fn crossing(shape: &Mesh<f64>) -> Vec<usize> {
        let faces = self_intersections(&shape.surface());
        faces.into_iter().map(FaceId::index).collect()
    }

    /// Combines two shapes into one mesh.
    fn both(first: &Mesh<f64>, second: &Mesh<f64>) -> Mesh<f64> {
        let n = first.num_vertices() as u32;
        let points = first
            .positions()
            .values()
            .chain(second.positions().values());
        let positions: Positions<f64> = points.copied().collect();
        let more = second.to_triangles().into_iter().map(|v| v + n);
        let corners: Vec<u32> = first.to_triangles().into_iter().chain(more).collect();
        let faces: Vec<[u32; 3]> = corners.chunks(3).map(|t| [t[0], t[1], t[2]]).collect();
        let mesh = HalfedgeMesh::from_faces(positions.len(), &faces).expect("two manifolds");
        Mesh::new(mesh, positions).expect("a surface")
    }

    fn moved(shape: &Mesh<f64>, by: [f64; 3]) -> Mesh<f64> {
        let positions = shape.positions().map(|p| p + Vector3::from(by));
        shape.with_positions(positions).expect("as many")
    }

    /// Tests all pairs without a tree.
    fn by_pairs(shape: &Mesh<f64>) -> Vec<usize> {
        let mesh = shape.connectivity();
        let corners = |f| mesh.triangle(f).map(|v| shape.positions()[v]);
        let crosses = |f: FaceId, g: FaceId| {
            let shares = mesh
                .triangle(f)
                .iter()
                .any(|v| mesh.triangle(g).contains(v));
            !shares && triangles_cross(&corners(f), &corners(g))
        };
        let faces = mesh
            .faces()
            .filter(|&f| mesh.faces().any(|g| crosses(f, g)));
        faces.map(FaceId::index).collect()
    }

    #[test]
    fn shapes_as_they_are_made_cross_nowhere() {
        for shape in [
            bar([4.0, 1.0, 1.0], [16, 4, 4]),
            torus(1.0, 0.3, 40, 20),
            icosphere(4),
            cylinder(0.5, 2.0, 24, 12),
        ] {
            assert_eq!(crossing(&shape), []);
        }
    }

    #[test]
    fn two_spheres_cross_along_a_circle() {
        let (ball, offset) = (icosphere::<f64>(3), [1.1, 0.13, 0.07]);
        let pair = both(&ball, &moved(&ball, offset));
        let found = crossing(&pair);
        assert_eq!(found, by_pairs(&pair));
        let (offset, edge) = (Vector3::from(offset), 0.17);
        let radius = (1.0 - offset.norm_squared() / 4.0).sqrt();
        let surface = pair.surface();
        let from_circle = |f: usize| {
            let corners = pair.connectivity().triangle(FaceId::new(f));
            let sum = corners
                .iter()
                .fold(Vector3::zeros(), |s, &v| s + surface.position(v).coords);
            let from_middle = sum / 3.0 - offset / 2.0;
            let height = from_middle.dot(&offset.normalize());
            let across = (from_middle - offset.normalize() * height).norm();
            height.hypot(across - radius)
        };
        assert!(
            found.iter().all(|&f| from_circle(f) < edge),
            "near the circle only"
        );
        // On each sphere, the circle of intersection passes through one face after another.
        let circumference = std::f64::consts::TAU * radius;
        assert!(
            found.len() as f64 > 2.0 * circumference / edge,
            "{}",
            found.len()
        );
        // Apart from each other, and one inside the other.
        assert!(crossing(&both(&ball, &moved(&ball, [2.1, 0.0, 0.0]))).is_empty());
        let small = ball
            .with_positions(ball.positions().map(|p| p * 0.5))
            .expect("as many");
        assert!(crossing(&both(&ball, &small)).is_empty());
    }

    /// A band along a curve that crosses itself once, between its segments 0 and 3.
    #[test]
    fn a_loop_crosses_where_its_ends_do() {
        let curve = [[0.0, 0.0], [4.0, 0.1], [4.0, 2.0], [2.0, 2.0], [2.3, -1.0]];
        let positions: Positions<f64> = curve
            .iter()
            .flat_map(|&[x, z]| [Point3::new(x, 0.0, z), Point3::new(x, 1.0, z)])
            .collect();
        let quads = (0..4_u32).map(|k| [2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2]);
        let faces: Vec<[u32; 3]> = quads
            .flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]])
            .collect();
        let mesh = HalfedgeMesh::from_faces(10, &faces).expect("a band");
        let band = Mesh::new(mesh, positions).expect("a surface");
        assert_eq!(crossing(&band), [0, 1, 6, 7]);
        let single = self_intersections(&band.cast::<f32>().surface());
        assert_eq!(single.len(), 4);
        // At any scale, and far from the origin.
        for scale in [1e-200, 1e-30, 1e30, 1e200] {
            let scaled = band.positions().map(|p| p * scale);
            assert_eq!(
                crossing(&band.with_positions(scaled).expect("as many")),
                [0, 1, 6, 7]
            );
        }
        assert_eq!(crossing(&moved(&band, [1e6, -1e6, 1e6])), [0, 1, 6, 7]);
    }

    #[test]
    fn triangles_that_touch_do_not_cross() {
        let flat = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]].map(Point3::from);
        let crosses = |corners: [[f64; 3]; 3]| {
            let other = corners.map(Point3::from);
            let is = triangles_cross(&flat, &other);
            assert_eq!(is, triangles_cross(&other, &flat));
            let [a, b, c] = other;
            assert_eq!(is, triangles_cross(&flat, &[b, a, c]));
            is
        };
        // Through the interior; through an edge; with a corner in the plane, and across.
        assert!(crosses([
            [0.5, 0.5, -1.0],
            [0.5, 0.5, 1.0],
            [3.0, 3.0, 0.5]
        ]));
        assert!(crosses([
            [1.0, 0.0, -1.0],
            [1.0, 0.0, 1.0],
            [1.0, 1.0, 0.0]
        ]));
        assert!(crosses([
            [0.5, 0.5, 0.0],
            [0.5, 0.6, 1.0],
            [0.6, 0.5, -1.0]
        ]));
        // Touching at a corner or an edge; next to it; above it.
        assert!(!crosses([
            [0.5, 0.5, 0.0],
            [0.5, 0.5, 1.0],
            [0.6, 0.5, 1.0]
        ]));
        assert!(!crosses([
            [0.2, 0.5, 0.0],
            [0.9, 0.5, 0.0],
            [0.6, 0.5, 1.0]
        ]));
        assert!(!crosses([
            [2.0, 2.0, -1.0],
            [2.0, 2.0, 1.0],
            [3.0, 3.0, 0.5]
        ]));
        assert!(!crosses([
            [0.0, 0.0, 0.1],
            [2.0, 0.0, 0.1],
            [0.0, 2.0, 0.1]
        ]));
        // Coplanar: identical, inside, adjacent along an edge, with a common corner, apart.
        assert!(crosses([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]]));
        assert!(crosses([[0.2, 0.2, 0.0], [0.5, 0.2, 0.0], [0.2, 0.5, 0.0]]));
        assert!(!crosses([
            [0.0, 0.0, 0.0],
            [2.0, 0.0, 0.0],
            [0.0, -2.0, 0.0]
        ]));
        assert!(!crosses([
            [2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0],
            [2.0, 2.0, 0.0]
        ]));
        assert!(!crosses([
            [5.0, 5.0, 0.0],
            [6.0, 5.0, 0.0],
            [5.0, 6.0, 0.0]
        ]));
        // Triangles without area.
        assert!(!crosses([
            [0.5, 0.5, -1.0],
            [0.5, 0.5, 1.0],
            [0.5, 0.5, 3.0]
        ]));
        assert!(!crosses([[0.5, 0.5, 0.0]; 3]));
    }

    /// Returns true if an edge of one triangle passes through the other, computed without exact
    /// predicates.
    fn pierces(first: &[Point3<f64>; 3], second: &[Point3<f64>; 3]) -> bool {
        let volume = |a: &Point3<f64>, b: &Point3<f64>, c: &Point3<f64>, d: &Point3<f64>| {
            (b - a).cross(&(c - a)).dot(&(d - a))
        };
        let passes = |from: &Point3<f64>, to: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3]| {
            let ends = volume(a, b, c, from) * volume(a, b, c, to) < 0.0;
            let around = [(a, b), (b, c), (c, a)].map(|(p, q)| volume(from, to, p, q) > 0.0);
            ends && around[0] == around[1] && around[1] == around[2]
        };
        let any = |t: &[Point3<f64>; 3], u| (0..3).any(|k| passes(&t[k], &t[(k + 1) % 3], u));
        any(first, second) || any(second, first)
    }

    /// At a coarse resolution the creature intersects itself in a few places.
    #[test]
    fn what_is_found_is_what_edges_pierce() {
        let shape = creature::<f64>(64);
        let mesh = shape.connectivity();
        let corners = |f| mesh.triangle(f).map(|v| shape.positions()[v]);
        let is_pierced = |f: FaceId| {
            let is_apart = |g: &FaceId| {
                !mesh
                    .triangle(*g)
                    .iter()
                    .any(|v| mesh.triangle(f).contains(v))
            };
            let others = mesh.faces().filter(is_apart);
            others
                .into_iter()
                .any(|g| pierces(&corners(f), &corners(g)))
        };
        let found = self_intersections(&shape.surface());
        assert!(!found.is_empty() && found.iter().all(|&f| is_pierced(f)));
        let missed = mesh
            .faces()
            .step_by(37)
            .find(|f| is_pierced(*f) && !found.contains(f));
        assert_eq!(missed, None);
    }

    fn triangle() -> impl Strategy<Value = [Point3<f64>; 3]> {
        let coordinate = || -1.0..1.0_f64;
        let corner = move || [coordinate(), coordinate(), coordinate()];
        [corner(), corner(), corner()].prop_map(|t| t.map(Point3::from))
    }

    proptest! {
        #[test]
        fn triangles_cross_where_an_edge_pierces(a in triangle(), b in triangle()) {
            prop_assert_eq!(triangles_cross(&a, &b), pierces(&a, &b));
            prop_assert_eq!(triangles_cross(&b, &a), pierces(&a, &b));
        }

        #[test]
        fn the_tree_finds_what_all_pairs_find(
            shape in testing::surfaces(),
            shift in [-0.4..0.4_f64, -0.4..0.4, -0.4..0.4],
            motion in testing::rigid_motions(),
        ) {
            let size = shape.surface().bounding_box().longest_side();
            let pair = both(&shape, &moved(&shape, shift.map(|x| x * size)));
            let found = crossing(&pair);
            prop_assert_eq!(&found, &by_pairs(&pair));
            let turned: Isometry3<f64> = motion;
            let turned = pair.positions().map(|p| turned * p);
            let turned = crossing(&pair.with_positions(turned)?);
            // A crossing within the last digits may appear or disappear.
            prop_assert!(found.len().abs_diff(turned.len()) <= 1 + found.len() / 10);
        }
    }
}
