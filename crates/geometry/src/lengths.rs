//! Edge lengths.

use cotan_halfedge::{EdgeId, EdgeMap};

use crate::maps;
use crate::scalar::Scalar;
use crate::surface::Surface;

/// See [`Surface::edge_length`].
#[inline]
pub(crate) fn edge_length<T: Scalar>(surface: &Surface<'_, T>, edge: EdgeId) -> T {
    surface.halfedge_vector(edge.halfedge()).norm()
}

/// See [`Surface::edge_lengths`].
#[must_use]
pub(crate) fn edge_lengths<T: Scalar>(surface: &Surface<'_, T>) -> EdgeMap<T> {
    maps::filled(surface.mesh().num_edges(), |e| edge_length(surface, e))
}

/// [`Surface::edge_lengths`] into an existing map, which is replaced if its length differs.
pub fn edge_lengths_into<T: Scalar>(surface: &Surface<'_, T>, out: &mut EdgeMap<T>) {
    maps::refill(out, surface.mesh().num_edges(), |e| edge_length(surface, e));
}

/// See [`Surface::mean_edge_length`].
pub(crate) fn mean_edge_length<T: Scalar>(surface: &Surface<'_, T>) -> T {
    let num_edges = surface.mesh().num_edges();
    let total: f64 = maps::sum(num_edges, |e| edge_length(surface, e).as_f64());
    T::of_f64(total / num_edges as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::{bar, tetrahedron};

    #[test]
    fn a_cube_has_edges_and_diagonals() {
        let shape = bar::<f64>([2.0; 3], [1; 3]);
        let surface = shape.surface();
        let lengths = edge_lengths(&surface);
        let diagonal = 8.0_f64.sqrt();
        assert_eq!(lengths.values().filter(|&&l| l == 2.0).count(), 12);
        assert_eq!(
            lengths
                .values()
                .filter(|&&l| (l - diagonal).abs() < 1e-15)
                .count(),
            6
        );
        let mean = mean_edge_length(&surface);
        assert!((mean - (24.0 + 6.0 * diagonal) / 18.0).abs() < 1e-15);
    }

    #[test]
    fn f32_agrees_with_f64() {
        let mean = mean_edge_length(&tetrahedron::<f32>().surface());
        assert!((f64::from(mean) - (8.0_f64 / 3.0).sqrt()).abs() < 1e-6);
    }
}
