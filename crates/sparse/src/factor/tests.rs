//! Factors of random patterns in random orders, compared with dense ones.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Vector3};
use proptest::prelude::*;

use super::*;
use crate::lower::LowerTriangle;

/// A diagonally dominant matrix with the given couplings.
fn matrix(n: usize, couplings: &[(usize, usize)]) -> LowerTriangle {
    let mut entries = vec![std::collections::BTreeMap::new(); n];
    let mut diagonal = vec![1.0; n];
    for (k, &(a, b)) in couplings.iter().enumerate() {
        let (a, b) = (a % n, b % n);
        if a != b {
            let value = (k as f64).sin();
            let entry = entries[a.min(b)].entry(a.max(b)).or_insert(0.0);
            *entry += value;
            diagonal[a] += value.abs();
            diagonal[b] += value.abs();
        }
    }
    let mut lower = LowerTriangle {
        offsets: vec![0],
        rows: vec![],
        values: vec![],
    };
    for (j, column) in entries.iter().enumerate() {
        lower.rows.push(j as u32);
        lower.values.push(diagonal[j]);
        for (&i, &value) in column {
            lower.rows.push(i as u32);
            lower.values.push(value);
        }
        lower.offsets.push(lower.rows.len());
    }
    lower
}

fn dense(lower: &LowerTriangle) -> DMatrix<f64> {
    let n = lower.offsets.len() - 1;
    let mut dense = DMatrix::zeros(n, n);
    for j in 0..n {
        for k in lower.offsets[j]..lower.offsets[j + 1] {
            dense[(lower.rows[k] as usize, j)] = lower.values[k];
            dense[(j, lower.rows[k] as usize)] = lower.values[k];
        }
    }
    dense
}

/// A permutation derived from arbitrary numbers.
fn shuffled(n: usize, keys: &[u32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..n as u32).collect();
    order.sort_by_key(|&v| (keys[v as usize % keys.len()], v));
    order
}

fn right_hand_side(n: usize) -> Vec<Vector3<f64>> {
    (0..n)
        .map(|i| Vector3::new(i as f64, 2.0 * i as f64 + 0.3, 0.7 - i as f64).map(f64::sin))
        .collect()
}

/// A grid of w × h points, large enough to be divided into groups.
fn grid(w: usize, h: usize) -> LowerTriangle {
    let point = |x: usize, y: usize| y * w + x;
    let mut couplings = Vec::new();
    for y in 0..h {
        for x in 0..w {
            if x + 1 < w {
                couplings.push((point(x, y), point(x + 1, y)));
            }
            if y + 1 < h {
                couplings.push((point(x, y), point(x, y + 1)));
            }
            if x + 1 < w && y + 1 < h {
                couplings.push((point(x, y), point(x + 1, y + 1)));
            }
        }
    }
    matrix(w * h, &couplings)
}

fn solve(lower: &LowerTriangle, order: Vec<u32>, precision: Precision) -> Vec<Vector3<f64>> {
    let symbolic = Arc::new(Symbolic::analyse(lower, order));
    let factor = Factor::new(symbolic.clone(), &lower.values, precision).unwrap();
    let mut x = right_hand_side(lower.offsets.len() - 1);
    factor.solve(&mut x, &mut Buffers::new(&symbolic));
    x
}

