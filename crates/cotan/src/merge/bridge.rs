//! The faces between two cuts.

use nalgebra::{Point3, Vector3};

use super::place::{evenly, perimeter};
use super::valleys::filled;
use super::zipper::{Strip, Triangle};

/// One side of a seam: the polygon along which a surface was cut.
pub(super) struct Side {
    /// The vertices of the joined mesh.
    pub(super) vertices: Vec<u32>,
    /// Their positions.
    pub(super) points: Vec<Point3<f64>>,
    /// The unit directions in which the surface would continue, or zero where there is none.
    pub(super) outward: Vec<Vector3<f64>>,
}

/// The vertices and faces of a seam.
pub(super) struct Bridge {
    /// The points between the two cuts, ring by ring. The first has the index `first_new`.
    pub(super) points: Vec<Point3<f64>>,
    /// Triangles, wound like the two surfaces.
    pub(super) faces: Vec<[u32; 3]>,
}

impl Bridge {
    /// Joins two cuts, both given in the direction of `first`. Where the gap between them is wider
    /// than two edges it gets rings of vertices, on curves that leave both surfaces smoothly
    /// (Hermite).
    ///
    /// The sharpest valleys of both cuts are filled first. `is_edge` tells which pairs of vertices
    /// have an edge.
    pub(super) fn between(
        first: &Side,
        second: &Side,
        first_new: u32,
        is_edge: impl Fn(u32, u32) -> bool,
    ) -> Self {
        let (first, of_first) = filled(first, &is_edge);
        let (second, of_second) = filled(second, &is_edge);
        let (first, second) = (&first, &second);
        let strip = Strip::between(&first.points, &second.points);
        let edge = (perimeter(&first.points) + perimeter(&second.points))
            / (first.points.len() + second.points.len()) as f64;
        let mut rungs: Vec<f64> = strip
            .rungs
            .iter()
            .map(|&[i, j]| (second.points[j] - first.points[i]).norm())
            .collect();
        rungs.sort_by(f64::total_cmp);
        let gap = rungs[rungs.len() / 2];
        let rings = match edge > 0.0 && gap > WIDEST_STRIP * edge {
            true => ((gap / edge).round() as usize)
                .saturating_sub(1)
                .min(MAX_RINGS),
            false => 0,
        };
        let mut bridge = Self {
            points: Vec::new(),
            // Like the faces of the strip: against the edges on the first side, along them on the
            // second.
            faces: of_first
                .iter()
                .map(|&[before, at, after]| [at, before, after])
                .chain(of_second)
                .collect(),
        };
        if rings == 0 {
            bridge.zip(&strip, &first.vertices, &second.vertices);
            return bridge;
        }
        let curves = Curves::new(first, second, &strip);
        let mut last = (first.vertices.clone(), first.points.clone());
        for ring in 1..=rings {
            let t = ring as f64 / (rings + 1) as f64;
            let [m, n] = [first, second].map(|side| side.points.len() as f64);
            let count = ((1.0 - t) * m + t * n).round() as usize;
            let points = curves.ring(t, count.max(3));
            let start = first_new + bridge.points.len() as u32;
            let vertices: Vec<u32> = (start..).take(points.len()).collect();
            bridge.zip(&Strip::between(&last.1, &points), &last.0, &vertices);
            bridge.points.extend(&points);
            last = (vertices, points);
        }
        let strip = Strip::between(&last.1, &second.points);
        bridge.zip(&strip, &last.0, &second.vertices);
        bridge
    }

    fn zip(&mut self, strip: &Strip, first: &[u32], second: &[u32]) {
        self.faces
            .extend(strip.triangles().map(|triangle| match triangle {
                // The surface on the first side runs along its edges, that on the second against
                // them; the strip runs the other way on both.
                Triangle::OnFirst([i, next], j) => [first[next], first[i], second[j]],
                Triangle::OnSecond(i, [j, next]) => [second[j], second[next], first[i]],
            }));
    }
}

/// Curves from one cut to the other, along the rungs of a strip.
struct Curves {
    /// Both ends of each rung, and the directions there.
    ends: Vec<[(Point3<f64>, Vector3<f64>); 2]>,
}

impl Curves {
    fn new(first: &Side, second: &Side, strip: &Strip) -> Self {
        let end = |side: &Side, k: usize| (side.points[k], side.outward[k]);
        let ends = strip
            .rungs
            .iter()
            .map(|&[i, j]| [end(first, i), end(second, j)]);
        Self {
            ends: ends.collect(),
        }
    }

    /// Points at t, evenly spaced around.
    fn ring(&self, t: f64, count: usize) -> Vec<Point3<f64>> {
        let points = self.ends.iter().map(|[(a, along_a), (b, along_b)]| {
            let gap = (b - a).norm();
            let (t2, t3) = (t * t, t * t * t);
            let place = a.coords * (2.0 * t3 - 3.0 * t2 + 1.0)
                + along_a * (gap * (t3 - 2.0 * t2 + t))
                + b.coords * (3.0 * t2 - 2.0 * t3)
                - along_b * (gap * (t3 - t2));
            Point3::from(place)
        });
        evenly(&points.collect::<Vec<_>>(), count)
    }
}

/// The widest gap without rings, in mean edges of both cuts.
const WIDEST_STRIP: f64 = 2.0;

/// Maximum number of rings. A gap that needs more is a mistake of the placement.
const MAX_RINGS: usize = 1000;
