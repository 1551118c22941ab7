//! The motion of a surface that was cut along several loops.

use std::f64::consts::TAU;

use nalgebra::{Point3, Rotation3, Unit, Vector3};

use super::place::{SAMPLES, Similarity, evenly};

/// The similarity that brings several loops to others with the least mean squared distance.
///
/// Of all pairings of the loops, or for the stated one, several turns are tried about the line
/// through the two loops that are farthest apart, which is free if the loops lie around it. From
/// there the closest phases along the loops and the similarity by least squares are determined in
/// turn. The target of each loop lies `gap` in front of it, in the direction in which the still
/// surface would continue.
///
/// `None` for fewer than two loops, and for more than [`MOST_LOOPS`] whose pairs are not stated.
pub(super) fn between_several(
    still: &[Vec<Point3<f64>>],
    moving: &[Vec<Point3<f64>>],
    stated: &[[usize; 2]],
    gap: f64,
) -> Option<Similarity> {
    let count = still.len();
    let is_small = (2..=MOST_LOOPS).contains(&count);
    if count != moving.len() || count < 2 || !(is_small || stated.len() == count) {
        return None;
    }
    let fits = |order: &Vec<usize>| stated.iter().all(|&[a, b]| order.get(a) == Some(&b));
    let all = match stated.len() == count {
        true => vec![order_of(stated)],
        false => orders(count),
    };
    let targets: Vec<Ring> = still
        .iter()
        .map(|polygon| {
            let ring = Ring::sample(polygon.iter());
            let ahead = ring.axis * -gap;
            ring.moved(|p| p + ahead)
        })
        .collect();
    // The moving loops run against the still ones.
    let rings: Vec<Ring> = moving
        .iter()
        .map(|polygon| Ring::sample(polygon.iter().rev()))
        .collect();
    let mut best: Option<(f64, Similarity)> = None;
    for order in all.iter().filter(|order| fits(order)) {
        let partners: Option<Vec<&Ring>> = order.iter().map(|&k| rings.get(k)).collect();
        let partners = partners?;
        for turn in 0..TURNS {
            let start = start(
                &targets,
                &partners,
                TAU * f64::from(turn) / f64::from(TURNS),
            );
            let (miss, motion) = refined(&targets, &partners, start);
            if best.is_none_or(|(least, _)| miss < least) {
                best = Some((miss, motion));
            }
        }
    }
    best.map(|(_, motion)| motion)
}

/// A polygon sampled evenly by arc length.
struct Ring {
    points: Vec<Point3<f64>>,
    center: Point3<f64>,
    /// The unit normal of its area.
    axis: Vector3<f64>,
    /// The radius of a disc of its area.
    radius: f64,
}

impl Ring {
    fn sample<'a>(polygon: impl Iterator<Item = &'a Point3<f64>>) -> Self {
        let polygon: Vec<Point3<f64>> = polygon.copied().collect();
        Self::of(evenly(&polygon, SAMPLES))
    }

    fn of(points: Vec<Point3<f64>>) -> Self {
        let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
        let center = Point3::from(sum / points.len() as f64);
        let sides = (0..points.len()).map(|k| {
            let next = points[(k + 1) % points.len()];
            (points[k] - center).cross(&(next - center)) * 0.5
        });
        let area: Vector3<f64> = sides.sum();
        Self {
            axis: area.try_normalize(0.0).unwrap_or_else(Vector3::z),
            radius: (area.norm() / std::f64::consts::PI).sqrt(),
            points,
            center,
        }
    }

    fn moved(&self, motion: impl Fn(&Point3<f64>) -> Point3<f64>) -> Self {
        Self::of(self.points.iter().map(motion).collect())
    }
}

/// The similarity by the centres and normals of the loops, with a turn about the longest line
/// between two centres.
fn start(still: &[Ring], moving: &[&Ring], angle: f64) -> Similarity {
    let mut pairs = Vec::new();
    for (to, from) in still.iter().zip(moving) {
        pairs.push([from.center, to.center]);
        pairs.push([
            from.center + from.axis * from.radius,
            to.center + to.axis * to.radius,
        ]);
    }
    let motion = Similarity::between(&pairs);
    let mut line: Vector3<f64> = Vector3::zeros();
    for a in still {
        for b in still {
            let between = b.center - a.center;
            if between.norm() > line.norm() {
                line = between;
            }
        }
    }
    let Some(axis) = Unit::try_new(line, 0.0) else {
        return motion;
    };
    let turn = Rotation3::from_axis_angle(&axis, angle);
    let fixed = still[0].center.coords;
    Similarity {
        scale: motion.scale,
        rotation: turn * motion.rotation,
        translation: turn * (motion.translation - fixed) + fixed,
    }
}

