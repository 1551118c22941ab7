//! The pairs of cuts of the two surfaces that belong together.

use nalgebra::Point3;

use super::error::MergeError;
use super::options::MergeOptions;

/// Pairs the loops, given as points. Entry k is the partner of loop k of the first surface.
///
/// `landmarks` are points on both surfaces, in place.
pub(super) fn pair(
    first: &[Vec<Point3<f64>>],
    second: &[Vec<Point3<f64>>],
    landmarks: &[[Point3<f64>; 2]],
    options: &MergeOptions,
) -> Result<Vec<usize>, MergeError> {
    let count = first.len();
    if second.len() != count {
        return Err(MergeError::UnequalLoops {
            loops: [count, second.len()],
        });
    }
    let mut partners = vec![None; count];
    let mut is_taken = vec![false; count];
    let mut join = |a: usize, b: usize| {
        let both_free = partners.get(a) == Some(&None) && is_taken.get(b) == Some(&false);
        if both_free {
            partners[a] = Some(b);
            is_taken[b] = true;
        }
        both_free
    };
    if !options.loops.is_empty() {
        let is_whole = options.loops.len() == count;
        let all = options.loops.iter().all(|&[a, b]| join(a, b));
        if !(is_whole && all) {
            return Err(MergeError::LoopPairs { loops: count });
        }
    }
    for [a, b] in landmarks {
        join(nearest(first, a), nearest(second, b));
    }
    // The rest: the closest pair of centres first.
    let [of_first, of_second] = [first, second].map(|loops| {
        let centers = loops.iter().map(|points| center(points));
        centers.collect::<Vec<_>>()
    });
    let mut all: Vec<(f64, usize, usize)> = Vec::with_capacity(count * count);
    for (i, a) in of_first.iter().enumerate() {
        for (j, b) in of_second.iter().enumerate() {
            all.push(((b - a).norm_squared(), i, j));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    for (_, a, b) in all {
        join(a, b);
    }
    Ok(partners.into_iter().flatten().collect())
}

fn nearest(loops: &[Vec<Point3<f64>>], point: &Point3<f64>) -> usize {
    let distance = |k: usize| {
        let distances = loops[k].iter().map(|p| (p - point).norm_squared());
        distances.fold(f64::INFINITY, f64::min)
    };
    (0..loops.len())
        .min_by(|&a, &b| distance(a).total_cmp(&distance(b)))
        .unwrap_or(0)
}

pub(super) fn center(points: &[Point3<f64>]) -> Point3<f64> {
    let sum: nalgebra::Vector3<f64> = points.iter().map(|p| p.coords).sum();
    Point3::from(sum / points.len().max(1) as f64)
}
