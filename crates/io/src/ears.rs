//! Shortening of long polygons in space, without projecting them to a plane.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::Point3;

/// Clips the ears with the shortest new edges until at most `most` corners or no ears are left.
///
/// `rest` holds the corners in order. New edges must be free. Takes O(n log n) time.
pub(crate) fn clip_short_ears(
    rest: &mut Vec<usize>,
    most: usize,
    triangles: &mut Vec<[usize; 3]>,
    point: impl Fn(usize) -> Point3<f64>,
    is_free: impl Fn(usize, usize) -> bool,
) {
    let m = rest.len();
    let mut next: Vec<usize> = (0..m).map(|i| (i + 1) % m).collect();
    let mut prev: Vec<usize> = (0..m).map(|i| (i + m - 1) % m).collect();
    let mut is_left = vec![true; m];
    let mut num_left = m;
    // Squared lengths are not negative, so their bit patterns sort in the same order.
    let key = |i: usize, prev: &[usize], next: &[usize]| {
        let (a, b) = (prev[i], next[i]);
        let square = (point(rest[a]) - point(rest[b])).norm_squared();
        Reverse((square.to_bits(), i, a, b))
    };
    let mut heap: BinaryHeap<_> = (0..m).map(|i| key(i, &prev, &next)).collect();
    while let Some(Reverse((_, i, a, b))) = heap.pop() {
        if num_left <= most.max(3) {
            break;
        }
        let is_current = is_left[i] && (prev[i], next[i]) == (a, b);
        if !is_current || !is_free(rest[a], rest[b]) {
            continue;
        }
        triangles.push([rest[a], rest[i], rest[b]]);
        is_left[i] = false;
        num_left -= 1;
        next[a] = b;
        prev[b] = a;
        heap.push(key(a, &prev, &next));
        heap.push(key(b, &prev, &next));
    }
    let mut at = 0;
    rest.retain(|_| {
        at += 1;
        is_left[at - 1]
    });
}
