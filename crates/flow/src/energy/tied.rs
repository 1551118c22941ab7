//! The terms of the hybrid that ties add.

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use cotan_laplacian::Graph;
use nalgebra::{Matrix3, Vector3};

use crate::cells::{as_f64, cell_share};
use crate::four::Mat3;
use crate::rest::Rest;

/// Ties, and which rotations they mix.
///
/// R̄ = A P R, with A the identity but for vertices with ties: R̄_v = (1 − ρ) (PR)_v + ρ Σ_k b_k
/// (PR)_k with ρ = F/(1 + F), F = Σ f. Covariances are gathered by the transpose.
#[derive(Debug)]
pub(super) struct Tied {
    ties: Vec<Term>,
    mixes: Vec<Mix>,
}

/// The energy of one tie.
#[derive(Debug)]
struct Term {
    own: Vec<(u32, f64)>,
    on: Vec<(u32, f64)>,
    /// κ.
    weight: f64,
    /// r⁰.
    rest: Vector3<f64>,
    /// Half the gradient by the gap, over μ.
    force: Vector3<f64>,
}

/// One row of A.
#[derive(Debug)]
struct Mix {
    vertex: u32,
    keep: f64,
    others: Vec<(u32, f64)>,
}

impl Term {
    /// The vertices that count, with their shares of the gap.
    fn ends(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let on = self.on.iter().map(|(v, share)| (*v, -share));
        self.own.iter().copied().chain(on)
    }

    /// The vertices whose rotations turn the gap, with their shares of it.
    fn turns(&self) -> impl Iterator<Item = (u32, f64)> + '_ {
        let both = self.own.iter().chain(&self.on);
        both.map(|(v, share)| (*v, 0.5 * share))
    }

    fn gap(&self, at: impl Fn(usize) -> Vector3<f64>) -> Vector3<f64> {
        self.ends().map(|(v, c)| at(v as usize) * c).sum()
    }

    /// R r⁰.
    fn wanted(&self, means: &[Mat3]) -> Vector3<f64> {
        let turned = |(v, share): (u32, f64)| matrix(&means[v as usize]) * self.rest * share;
        self.turns().map(turned).sum()
    }
}

impl Tied {
    /// `None` without ties.
    pub(super) fn new<T: Scalar>(rest: &Rest<T>) -> Option<Self> {
        let corners = |point: &[(cotan_halfedge::VertexId, f64); 3]| {
            let terms = point.iter().filter(|(_, share)| *share != 0.0);
            terms.map(|(v, share)| (v.index() as u32, *share)).collect()
        };
        let x = rest.positions().as_slice();
        let mut pulls: Vec<(u32, u32, f64)> = Vec::new();
        let mut ties = Vec::new();
        for tie in rest.ties() {
            let mut term = Term {
                own: corners(&tie.own),
                on: corners(&tie.on),
                weight: tie.weight,
                rest: Vector3::zeros(),
                force: Vector3::zeros(),
            };
            term.rest = term.gap(|i| as_f64(x[i].coords));
            for (v, share) in &term.own {
                let near = tie.nearness * share;
                pulls.extend(term.on.iter().map(|(k, b)| (*v, *k, near * b)));
            }
            ties.push(term);
        }
        pulls.sort_by_key(|(v, k, _)| (*v, *k));
        let mixes = pulls.chunk_by(|a, b| a.0 == b.0).map(|run| {
            let sum: f64 = run.iter().map(|(.., f)| f).sum();
            Mix {
                vertex: run[0].0,
                keep: 1.0 / (1.0 + sum),
                others: run.iter().map(|(_, k, f)| (*k, f / (1.0 + sum))).collect(),
            }
        });
        let mixes = mixes.collect();
        (!ties.is_empty()).then_some(Self { ties, mixes })
    }

    /// Takes the original, scaled, for the original.
    pub(super) fn resize(&mut self, scale: f64) {
        self.ties.iter_mut().for_each(|tie| tie.rest *= scale);
    }

    /// Adds the covariances of the ties to those of the cells, which hold their shares, and hands
    /// them on as the rotations are mixed. Returns the squares and their sizes, which are the same.
    pub(super) fn gather<T: Scalar>(
        &self,
        positions: &Positions<T>,
        graph: &Graph,
        membrane: f64,
        covariances: &mut [Mat3],
    ) -> f64 {
        let x = positions.as_slice();
        let mut squares = 0.0;
        for tie in &self.ties {
            let gap = tie.gap(|i| as_f64(x[i].coords));
            let weight = membrane * tie.weight;
            squares += weight * (gap.norm_squared() + tie.rest.norm_squared());
            let outer = gap * tie.rest.transpose() * weight;
            for (v, share) in tie.turns() {
                add(covariances, graph, v, &outer, share);
            }
        }
        let whole: Vec<Matrix3<f64>> = self
            .mixes
            .iter()
            .map(|mix| {
                let v = mix.vertex as usize;
                matrix(&covariances[v]) / cell_share(graph, v)
            })
            .collect();
        for (mix, covariance) in self.mixes.iter().zip(&whole) {
            add(covariances, graph, mix.vertex, covariance, mix.keep - 1.0);
            for (k, share) in &mix.others {
                add(covariances, graph, *k, covariance, *share);
            }
        }
        squares
    }

    /// Mixes the means of the rotations. Calls `each` with every vertex whose mean has changed.
    pub(super) fn mix(&self, means: &mut [Mat3], mut each: impl FnMut(usize, &Mat3)) {
        let mixed: Vec<Mat3> = self
            .mixes
            .iter()
            .map(|mix| {
                let mut sum = means[mix.vertex as usize].map(|x| x * mix.keep);
                for (k, share) in &mix.others {
                    let other = &means[*k as usize];
                    sum.iter_mut().zip(other).for_each(|(s, x)| *s += x * share);
                }
                sum
            })
            .collect();
        for (mix, mean) in self.mixes.iter().zip(&mixed) {
            means[mix.vertex as usize] = *mean;
            each(mix.vertex as usize, mean);
        }
    }

    /// Measures the forces at these positions.
    pub(super) fn pull<T: Scalar>(&mut self, positions: &Positions<T>, means: &[Mat3]) {
        let x = positions.as_slice();
        for tie in &mut self.ties {
            let gap = tie.gap(|i| as_f64(x[i].coords));
            tie.force = (gap - tie.wanted(means)) * tie.weight;
        }
    }

    /// Measures the forces at the original positions.
    pub(super) fn pull_at_rest(&mut self, means: &[Mat3]) {
        for tie in &mut self.ties {
            tie.force = (tie.rest - tie.wanted(means)) * tie.weight;
        }
    }

    /// Adds the forces.
    pub(super) fn add_forces(&self, out: &mut VertexMap<Vector3<f64>>) {
        let out = out.as_mut_slice();
        for tie in &self.ties {
            tie.ends()
                .for_each(|(v, c)| out[v as usize] += tie.force * c);
        }
    }
}

fn matrix(entries: &Mat3) -> Matrix3<f64> {
    Matrix3::from_column_slice(entries)
}

/// Adds a share of a covariance to a vertex, times the share of a cell.
fn add(covariances: &mut [Mat3], graph: &Graph, v: u32, covariance: &Matrix3<f64>, share: f64) {
    let v = v as usize;
    let factor = share * cell_share(graph, v);
    for (entry, x) in covariances[v].iter_mut().zip(covariance.iter()) {
        *entry += x * factor;
    }
}
