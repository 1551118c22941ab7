//! The built-in schemes, which are plain values.

use cotan_geometry::{Scalar, Surface, opposite_cotangents_with_floor_into, scalar};
use cotan_halfedge::{EdgeId, HalfedgeMap, VertexMap};
use nalgebra::Vector3;

use crate::exact::update_edges;
use crate::fans::{FanSums, Fans};
use crate::scheme::{Copies, LaplacianScheme, SchemeError, Symmetry};

/// w_ij = cot α_ij + cot β_ij, the curvature-flow weights (paper, equation 6; no ½).
///
/// α and β are the angles opposite the edge; a boundary edge has only one of them. Weights are
/// negative where α + β > 180° and are *left negative*: clamping them in the system makes the
/// flow diverge (see [`ClampedCotangent`]).
///
/// The cotangent is (a·b) / max(|a × b|, `area_floor` · Σ e²), where e are the three edges of the
/// triangle. Only triangles thinner than the floor, whose cotangent would be meaningless or
/// infinite, are affected.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cotangent {
    /// Lower bound for twice the area of a triangle, relative to the sum of its squared edge
    /// lengths (dimensionless).
    pub area_floor: f64,
}

impl Default for Cotangent {
    fn default() -> Self {
        // Angles below 2e-6 radians carry no shape information. With a floor of 1e-12, a
        // zero-area triangle would have weights of 1e12, whose squares swamp all other digits of
        // the normal equations.
        Self { area_floor: 1e-6 }
    }
}

impl Cotangent {
    /// Computes the cotangent of the angle opposite each halfedge in its triangle, or 0 on the
    /// boundary. w_ij is the sum over the two sides of the edge.
    ///
    /// **Shapes**: one entry per halfedge; `out` is replaced if its length differs.
    pub fn opposite_cotangents<T: Scalar>(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) {
        opposite_cotangents_with_floor_into(surface, scalar(self.area_floor), out);
    }
}

/// The cotangent weights with each w_ij raised to at least `floor`.
///
/// This is a convex-combination operator, for maps that must not flip. It is a poor choice for
/// the system of a deformation: linear precision is lost, so flat regions get tangential
/// coordinates.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ClampedCotangent {
    /// The smallest weight (dimensionless; an equilateral mesh has weights of 1.15).
    pub floor: f64,
    /// The weights that are clamped.
    pub cotangent: Cotangent,
}

impl Default for ClampedCotangent {
    fn default() -> Self {
        Self {
            floor: 0.01,
            cotangent: Cotangent::default(),
        }
    }
}

/// w_ij = 1 / valence(i): the Tutte Laplacian of the paper's section 4.1. Not symmetric, and not
/// defined for a mesh that was cut into pieces.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Tutte;

/// w_ij = 1: the graph Laplacian.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Uniform;

/// w_ij = |e_ij|⁻¹ / mean of |e|⁻¹: Fujiwara's weights, normalized to be dimensionless.
///
/// Edges shorter than 1e-9 of the mean length are treated as having that length.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct EdgeLength;

impl<T: Scalar> LaplacianScheme<T> for Cotangent {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        self.opposite_cotangents(surface, out);
        per_edge_pair(out, |a, b| a + b);
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn measure(
        &self,
        surface: &Surface<'_, T>,
        fans: &Fans,
        _weights: &mut HalfedgeMap<T>,
        laplacian: &mut VertexMap<Vector3<T>>,
        sums: &mut FanSums<T>,
    ) -> Result<(), SchemeError> {
        let floor = scalar(self.area_floor);
        fans.areas_and_cotangent_laplacian(surface.positions(), floor, laplacian, sums);
        Ok(())
    }

    fn copies(&self) -> Copies {
        Copies::Sum
    }

    fn name(&self) -> &str {
        "cotangent"
    }
}

impl<T: Scalar> LaplacianScheme<T> for ClampedCotangent {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        self.cotangent.opposite_cotangents(surface, out);
        let floor = scalar::<T>(self.floor);
        per_edge_pair(out, |a, b| (a + b).max(floor));
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn copies(&self) -> Copies {
        Copies::Sum
    }

    fn name(&self) -> &str {
        "clamped cotangent"
    }
}

impl<T: Scalar> LaplacianScheme<T> for Tutte {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        let mesh = surface.mesh();
        for vertex in mesh.vertices() {
            let weight = T::one() / scalar(mesh.valence(vertex) as f64);
            for h in mesh.outgoing_halfedges(vertex) {
                out[h] = weight;
            }
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::General
    }

    fn name(&self) -> &str {
        "Tutte"
    }
}

