//! The passes over all vertices by which the hybrid fits its rotations.

use cotan_geometry::Scalar;
use cotan_laplacian::Graph;
use nalgebra::{Point3, Vector3};

use super::struts::Strut;
use crate::cells::{Means, as_f64, cell_share, four_of};
use crate::four::{Columns, Four, IDENTITY, Mat3, turned};
use crate::nearest_rotation::nearest_rotations_from;
use crate::orientation::field_scale;
use crate::passes::{Pass, PassOfTwo};
use crate::rest::Rest;

/// The input of the first pass of a fit.
pub(super) struct CellsAt<'a, T: Scalar> {
    pub(super) rest: &'a Rest<T>,
    pub(super) graph: &'a Graph,
    pub(super) positions: &'a [Point3<T>],
    pub(super) field: &'a [T],
    pub(super) gradients: &'a [[f64; 3]],
    /// μ/4, the weight of both halves of every edge.
    pub(super) membrane: f64,
    /// One per vertex, or none at all.
    pub(super) struts: &'a [Strut],
    /// `true` if the struts harden.
    pub(super) is_hard: bool,
    /// μ.
    pub(super) weight: f64,
    pub(super) size: f64,
}

/// Writes the covariances of the triangles around the vertices times their shares, and L⁰x.
/// Returns the squares: as they enter the energy, and their sizes.
impl<T: Scalar> PassOfTwo<Mat3, Vector3<f64>, 2> for CellsAt<'_, T> {
    #[inline(always)]
    fn on(&self, first: usize, entries: &mut [Mat3], laplacian: &mut [Vector3<f64>]) -> [f64; 2] {
        match self.struts.is_empty() {
            true => self.gather::<false>(first, entries, laplacian),
            false => self.gather::<true>(first, entries, laplacian),
        }
    }
}

impl<T: Scalar> CellsAt<'_, T> {
    /// The pass with or without struts, each compiled on its own: a shell does not pay for them.
    #[inline(always)]
    fn gather<const HAS_STRUTS: bool>(
        &self,
        first: usize,
        entries: &mut [Mat3],
        laplacian: &mut [Vector3<f64>],
    ) -> [f64; 2] {
        let (neighbours, x) = (self.graph.neighbours(), self.positions);
        let weights = self.rest.operator().weights();
        let cotangents = self.rest.membrane_weights();
        let [mut flow, mut stretch, mut size] = [0.0; 3];
        for (k, (entry, ell)) in entries.iter_mut().zip(laplacian).enumerate() {
            let i = first + k;
            let row = self.graph.range(i);
            let own = Four::of_point(&x[i]);
            let mut sum = Columns::ZERO;
            let [mut now, mut squares, mut sizes] = [Four::ZERO; 3];
            for (((j, g), w), c) in neighbours[row.clone()]
                .iter()
                .zip(&self.gradients[row.clone()])
                .zip(&weights[row.clone()])
                .zip(&cotangents[row])
            {
                let edge = Four::of_point(&x[j.index()]) - own;
                sum.add_outer(edge, g);
                now += edge * Four::all(*w);
                let terms = edge * edge;
                squares += terms * Four::all(*c);
                sizes += terms * Four::all(c.abs());
            }
            *ell = now.vector().into();
            let wanted = wanted(self.rest, self.field, i, self.size);
            sum.add_outer(now, &wanted);
            if HAS_STRUTS
                && let Some(strut) = self.struts.get(i)
                && strut.weight > 0.0
            {
                let span = strut.span(own, x);
                let weight = self.weight * strut.weight;
                sum.add_outer(span * Four::all(weight), &strut.rest);
                flow += weight * (span * span).sum();
                if self.is_hard {
                    flow += self.weight * strut.hardness(span).energy;
                }
            }
            *entry = sum.times(cell_share(self.graph, i));
            let wanted = Four::of_vector(&wanted);
            flow += (now * now + wanted * wanted).sum();
            stretch += squares.sum();
            size += sizes.sum();
        }
        [flow + self.membrane * stretch, flow + self.membrane * size]
    }
}

/// Fits the rotations. Returns the sum of R_i : C_i.
pub(super) struct Fits<'a> {
    pub(super) means: Means<'a>,
    /// An addition to the covariances; empty for none.
    pub(super) drawn_to: &'a [Mat3],
}

impl Pass<Mat3, 1> for Fits<'_> {
    #[inline(always)]
    fn on(&self, first: usize, rotations: &mut [Mat3]) -> [f64; 1] {
        match self.drawn_to.is_empty() {
            true => self.fit::<false>(first, rotations),
            false => self.fit::<true>(first, rotations),
        }
    }
}

