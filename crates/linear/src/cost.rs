//! The predicted cost of a strategy, before anything is factorized.
//!
//! By rules of growth on closed round meshes of 100k and 655k vertices (one thread; the medians
//! to which the constants are fitted stand next to them), corrected by the analysis where one has
//! been made. Round meshes were measured: on limbed ones factors have half of these entries, for
//! both kinds of matrices alike, so the comparison stands. Seconds are those of one machine; only
//! their ratios matter.

use cotan_sparse::Precision;

/// A prediction.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Estimate {
    /// In total: for factors, columns and the expected corrections.
    pub(crate) seconds: f64,
    /// Of factors and columns together, with the work space of the factorization.
    pub(crate) bytes: u64,
}

/// The work of solving by columns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColumnsPlan {
    pub(crate) num_vertices: usize,
    /// Factors that are not there yet; only the first is analysed.
    pub(crate) new_factors: usize,
    /// Solves of a correction: as many as there are factors.
    pub(crate) solves: usize,
    /// Columns that are not there yet, and all of them.
    pub(crate) new_columns: usize,
    pub(crate) columns: usize,
    pub(crate) corrections: usize,
    /// The precision in which factors are stored.
    pub(crate) precision: Precision,
    /// Entries of the factor over those of the rule of growth.
    pub(crate) size: f64,
}

/// The normal equations with this many unknowns. `size` is that of the one-ring factor, see
/// [`ColumnsPlan::size`]: both factors grow on the same meshes.
pub(crate) fn normal(unknowns: usize, corrections: usize, size: f64) -> Estimate {
    let factor = Factor::two_rings(unknowns as f64, size);
    let seconds = factor.analysis + factor.numeric + corrections as f64 * factor.solve;
    Estimate {
        seconds,
        bytes: bytes(factor.entries + MATRIX_TWO_RINGS * unknowns as f64),
    }
}

/// Factors of the one-ring matrix and columns.
pub(crate) fn columns(plan: &ColumnsPlan) -> Estimate {
    let n = plan.num_vertices as f64;
    let factor = Factor::one_ring(n, plan.size);
    let factors = match plan.new_factors {
        0 => 0.0,
        count => factor.analysis + count as f64 * factor.numeric,
    };
    // Two solves a block of three columns, whether with one factor or with two.
    let blocks = plan.new_columns.div_ceil(3) as f64;
    let m = plan.columns as f64;
    let correction = plan.solves as f64 * factor.solve + m * (n * STREAM + m * DENSE_SOLVE);
    let seconds = factors
        + 2.0 * blocks * factor.solve
        + m.powi(3) * DENSE_FACTOR
        + plan.corrections as f64 * correction;
    let share = plan.precision.bytes() as f64 / 8.0;
    let entries = plan.solves as f64 * share * factor.entries + MATRIX_ONE_RING * n;
    Estimate {
        seconds,
        bytes: bytes(entries) + column_bytes(plan.num_vertices, plan.columns),
    }
}

/// The same with iterations in the place of the factors.
pub(crate) fn iterative(plan: &ColumnsPlan) -> Estimate {
    let n = plan.num_vertices as f64;
    let solve = ITERATIVE_SOLVE * n;
    let blocks = plan.new_columns.div_ceil(3) as f64;
    let corrections = (plan.corrections * plan.solves) as f64;
    Estimate {
        seconds: (2.0 * blocks + corrections + plan.new_factors as f64) * solve,
        bytes: bytes(plan.solves as f64 * HIERARCHY * n)
            + column_bytes(plan.num_vertices, plan.columns),
    }
}

/// Bytes of the columns of some handles and of the handles' dense system.
pub(crate) fn column_bytes(num_vertices: usize, columns: usize) -> u64 {
    let (n, m) = (num_vertices as f64, columns as f64);
    bytes(3.0 * (m / 3.0).ceil() * n + 2.0 * m * m)
}

