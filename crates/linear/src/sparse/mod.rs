//! Sparse Cholesky factorization of our own: multifrontal, by subtrees side by side, with solves
//! of three right-hand sides that stream the factor.
//!
//! The dense kernels of large fronts are faer's, one thread each; what is around them is ours,
//! because faer's sparse factorization works through the supernodes one after the other and its
//! solve stays far from the memory's speed.

mod dense;
mod numeric;
mod packed;
mod solve;
mod symbolic;
mod tasks;

pub(crate) use numeric::{Factor, FactorError, Precision};
pub(crate) use solve::Buffers;
pub(crate) use symbolic::Symbolic;

#[cfg(test)]
mod speed {
    struct Instant(f64);
    fn cpu() -> f64 {
        if std::env::var("WALL").is_ok() {
            return std::time::SystemTime::now()
                .duration_since(std::time::UNIX_EPOCH)
                .unwrap()
                .as_secs_f64();
        }
        std::fs::read_dir("/proc/self/task")
            .unwrap()
            .map(|e| {
                std::fs::read_to_string(e.unwrap().path().join("schedstat")).map_or(0.0, |s| {
                    s.split(' ').next().unwrap().parse::<f64>().unwrap() / 1e9
                })
            })
            .sum()
    }
    impl Instant {
        fn now() -> Self {
            Self(cpu())
        }
        fn elapsed(&self) -> std::time::Duration {
            std::time::Duration::from_secs_f64((cpu() - self.0).max(1e-9))
        }
    }
    use super::*;
    use crate::normal::*;
    use cotan_geometry::shapes::icosphere;
    use cotan_laplacian::{Cotangent, Operator};
    use faer::dyn_stack::{MemBuffer, MemStack};
    use faer::linalg::cholesky::llt::factor::LltRegularization;
    use faer::sparse::linalg::cholesky::*;
    use faer::sparse::*;
    use faer::{Conj, MatMut, Par, Side, Spec};
    use nalgebra::Vector3;
    use std::sync::Arc;

    fn median(mut f: impl FnMut() -> f64, k: usize) -> f64 {
        let mut v: Vec<f64> = (0..k).map(|_| f()).collect();
        v.sort_by(f64::total_cmp);
        v[k / 2]
    }

