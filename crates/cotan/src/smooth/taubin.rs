//! Taubin's λ|μ smoothing, for comparison.

use std::mem::swap;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::{HalfedgeMesh, VertexMap};
use cotan_laplacian::OneRings;
use nalgebra::Vector3;

use super::parallel::fill_each;

/// Taubin's λ|μ: a step of the umbrella operator inwards, then a longer one outwards.
///
/// x ← x + λ U x, then x ← x + μ U x with U x_i = mean of the neighbours − x_i. This is a
/// low-pass filter that preserves the lowest frequencies and therefore roughly the volume.
///
/// **Source**: Taubin, "A signal processing approach to fair surface design", 1995, with the two
/// factors that most programs use.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Taubin {
    /// λ > 0.
    pub shrink: f64,
    /// μ < −λ.
    pub inflate: f64,
}

impl Default for Taubin {
    fn default() -> Self {
        Self {
            shrink: 0.5,
            inflate: -0.53,
        }
    }
}

impl Taubin {
    /// Performs `iterations` double steps; vertices with `is_held` stay in place.
    pub(crate) fn run<T: Scalar>(
        &self,
        mesh: &HalfedgeMesh,
        positions: &Positions<T>,
        iterations: usize,
        is_held: &[bool],
    ) -> Positions<T> {
        let rings = OneRings::new(mesh);
        let rows = mesh.to_rows(positions);
        let mut x = rows.map(|p| p.coords.map(T::as_f64));
        let mut next = x.clone();
        for _ in 0..iterations {
            for factor in [self.shrink, self.inflate] {
                umbrella_step(&rings, &x, factor, is_held, &mut next);
                swap(&mut x, &mut next);
            }
        }
        let moved = x.iter().map(|(v, x)| {
            if is_held[v.index()] {
                rows[v]
            } else {
                x.map(T::of_f64).into()
            }
        });
        mesh.to_vertices(moved.collect())
    }
}

fn umbrella_step(
    rings: &OneRings,
    x: &VertexMap<Vector3<f64>>,
    factor: f64,
    is_held: &[bool],
    out: &mut VertexMap<Vector3<f64>>,
) {
    fill_each(out, |v: cotan_halfedge::VertexId| {
        let ring = rings.ring(v.index());
        let count = ring.len();
        if is_held[v.index()] || count == 0 {
            return x[v];
        }
        // Summed as differences, so no digits are lost far from the origin.
        let pull: Vector3<f64> = ring.map(|(j, _)| x[j] - x[v]).sum();
        x[v] + pull * (factor / count as f64)
    });
}
