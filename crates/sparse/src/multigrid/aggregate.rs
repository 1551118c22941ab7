//! Aggregation: groups of neighbouring unknowns become the unknowns of the next level.

use crate::csr::Csr;

const NONE: u32 = u32::MAX;

/// Returns the group index of every unknown, and the number of groups.
///
/// Source: the three passes of Vaněk, Mandel, Brezina 1996, section 5.1.
pub(super) fn aggregate(matrix: &Csr, diagonal: &[f64], depth: usize) -> (Vec<u32>, usize) {
    let n = matrix.num_rows();
    // Weak couplings are ignored; coarse levels have more of them.
    let threshold = 0.08 * 0.5f64.powi(depth as i32);
    let strong = |i: usize| {
        matrix.row(i).filter_map(move |(j, value)| {
            let is_strong = j != i && -value > threshold * (diagonal[i] * diagonal[j]).abs().sqrt();
            is_strong.then_some((j, -value))
        })
    };
    let mut groups = vec![NONE; n];
    let mut num_groups = 0u32;
    // First, whole neighbourhoods form groups.
    for i in 0..n {
        if groups[i] == NONE && strong(i).all(|(j, _)| groups[j] == NONE) {
            groups[i] = num_groups;
            for (j, _) in strong(i) {
                groups[j] = num_groups;
            }
            num_groups += 1;
        }
    }
    // The remaining unknowns join the group to which they are coupled most strongly.
    let joined: Vec<u32> = (0..n)
        .map(|i| {
            if groups[i] != NONE {
                return groups[i];
            }
            strong(i)
                .filter(|&(j, _)| groups[j] != NONE)
                .max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))
                .map_or(NONE, |(j, _)| groups[j])
        })
        .collect();
    groups = joined;
    // Unknowns not coupled to any group form their own.
    for i in 0..n {
        if groups[i] == NONE {
            groups[i] = num_groups;
            for (j, _) in strong(i) {
                if groups[j] == NONE {
                    groups[j] = num_groups;
                }
            }
            num_groups += 1;
        }
    }
    (groups, num_groups as usize)
}