    #[test]
    #[ignore]
    fn table() {
        let level: usize = std::env::var("LEVEL").map_or(6, |s| s.parse().unwrap());
        let normal: bool = std::env::var("NORMAL").is_ok();
        let shape = icosphere::<f64>(level as u32 as _);
        let n = shape.positions.len();
        let operator = Operator::assemble(&Cotangent::default(), &shape.surface()).unwrap();
        let rings = operator.rings();
        let weights = Weights::new(rings, operator.weights(), true);
        let free: Vec<usize> = (1..n).collect();
        let index: Vec<Option<usize>> = (0..n).map(|i| i.checked_sub(1)).collect();
        let matrix = if normal {
            crate::normal::assemble(rings, &weights, &free, &index, None, &vec![0.0; n])
        } else {
            crate::grounded::assemble(rings, &weights, &free, &index, None)
        };
        let m = n - 1;
        let t = Instant::now();
        let order = crate::cholesky::order(&matrix);
        let t_order = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let symbolic = Arc::new(Symbolic::analyse(&matrix, order));
        let t_symbolic = t.elapsed().as_secs_f64();
        println!(
            "n {m} order {t_order:.4} symbolic {t_symbolic:.4} entries {} supernodes {} Gflop {:.3} groups {} top {}",
            symbolic.num_entries(),
            symbolic.num_supernodes(),
            symbolic.flops() / 1e9,
            symbolic.tasks.subtrees.len(),
            symbolic.tasks.top.len()
        );
        let reps = if n > 200000 { 3 } else { 7 };
        let mut factor = Factor::new(symbolic.clone(), &matrix.values, Precision::Double).unwrap();
        let mut single = Factor::new(symbolic.clone(), &matrix.values, Precision::Single).unwrap();
        let numeric = median(
            || {
                let t = Instant::now();
                factor.refactor(&matrix.values).unwrap();
                t.elapsed().as_secs_f64()
            },
            reps,
        );
        let mut buffers = Buffers::new(&symbolic);
        let rhs: Vec<Vector3<f64>> = (0..m)
            .map(|i| Vector3::new((i as f64).sin(), (i as f64).cos(), 0.3))
            .collect();
        let mut x = rhs.clone();
        let solve = median(
            || {
                x.copy_from_slice(&rhs);
                let t = Instant::now();
                factor.solve(&mut x, &mut buffers);
                t.elapsed().as_secs_f64()
            },
            2 * reps + 1,
        );
        let mut xs = rhs.clone();
        let solve32 = median(
            || {
                xs.copy_from_slice(&rhs);
                let t = Instant::now();
                single.solve(&mut xs, &mut buffers);
                t.elapsed().as_secs_f64()
            },
            2 * reps + 1,
        );
        let size = x.iter().map(|v| v.amax()).fold(0.0, f64::max);
        let err = x
            .iter()
            .zip(&xs)
            .map(|(a, b)| (a - b).amax())
            .fold(0.0, f64::max)
            / size;
        if std::env::var("NUM").is_ok() {
            for _ in 0..8 {
                factor.refactor(&matrix.values).unwrap();
            }
            return;
        }
        if std::env::var("ONLY").is_ok() {
            for _ in 0..200 {
                factor.solve(&mut x, &mut buffers);
                x.copy_from_slice(&rhs);
            }
            return;
        }
        // faer
        let pattern =
            SymbolicSparseColMatRef::new_checked(m, m, &matrix.offsets, None, &matrix.rows);
        let t = Instant::now();
        let fs = factorize_symbolic_cholesky(
            pattern,
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams {
                supernodal_flop_ratio_threshold:
                    faer::sparse::linalg::SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            },
        )
        .unwrap();
        let f_symbolic = t.elapsed().as_secs_f64();
        let mut values = vec![0.0f64; fs.len_val()];
        let mut memory =
            MemBuffer::new(fs.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default()));
        let f_numeric = median(
            || {
                let t = Instant::now();
                fs.factorize_numeric_llt(
                    &mut values,
                    SparseColMatRef::new(pattern, &matrix.values),
                    Side::Lower,
                    LltRegularization::default(),
                    Par::Seq,
                    MemStack::new(&mut memory),
                    Spec::default(),
                )
                .unwrap();
                t.elapsed().as_secs_f64()
            },
            reps,
        );
        let mut scratch = MemBuffer::new(fs.solve_in_place_scratch::<f64>(3, Par::Seq));
        let mut columns = vec![0.0; 3 * m];
        let f_solve = median(
            || {
                for (i, b) in rhs.iter().enumerate() {
                    for a in 0..3 {
                        columns[a * m + i] = b[a];
                    }
                }
                let t = Instant::now();
                LltRef::new(&fs, &values).solve_in_place_with_conj(
                    Conj::No,
                    MatMut::from_column_major_slice_mut(&mut columns, m, 3),
                    Par::Seq,
                    MemStack::new(&mut scratch),
                );
                t.elapsed().as_secs_f64()
            },
            2 * reps + 1,
        );
        let ferr = x
            .iter()
            .enumerate()
            .map(|(i, a)| (a.x - columns[i]).abs())
            .fold(0.0, f64::max)
            / size;
        // bandwidth
        let big = vec![1.0f64; 16 << 20];
        let bw = median(
            || {
                let t = Instant::now();
                struct R<'a>(&'a [f64]);
                impl pulp::NullaryFnOnce for R<'_> {
                    type Output = f64;
                    #[inline(always)]
                    fn call(self) -> f64 {
                        let mut acc = [0.0f64; 32];
                        for c in self.0.chunks_exact(32) {
                            for k in 0..32 {
                                acc[k] += c[k];
                            }
                        }
                        acc.iter().sum::<f64>()
                    }
                }
                let s = pulp::Arch::new().dispatch(R(&big));
                assert!(s > 0.0);
                (big.len() * 8) as f64 / t.elapsed().as_secs_f64() / 1e9
            },
            5,
        );
        println!(
            "ours: numeric {numeric:.4} solve {solve:.5} solve32 {solve32:.5} (err32 {err:.1e}) | faer: order+symbolic {f_symbolic:.4} numeric {f_numeric:.4} solve {f_solve:.5} entries {} diff {ferr:.1e} | ratios numeric {:.2} solve {:.2} bound {:.2} (bw {bw:.1})",
            values.len(),
            numeric / f_numeric,
            solve / f_solve,
            solve / (2.0 * symbolic.num_entries() as f64 * 8.0 / bw / 1e9)
        );
    }
}
