//! The cost of an ordering, computed by walking over the row subtrees of the elimination tree
//! (Liu 1990).

use super::level::{Level, NONE};

/// The flops of a Cholesky factorization: the sum of the squared column lengths, where every
/// vertex stands for as many rows as its weight.
///
/// Takes time proportional to the number of entries in the factor.
pub(super) fn flops(level: &Level, order: &[u32]) -> f64 {
    let lengths = column_lengths(level, order);
    let columns = order.iter().zip(&lengths);
    columns
        .map(|(&v, &length)| f64::from(level.weight(v)) * (length as f64).powi(2))
        .sum()
}

/// The length of every column of the factor, in elimination order, including the diagonal.
pub(super) fn column_lengths(level: &Level, order: &[u32]) -> Vec<u64> {
    let n = order.len();
    let mut place = vec![0u32; n];
    for (k, &v) in order.iter().enumerate() {
        place[v as usize] = k as u32;
    }
    let mut parent = vec![NONE; n];
    let mut last_row = vec![NONE; n];
    let weigh = |&v: &u32| u64::from(level.weight(v));
    let mut lengths: Vec<u64> = order.iter().map(weigh).collect();
    for (i, v) in order.iter().enumerate() {
        let weight = weigh(v);
        let i = i as u32;
        last_row[i as usize] = i;
        for &u in level.ring(*v) {
            let mut j = place[u as usize];
            while j < i && last_row[j as usize] != i {
                last_row[j as usize] = i;
                lengths[j as usize] += weight;
                if parent[j as usize] == NONE {
                    parent[j as usize] = i;
                }
                j = parent[j as usize];
            }
        }
    }
    lengths
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hub_fills_in_everything_if_it_goes_first() {
        let star = Level {
            offsets: vec![0, 3, 4, 5, 6],
            neighbours: vec![1, 2, 3, 0, 0, 0],
            weights: vec![1; 4],
        };
        assert_eq!(column_lengths(&star, &[0, 1, 2, 3]), [4, 3, 2, 1]);
        assert_eq!(column_lengths(&star, &[1, 2, 3, 0]), [2, 2, 2, 1]);
        assert_eq!(flops(&star, &[1, 2, 3, 0]), 13.0);
    }
}