/// Entries of the factor of a one-ring matrix by the rule of growth.
pub(crate) fn one_ring_entries(num_vertices: usize) -> f64 {
    Factor::one_ring(num_vertices as f64, 1.0).entries
}

/// Entries and seconds of one factor.
struct Factor {
    entries: f64,
    analysis: f64,
    numeric: f64,
    solve: f64,
}

impl Factor {
    /// Of L: 5.2 and 50 million entries, analysis .13 and .96 s, numeric .061 and .93 s, solve
    /// .0082 and .085 s.
    fn one_ring(n: f64, size: f64) -> Self {
        Self::of(n, size * 52.0 * n * (n / 1e5).powf(0.166), 1.28e-6)
    }

    /// Of LᵀL: 17 and 151 million entries, analysis .28 and 2.3 s, numeric .38 and 5.5 s, solve
    /// .026 and .22 s.
    fn two_rings(n: f64, size: f64) -> Self {
        Self::of(n, size * 172.0 * n * (n / 1e5).powf(0.155), 2.8e-6)
    }

    /// Both kinds follow one law in the entries, within a third.
    fn of(n: f64, entries: f64, analysis_per_vertex: f64) -> Self {
        Self {
            entries,
            analysis: analysis_per_vertex * n * (n / 1e5).max(0.01).powf(0.1),
            numeric: 0.061 * (entries / 5.2e6).powf(1.33),
            solve: 3e-8 * n + 1.2e-9 * entries,
        }
    }
}

/// Seconds to read one entry of a column and add it in, at about 10 GB/s.
const STREAM: f64 = 0.8e-9;
/// Seconds per entry of the handles' dense system: to solve it twice, and (a third of the cube) to
/// factorize it.
const DENSE_SOLVE: f64 = 1.2e-8;
const DENSE_FACTOR: f64 = 3e-10;
/// Values per vertex that the matrix takes in addition to its factor while it is factorized: index
/// and value of the lower triangle, 4 and 10 entries per vertex, and as much again for the
/// permuted matrix.
const MATRIX_ONE_RING: f64 = 16.0;
const MATRIX_TWO_RINGS: f64 = 40.0;

/// Values per vertex of a hierarchy with its work space (20 entries of 12 bytes, six vectors), and
/// seconds per vertex of a solve with it: measured on a closed mesh of 164k vertices.
const HIERARCHY: f64 = 48.0;
const ITERATIVE_SOLVE: f64 = 4.7e-6;

fn bytes(values: f64) -> u64 {
    (values * size_of::<f64>() as f64) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point_handles(n: usize, m: usize) -> Estimate {
        columns(&ColumnsPlan {
            num_vertices: n,
            new_factors: 2,
            solves: 2,
            new_columns: m,
            columns: m,
            corrections: 20,
            precision: Precision::Double,
            size: 1.0,
        })
    }

    #[test]
    fn points_take_columns_and_regions_the_normal_equations() {
        for n in [10_000, 100_000, 1_000_000, 10_000_000] {
            assert!(point_handles(n, 32).seconds < normal(n - 32, 20, 1.0).seconds);
            let region = n / 50;
            assert!(point_handles(n, region).seconds > normal(n - region, 20, 1.0).seconds);
        }
    }

    #[test]
    fn the_measured_factors_are_met_within_a_third() {
        let near = |a: f64, b: f64| assert!((a / b).ln().abs() < 0.3, "{a} {b}");
        for (n, l, normal) in [
            (1e5, [5.2e6, 0.13, 0.061, 0.0082], [17e6, 0.28, 0.38, 0.026]),
            (6.55e5, [50e6, 0.96, 0.93, 0.085], [151e6, 2.3, 5.5, 0.22]),
        ] {
            for (factor, measured) in [
                (Factor::one_ring(n, 1.0), l),
                (Factor::two_rings(n, 1.0), normal),
            ] {
                near(factor.entries, measured[0]);
                near(factor.analysis, measured[1]);
                near(factor.numeric, measured[2]);
                near(factor.solve, measured[3]);
            }
        }
    }
}