/// The mean squared distance that is left, and the similarity.
fn refined(still: &[Ring], moving: &[&Ring], mut motion: Similarity) -> (f64, Similarity) {
    let mut miss = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut pairs = Vec::with_capacity(SAMPLES * still.len());
        for (to, from) in still.iter().zip(moving) {
            let placed: Vec<Point3<f64>> = from.points.iter().map(|p| motion.apply(p)).collect();
            let distance = |phase: usize| -> f64 {
                let terms = (0..SAMPLES)
                    .map(|k| (to.points[k] - placed[(k + phase) % SAMPLES]).norm_squared());
                terms.sum()
            };
            let phase = (0..SAMPLES).min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
            let phase = phase.unwrap_or(0);
            pairs.extend((0..SAMPLES).map(|k| [from.points[(k + phase) % SAMPLES], to.points[k]]));
        }
        let next = Similarity::between(&pairs);
        let left = pairs
            .iter()
            .map(|[from, to]| (next.apply(from) - to).norm_squared());
        let left = left.sum::<f64>() / pairs.len() as f64;
        if !(left < miss) {
            break;
        }
        (miss, motion) = (left, next);
    }
    (miss, motion)
}

/// The partner of each loop of the first surface, by pairs that name each.
fn order_of(stated: &[[usize; 2]]) -> Vec<usize> {
    let mut stated = stated.to_vec();
    stated.sort_unstable();
    stated.into_iter().map(|[_, b]| b).collect()
}

/// All orders of the first numbers, in lexicographic order.
fn orders(count: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for _ in 0..count {
        all = all
            .into_iter()
            .flat_map(|order: Vec<usize>| {
                let free = (0..count)
                    .filter(|k| !order.contains(k))
                    .collect::<Vec<_>>();
                free.into_iter().map(move |k| {
                    let mut longer = order.clone();
                    longer.push(k);
                    longer
                })
            })
            .collect();
    }
    all
}

/// There are 24 pairings of four loops.
const MOST_LOOPS: usize = 4;

/// Turns that are tried about the longest line, 45° apart; the phases do the rest.
const TURNS: u32 = 8;

/// The phases hardly change after the third round.
const ROUNDS: usize = 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_all_there_once() {
        assert_eq!(orders(2), [[0, 1], [1, 0]]);
        let mut four = orders(4);
        four.dedup();
        assert_eq!(four.len(), 24);
    }

    /// An ellipse around a point.
    fn ellipse(center: [f64; 3], axes: [[f64; 3]; 2], count: usize) -> Vec<Point3<f64>> {
        let [a, b] = axes.map(Vector3::from);
        (0..count)
            .map(|k| {
                let (sin, cos) = (TAU * k as f64 / count as f64).sin_cos();
                Point3::from(center) + a * cos + b * sin
            })
            .collect()
    }

    #[test]
    fn loops_return_to_their_places_from_anywhere() {
        let still = [
            ellipse([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 0.6, 0.0]], 40),
            ellipse([3.0, 0.0, 0.5], [[0.5, 0.0, 0.2], [0.0, 0.4, 0.0]], 30),
        ];
        let motion = Similarity {
            scale: 2.5,
            rotation: Rotation3::new(Vector3::new(0.4, -2.0, 0.9)),
            translation: Vector3::new(3.0, 1.0, -7.0),
        };
        // In another order, reversed, and with other numbers of vertices.
        let moving: Vec<Vec<Point3<f64>>> = [
            ellipse([3.0, 0.0, 0.5], [[0.5, 0.0, 0.2], [0.0, 0.4, 0.0]], 50),
            ellipse([0.0; 3], [[1.0, 0.0, 0.0], [0.0, 0.6, 0.0]], 35),
        ]
        .iter()
        .map(|polygon| polygon.iter().rev().map(|p| motion.apply(p)).collect())
        .collect();
        let back = between_several(&still, &moving, &[], 0.0).unwrap();
        assert_eq!(
            between_several(&still, &moving, &[[0, 1], [1, 0]], 0.0),
            Some(back)
        );
        assert!((back.scale - 0.4).abs() < 0.01, "{back:?}");
        for p in &still[0] {
            let off = (back.apply(&motion.apply(p)) - p).norm();
            assert!(off < 0.05, "{off}");
        }
    }
}