fn residual(lower: &LowerTriangle, x: &[Vector3<f64>]) -> f64 {
    let n = x.len();
    let mut worst = 0.0f64;
    for axis in 0..3 {
        let column: Vec<f64> = x.iter().map(|x| x[axis]).collect();
        let mut product = vec![0.0; n];
        lower.multiply(&column, &mut product);
        let errors = product
            .iter()
            .zip(right_hand_side(n))
            .map(|(p, b)| (p - b[axis]).abs());
        worst = errors.fold(worst, f64::max);
    }
    worst
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn any_pattern_in_any_order_is_solved(
        n in 1usize..60,
        couplings in prop::collection::vec((0usize..60, 0usize..60), 0..200),
        keys in prop::collection::vec(any::<u32>(), 60),
    ) {
        let lower = matrix(n, &couplings);
        let inverse = dense(&lower).cholesky().unwrap();
        for (precision, bound) in [(Precision::Double, 1e-12), (Precision::Single, 1e-4)] {
            let x = solve(&lower, shuffled(n, &keys), precision);
            for axis in 0..3 {
                let b = DVector::from_iterator(n, right_hand_side(n).iter().map(|b| b[axis]));
                let expected = inverse.solve(&b);
                for (x, expected) in x.iter().zip(expected.iter()) {
                    prop_assert!((x[axis] - expected).abs() < bound);
                }
            }
        }
    }

    /// The column counts used to find supernodes match the actual elimination.
    #[test]
    fn no_entry_of_the_factor_is_missed(
        n in 1usize..40,
        couplings in prop::collection::vec((0usize..40, 0usize..40), 0..120),
        keys in prop::collection::vec(any::<u32>(), 40),
    ) {
        let lower = matrix(n, &couplings);
        let symbolic = Symbolic::analyse(&lower, shuffled(n, &keys));
        let full = dense(&lower);
        let permuted = DMatrix::from_fn(n, n, |i, j| {
            full[(symbolic.order[i] as usize, symbolic.order[j] as usize)]
        });
        let l = permuted.cholesky().unwrap().l();
        for s in 0..symbolic.num_supernodes() {
            let (start, width, rows) = symbolic.supernode(s);
            for j in start..start + width {
                for i in (start + width..n).filter(|&i| l[(i, j)] != 0.0) {
                    prop_assert!(rows.contains(&(i as u32)));
                }
            }
        }
    }
}

#[test]
fn a_divided_factor_solves_and_does_not_depend_on_the_threads() {
    let lower = grid(150, 140);
    let order = crate::ordering::order_of(&lower);
    let symbolic = Symbolic::analyse(&lower, order.clone());
    assert!(symbolic.tasks.subtrees.len() > 1 && !symbolic.tasks.top.is_empty());
    let with = |threads: usize| {
        let run = || solve(&lower, order.clone(), Precision::Double);
        cotan_parallel::on_threads(threads, run).unwrap()
    };
    let x = with(1);
    assert!(residual(&lower, &x) < 1e-12);
    assert_eq!(x, with(2));
    assert_eq!(x, with(3));
    assert!(residual(&lower, &solve(&lower, order, Precision::Single)) < 1e-4);
}

/// In its natural order a grid has one long chain of fronts.
#[test]
fn chains_and_wide_fronts_are_solved() {
    for (w, h) in [(4, 3000), (300, 40)] {
        let lower = grid(w, h);
        let natural = (0..(w * h) as u32).collect();
        assert!(residual(&lower, &solve(&lower, natural, Precision::Double)) < 1e-12);
    }
    // A dense matrix: one front, in blocks and tiles.
    let all: Vec<(usize, usize)> = (0..420).flat_map(|i| (0..i).map(move |j| (i, j))).collect();
    let lower = matrix(420, &all);
    let natural = (0..420).collect();
    assert!(residual(&lower, &solve(&lower, natural, Precision::Double)) < 1e-12);
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_refused_wherever_it_is() {
    for at in [0, 1000, 20_999] {
        let mut lower = grid(150, 140);
        let diagonal = lower.offsets[at];
        lower.values[diagonal] = -1.0;
        let symbolic = Arc::new(Symbolic::analyse(&lower, crate::ordering::order_of(&lower)));
        let error = Factor::new(symbolic, &lower.values, Precision::Double).map(|_| ());
        assert_eq!(error.unwrap_err(), FactorError::NotPositive);
    }
}

#[test]
fn new_numbers_replace_the_old_ones() {
    let lower = grid(60, 50);
    let symbolic = Arc::new(Symbolic::analyse(&lower, crate::ordering::order_of(&lower)));
    let mut factor = Factor::new(symbolic.clone(), &lower.values, Precision::Double).unwrap();
    let mut other = lower.values.clone();
    other.iter_mut().for_each(|v| *v *= 2.0);
    factor.refactor(&other).unwrap();
    let mut x = right_hand_side(3000);
    factor.solve(&mut x, &mut Buffers::new(&symbolic));
    let once = solve(&lower, crate::ordering::order_of(&lower), Precision::Double);
    assert!(
        x.iter()
            .zip(&once)
            .all(|(a, b)| (a * 2.0 - b).amax() < 1e-12)
    );
}

#[test]
fn an_empty_matrix_has_a_factor() {
    let lower = matrix(0, &[]);
    assert!(solve(&lower, vec![], Precision::Double).is_empty());
}
