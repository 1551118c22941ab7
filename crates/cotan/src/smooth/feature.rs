//! Smoothing that preserves creases, with the field defined on edges.

use cotan_flow::{FlowError, FlowState, Orientation, PerRest, Rest};
use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{EdgeId, EdgeMap, HalfedgeId, VertexMap};
use nalgebra::Vector3;

use super::parallel::fill_each;

/// ℓ_i = −Σ_e 2 sin(θ_e/2) |e| N_e over the edges at i, with the dihedral angles θ filtered by a
/// bilateral mean over edges that share a vertex.
///
/// θ is positive where the surface is convex, and N_e is the unit bisector of the normals of the
/// two faces. With unfiltered angles this is an identity of the cotangent Laplacian. The weight
/// of edge f in the mean at e is exp(−(θ_e − θ_f)²/2σ²), and 1 for e itself. σ is the median of
/// |θ| of the original mesh, clamped to 1° … 20°, so that noise is averaged but creases are not.
///
/// **Shapes**: one ℓ per vertex. **Units**: box units. Boundary edges have no angle.
///
/// The scalar field of the flow is not used: where the paper has one value per vertex, this has
/// one per edge ("from vertex-based to edge-based", its section 5).
///
/// **Source**: ours, following the hint in section 5.
#[derive(Clone, PartialEq, Debug)]
pub struct FeaturePreserving {
    /// The number of averaging passes over the angles per step.
    pub passes: usize,
    sigma: PerRest<f64>,
}

impl Default for FeaturePreserving {
    fn default() -> Self {
        Self {
            passes: 3,
            sigma: PerRest::new(),
        }
    }
}

const NARROWEST: f64 = std::f64::consts::PI / 180.0;
const WIDEST: f64 = 20.0 * NARROWEST;

impl<T: Scalar> Orientation<T> for FeaturePreserving {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        _field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let sigma = *self.sigma.get(state.rest(), median_angle);
        let positions = state.vertex_positions();
        let surface = Surface::assume_checked(state.rest().mesh(), &positions);
        let mut angles = surface.dihedral_angles().map(|a| a.as_f64());
        for _ in 0..self.passes {
            average(state, sigma, &mut angles);
        }
        let bends = edge_bends(&surface, &angles);
        let rings = state.rest().rings();
        fill_each(out, |v: cotan_halfedge::VertexId| {
            let ring = rings.ring(v.index());
            let bend = |k| rings.halfedges_of(k).iter().map(|h| bends[h.edge()]);
            let sum: Vector3<f64> = ring.flat_map(|(_, k)| bend(k)).sum();
            (-sum).map(T::of_f64)
        });
        Ok(())
    }
}

/// σ: the clamped median of |θ| of the original mesh.
fn median_angle<T: Scalar>(rest: &Rest<T>) -> f64 {
    let angles = rest.surface().dihedral_angles();
    let mesh = rest.mesh();
    let inner = angles.iter().filter(|(e, _)| !mesh.is_boundary_edge(*e));
    let mut sizes: Vec<f64> = inner.map(|(_, a)| a.abs().as_f64()).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    median.clamp(NARROWEST, WIDEST)
}

/// The bilateral mean of the angles over edges that share a vertex.
fn average<T: Scalar>(state: &FlowState<'_, T>, sigma: f64, angles: &mut EdgeMap<f64>) {
    let (mesh, rings) = (state.rest().mesh(), state.rest().rings());
    let before = angles.clone();
    fill_each(angles, |e: EdgeId| {
        let own = before[e];
        let (mut sum, mut weights) = (own, 1.0);
        for v in mesh.edge_vertices(e) {
            let row = rings.graph().range(mesh.row_of(v).index());
            for h in row.flat_map(|k| rings.halfedges_of(k)) {
                let other = h.edge();
                if other != e && !mesh.is_boundary_edge(other) {
                    let off = (before[other] - own) / sigma;
                    let weight = (-0.5 * off * off).exp();
                    sum += weight * before[other];
                    weights += weight;
                }
            }
        }
        if mesh.is_boundary_edge(e) {
            own
        } else {
            sum / weights
        }
    });
}

/// 2 sin(θ/2) |e| N of each edge; 0 on the boundary and where the two normals are opposite.
fn edge_bends<T: Scalar>(surface: &Surface<'_, T>, angles: &EdgeMap<f64>) -> EdgeMap<Vector3<f64>> {
    let mesh = surface.mesh();
    let normals = surface.face_normals();
    let mut bends = EdgeMap::filled(mesh.num_edges(), Vector3::zeros());
    fill_each(&mut bends, |e: EdgeId| {
        let normal = |h: HalfedgeId| mesh.face(h).map(|f| normals[f].map(T::as_f64));
        let [h, twin] = e.halfedges();
        let (Some(left), Some(right)) = (normal(h), normal(twin)) else {
            return Vector3::zeros();
        };
        let length = surface.halfedge_vector(h).norm().as_f64();
        let bisector = cotan_geometry::unit_or_zero(&(left + right));
        bisector * (2.0 * (0.5 * angles[e]).sin() * length)
    });
    bends
}

#[cfg(test)]
mod tests {
    use cotan_geometry::shapes::torus;
    use cotan_geometry::vertex_area_vectors;
    use cotan_laplacian::{Cotangent, Operator};

    use super::*;
    use crate::smooth::with_normal_noise;

    /// ℓ_i = −Σ_e 2 sin(θ_e/2) |e| N_e holds for any closed surface.
    #[test]
    fn the_edges_make_up_the_cotangent_laplacian() {
        let shape = torus::<f64>(1.0, 0.4, 24, 12);
        let x = with_normal_noise(&shape.surface(), 0.03, 2);
        let surface = shape.surface();
        let surface = surface.with_positions(&x);
        let bends = edge_bends(&surface, &surface.dihedral_angles());
        let operator = Operator::assemble(&Cotangent::default(), &surface).unwrap();
        for v in shape.connectivity().vertices() {
            let sum: Vector3<f64> = shape
                .connectivity()
                .outgoing_halfedges(v)
                .map(|h| bends[h.edge()])
                .sum();
            let ell = operator.apply_at(&x, v.index());
            assert!((ell + sum).norm() < 1e-12);
        }
        assert_eq!(vertex_area_vectors(&surface).len(), x.len());
    }
}