impl<T: Scalar> LaplacianScheme<T> for Uniform {
    fn weights(
        &self,
        _surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        out.as_mut_slice().fill(T::one());
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn copies(&self) -> Copies {
        Copies::Mean
    }

    fn name(&self) -> &str {
        "uniform"
    }
}

impl<T: Scalar> LaplacianScheme<T> for EdgeLength {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        per_edge(out, |edge| surface.halfedge_vector(edge.halfedge()).norm());
        let count = scalar::<T>(out.len().max(1) as f64);
        let mean = out.values().fold(T::zero(), |sum, &l| sum + l) / count;
        let shortest = mean * scalar(1e-9);
        if shortest <= T::zero() {
            return Err(SchemeError::Unsuitable {
                scheme: "edge-length".into(),
                reason: "all its edges have length zero".into(),
            });
        }
        out.values_mut()
            .for_each(|l| *l = T::one() / l.max(shortest));
        let mean = out.values().fold(T::zero(), |sum, &w| sum + w) / count;
        out.values_mut().for_each(|w| *w /= mean);
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn copies(&self) -> Copies {
        Copies::Mean
    }

    fn name(&self) -> &str {
        "edge-length"
    }
}

/// Sets both halfedges of each edge to the same value, in parallel.
fn per_edge<T: Scalar>(out: &mut HalfedgeMap<T>, weight: impl Fn(EdgeId) -> T + Sync) {
    update_edges(out, |edge, pair| pair.fill(weight(edge)));
}

/// Replaces the two values of each edge by a combination of both.
fn per_edge_pair<T: Scalar>(out: &mut HalfedgeMap<T>, combine: impl Fn(T, T) -> T) {
    for pair in out.as_mut_slice().chunks_exact_mut(2) {
        pair.fill(combine(pair[0], pair[1]));
    }
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::{bar, icosphere, torus};

    use super::*;

    fn weights<S: LaplacianScheme<f64>>(scheme: S, surface: &Surface<'_, f64>) -> HalfedgeMap<f64> {
        let mut out = HalfedgeMap::filled(surface.mesh().num_halfedges(), f64::NAN);
        scheme.weights(surface, &mut out).unwrap();
        out
    }

    #[test]
    fn equilateral_triangles_have_twice_the_cotangent_of_60_degrees() {
        let shape = icosphere::<f64>(0);
        let expected = 2.0 / 3.0f64.sqrt();
        let cotangent = weights(Cotangent::default(), &shape.surface());
        assert!(cotangent.values().all(|w| (w - expected).abs() < 1e-12));
    }

    #[test]
    fn diagonals_of_a_square_grid_weigh_nothing() {
        let shape = bar::<f64>([2.0, 2.0, 2.0], [4, 4, 4]);
        let cotangent = weights(Cotangent::default(), &shape.surface());
        let small = cotangent.values().filter(|w| w.abs() < 1e-12).count();
        // One diagonal per cell, 16 cells on each of six sides, two halfedges each.
        assert_eq!(small, 2 * 16 * 6);
    }

    #[test]
    fn a_degenerate_triangle_is_floored() {
        let mut shape = icosphere::<f64>(1);
        let v = cotan_halfedge::VertexId::new(0);
        let neighbour = shape.connectivity().one_ring(v).next().unwrap();
        shape.positions_mut()[v.index()] = shape.positions()[neighbour];
        let cotangent = weights(Cotangent::default(), &shape.surface());
        assert!(cotangent.values().all(|w| w.abs() < 2e6));
    }

    #[test]
    fn clamped_weights_are_at_least_the_floor_and_else_the_cotangent() {
        let shape = torus::<f64>(1.0, 0.4, 9, 30);
        let plain = weights(Cotangent::default(), &shape.surface());
        let clamped = ClampedCotangent {
            floor: 0.3,
            ..ClampedCotangent::default()
        };
        let clamped = weights(clamped, &shape.surface());
        for (a, b) in plain.values().zip(clamped.values()) {
            assert_eq!(a.max(0.3), *b);
        }
        assert!(plain.values().any(|w| *w < 0.3));
    }

    #[test]
    fn tutte_weights_sum_to_one_around_a_vertex() {
        let shape = icosphere::<f64>(2);
        let tutte = weights(Tutte, &shape.surface());
        for v in shape.connectivity().vertices() {
            let sum: f64 = shape
                .connectivity()
                .outgoing_halfedges(v)
                .map(|h| tutte[h])
                .sum();
            assert!((sum - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn edge_length_weights_fall_with_length_and_average_one() {
        let shape = torus::<f64>(1.0, 0.4, 9, 30);
        let surface = shape.surface();
        let w = weights(EdgeLength, &surface);
        let mean = w.values().sum::<f64>() / w.len() as f64;
        assert!((mean - 1.0).abs() < 1e-12);
        let product = |e: EdgeId| w[e.halfedge()] * surface.halfedge_vector(e.halfedge()).norm();
        let first = product(EdgeId::new(0));
        assert!(
            shape
                .connectivity()
                .edges()
                .all(|e| (product(e) / first - 1.0).abs() < 1e-12)
        );
    }
}