impl Fits<'_> {
    /// The pass with or without additions, each compiled on its own.
    #[inline(always)]
    fn fit<const IS_DRAWN: bool>(&self, first: usize, rotations: &mut [Mat3]) -> [f64; 1] {
        let n = rotations.len();
        let mut cross = 0.0;
        for at in (0..n).step_by(4) {
            let mut covariances = [IDENTITY; 4];
            for lane in 0..4 {
                let i = first + (at + lane).min(n - 1);
                covariances[lane] = self.means.sum(i, 1.0);
                if IS_DRAWN && let Some(to) = self.drawn_to.get(i) {
                    for (entry, x) in covariances[lane].iter_mut().zip(to) {
                        *entry += x;
                    }
                }
            }
            let mut found = four_of(rotations, at);
            nearest_rotations_from(&covariances, &mut found);
            for lane in 0..4.min(n - at) {
                let (r, c) = (&found[lane], &covariances[lane]);
                let products = Four::of_entries(r, 0) * Four::of_entries(c, 0)
                    + Four::of_entries(r, 4) * Four::of_entries(c, 4);
                cross += products.sum() + r[8] * c[8];
                rotations[at + lane] = *r;
            }
        }
        [cross]
    }
}

/// Writes the means of the rotations, and the Laplacian coordinates that they turn.
pub(super) struct Turning<'a, T: Scalar> {
    pub(super) means: Means<'a>,
    pub(super) rest: &'a Rest<T>,
    pub(super) field: &'a [T],
    pub(super) size: f64,
}

impl<T: Scalar> PassOfTwo<Mat3, Vector3<T>, 0> for Turning<'_, T> {
    #[inline(always)]
    fn on(&self, first: usize, means: &mut [Mat3], ell: &mut [Vector3<T>]) -> [f64; 0] {
        for (k, (mean, ell)) in means.iter_mut().zip(ell).enumerate() {
            *mean = self.means.mean(first + k);
            let [x, y, z] =
                turned(mean, &wanted(self.rest, self.field, first + k, self.size)).vector();
            *ell = Vector3::new(T::of_f64(x), T::of_f64(y), T::of_f64(z));
        }
        []
    }
}

/// Writes the pull that is wanted of the membrane's edges.
pub(super) struct Tensions<'a> {
    pub(super) graph: &'a Graph,
    pub(super) gradients: &'a [[f64; 3]],
    pub(super) own: &'a [[f64; 3]],
    pub(super) means: &'a [Mat3],
}

impl Pass<Vector3<f64>, 0> for Tensions<'_> {
    #[inline(always)]
    fn on(&self, first: usize, entries: &mut [Vector3<f64>]) -> [f64; 0] {
        for (k, entry) in entries.iter_mut().enumerate() {
            let row = self.graph.range(first + k);
            let mut tension = Four::ZERO;
            for (j, g) in self.graph.neighbours()[row.clone()]
                .iter()
                .zip(&self.gradients[row])
            {
                tension += turned(&self.means[j.index()], g);
            }
            tension += turned(&self.means[first + k], &self.own[first + k]);
            *entry = tension.vector().into();
        }
        []
    }
}

/// ℓ⁰ of vertex `i`, of the size that the field prescribes, times a factor.
#[inline(always)]
pub(super) fn wanted<T: Scalar>(rest: &Rest<T>, field: &[T], i: usize, size: f64) -> [f64; 3] {
    let scale = field_scale(field[i], rest.magnitudes().as_slice()[i]);
    let ell = &rest.laplacian().as_slice()[i];
    [
        (ell.x * scale).as_f64() * size,
        (ell.y * scale).as_f64() * size,
        (ell.z * scale).as_f64() * size,
    ]
}

/// Σ_j c_ij |x⁰_j − x⁰_i|² with c the cotangent weights, and the same of their sizes.
pub(super) fn stretch<T: Scalar>(rest: &Rest<T>, i: usize) -> [f64; 2] {
    let x = rest.positions().as_slice();
    let row = rest.graph().range(i);
    let neighbours = rest.graph().neighbours()[row.clone()].iter();
    neighbours
        .zip(&rest.membrane_weights()[row])
        .fold([0.0; 2], |[value, size], (j, c)| {
            let term = c * as_f64(x[j.index()] - x[i]).norm_squared();
            [value + term, size + term.abs()]
        })
}
