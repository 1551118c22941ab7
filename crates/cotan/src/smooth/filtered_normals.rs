//! Smoothing by filtered face normals, using the anchored system.

use cotan_flow::{FlowError, FlowState, Orientation, PerRest, Rest};
use cotan_geometry::Scalar;
use cotan_halfedge::{FaceMap, HalfedgeMap, VertexId, VertexMap};
use cotan_laplacian::Cotangent;
use nalgebra::Vector3;

use super::normal_filter::NormalFilter;
use super::parallel::fill_each;

/// ℓ_i = Σ over the faces f at i of their cotangent-weighted edges, each projected onto the plane
/// that a [`NormalFilter`] assigns to its face: e − m_f (m_f·e).
///
/// The normals are filtered once, on the original mesh. Each step projects the edges of the
/// current mesh onto the target planes, takes the divergence with the weights of the original
/// mesh as the new Laplacian coordinates, and solves. As in every flow, the matrix is fixed and
/// the right-hand side is explicit and nonlinear. If all faces have their target normals, ℓ is
/// that of the operator itself and only the anchors move the mesh.
///
/// **Shapes**: one ℓ per vertex. **Units**: box units. The scalar field of the flow is not used.
///
/// **Source**: ours. The normals are filtered as in Zhang et al. 2015; the positions are updated
/// with the system of the paper instead of explicit steps.
#[derive(Clone, PartialEq, Debug)]
pub struct FilteredNormals {
    /// The filter of the normals.
    pub filter: NormalFilter,
    original: PerRest<Original>,
}

/// Measurements of the original mesh.
#[derive(Clone, Debug)]
struct Original {
    /// Cotangent of the angle opposite each halfedge.
    cotangents: HalfedgeMap<f64>,
    wanted: FaceMap<Vector3<f64>>,
}

impl Original {
    fn new<T: Scalar>(rest: &Rest<T>, filter: &NormalFilter) -> Self {
        let mut cotangents = HalfedgeMap::filled(rest.mesh().num_halfedges(), T::zero());
        Cotangent::default().opposite_cotangents(&rest.surface(), &mut cotangents);
        Self {
            cotangents: cotangents.map(|c| c.as_f64()),
            wanted: filter.filter(&rest.surface()),
        }
    }
}

impl FilteredNormals {
    /// Creates the orientation with this filter.
    pub fn new(filter: NormalFilter) -> Self {
        Self {
            filter,
            original: PerRest::new(),
        }
    }
}

impl<T: Scalar> Orientation<T> for FilteredNormals {
    fn orient(
        &mut self,
        state: &FlowState<'_, T>,
        _field: &VertexMap<T>,
        out: &mut VertexMap<Vector3<T>>,
    ) -> Result<(), FlowError> {
        let (rest, x) = (state.rest(), state.positions());
        let mesh = rest.mesh();
        let filter = &self.filter;
        let Original { cotangents, wanted } =
            self.original.get(rest, |rest| Original::new(rest, filter));
        let (cotangents, wanted) = (&*cotangents, &*wanted);
        fill_each(out, |v: VertexId| {
            let mut ell = Vector3::zeros();
            let copies = rest.copies_of(v).chain([v]);
            for h in copies.flat_map(|v| mesh.outgoing_halfedges(v)) {
                let Some(f) = mesh.face(h) else { continue };
                let prev = mesh.prev(h);
                let to_next = (x[mesh.row_of(mesh.target(h))] - x[v]).map(T::as_f64);
                let to_prev = (x[mesh.row_of(mesh.origin(prev))] - x[v]).map(T::as_f64);
                let part = to_next * cotangents[h] + to_prev * cotangents[prev];
                ell += part - wanted[f] * wanted[f].dot(&part);
            }
            ell.map(T::of_f64)
        });
        Ok(())
    }
}
