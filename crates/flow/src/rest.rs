//! What the flow remembers of the original mesh.

use std::sync::{Arc, OnceLock};

use cotan_geometry::{Positions, Scalar, Surface, surface_centroid, unit_or_zero};
use cotan_halfedge::{HalfedgeId, HalfedgeMap, HalfedgeMesh, VertexMap};
use cotan_laplacian::{
    Cotangent, FanSums, Fans, Graph, LaplacianScheme, OneRings, Operator, RowId, SchemeError,
    Symmetry,
};
use nalgebra::Vector3;

use crate::box_units::BoxUnits;
use crate::error::FlowError;

/// The original mesh in box units, its operator, and its Laplacian coordinates split into their
/// parts.
///
/// It owns the mesh, or shares it: one rest shape can serve several flows, on several threads.
pub struct Rest<T: Scalar> {
    identity: Identity,
    mesh: Arc<HalfedgeMesh>,
    original: Arc<Positions<T>>,
    units: BoxUnits<T>,
    scheme: Arc<dyn LaplacianScheme<T>>,
    operator: Operator<T>,
    fans: Fans,
    positions: Positions<T>,
    laplacian: VertexMap<Vector3<T>>,
    magnitudes: VertexMap<T>,
    normals: VertexMap<Vector3<T>>,
    areas: VertexMap<T>,
    /// Cotangent of the angle opposite each halfedge, 0 on the boundary.
    cotangents: HalfedgeMap<f64>,
    /// Cotangent weights, row after row; `None` where they are the operator's own.
    row_cotangents: Option<Vec<f64>>,
    /// The halfedge of each entry of the graph, if it has pairs that are no edges.
    row_halfedges: Option<Vec<Option<HalfedgeId>>>,
    halfedge_weights: OnceLock<HalfedgeMap<f64>>,
}

/// Tells one rest shape from another.
#[derive(Clone, Debug)]
pub(crate) struct Identity(Arc<()>);

impl Identity {
    pub(crate) fn is_of<T: Scalar>(&self, rest: &Rest<T>) -> bool {
        Arc::ptr_eq(&self.0, &rest.identity.0)
    }
}

impl<T: Scalar> std::fmt::Debug for Rest<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Rest")
            .field("vertices", &self.positions.len())
            .field("scheme", &self.scheme.name())
            .field("units", &self.units)
            .finish_non_exhaustive()
    }
}

impl<T: Scalar> Rest<T> {
    /// Measures a mesh and assembles its operator with the weights of `scheme`.
    ///
    /// **Shapes**: one position per vertex, in any unit.
    ///
    /// # Errors
    /// [`FlowError`] for a mesh that is no surface or has no extent, and what the scheme reports.
    pub fn new(
        mesh: impl Into<Arc<HalfedgeMesh>>,
        positions: impl Into<Arc<Positions<T>>>,
        scheme: impl LaplacianScheme<T> + 'static,
    ) -> Result<Self, FlowError> {
        Self::measure(mesh.into(), positions.into(), Arc::new(scheme))
    }

    pub(crate) fn measure(
        mesh: Arc<HalfedgeMesh>,
        original: Arc<Positions<T>>,
        scheme: Arc<dyn LaplacianScheme<T>>,
    ) -> Result<Self, FlowError> {
        let n = mesh.num_vertices();
        let units = BoxUnits::of(&Surface::new(&mesh, &original)?)?;
        let positions = units.to_box_all(&original);
        let surface = Surface::new(&mesh, &positions)?;
        let rings = Arc::new(OneRings::new(&mesh));
        let operator = scheme.operator(&rings, &surface)?;
        let (operator, row_halfedges) = if operator.graph() == rings.graph() {
            (operator, None)
        } else {
            let (operator, halfedges) = with_edges(&operator, &rings)?;
            (operator, Some(halfedges))
        };
        let mut laplacian = VertexMap::filled(n, Vector3::zeros());
        operator.apply(&positions, &mut laplacian);
        let magnitudes = laplacian.map(|ell| ell.norm());
        // As the current mesh is measured, to the last digit: a shape at rest shows no change.
        let fans = Fans::new(&mesh, rings.clone());
        let mut sums = FanSums::default();
        fans.areas(&positions, &mut sums);
        let mut cotangents = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
        Cotangent::default().opposite_cotangents(&surface, &mut cotangents);
        // With the weights of the same cotangents K is L/2 to the last digit, and one array serves
        // both.
        let own = Operator::assemble_on(
            &rings,
            &SumOf {
                cotangents: &cotangents,
            },
            &surface,
        );
        let is_cotangent = own.is_ok_and(|own| own.weights() == operator.weights());
        let cotangents = cotangents.map(|c| c.as_f64());
        let row_cotangents = (!is_cotangent).then(|| {
            let both = |h: &HalfedgeId| cotangents[*h] + cotangents[h.twin()];
            match &row_halfedges {
                None => rings.halfedges().iter().map(both).collect(),
                Some(rows) => rows.iter().map(|h| h.as_ref().map_or(0.0, both)).collect(),
            }
        });
        Ok(Self {
            identity: Identity(Arc::new(())),
            normals: sums.area_vectors.map(unit_or_zero),
            areas: sums.areas,
            mesh,
            original,
            units,
            scheme,
            operator,
            fans,
            positions,
            laplacian,
            magnitudes,
            cotangents,
            row_cotangents,
            row_halfedges,
            halfedge_weights: OnceLock::new(),
        })
    }

    pub(crate) fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The unit in which everything here is given.
    pub fn box_units(&self) -> &BoxUnits<T> {
        &self.units
    }

    /// The original positions as they came, in the units of the input.
    pub fn original_positions(&self) -> &Arc<Positions<T>> {
        &self.original
    }

    /// The connectivity, to be shared.
    pub fn shared_mesh(&self) -> &Arc<HalfedgeMesh> {
        &self.mesh
    }

    /// The scheme that chose the weights.
    pub fn scheme(&self) -> &dyn LaplacianScheme<T> {
        &*self.scheme
    }

    /// The mesh with its original positions, in box units.
    pub fn surface(&self) -> Surface<'_, T> {
        Surface::assume_checked(&self.mesh, &self.positions)
    }

    /// The connectivity.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The operator of the original mesh, L⁰.
    pub fn operator(&self) -> &Operator<T> {
        &self.operator
    }

    /// The one-rings, for sums over neighbours.
    pub fn rings(&self) -> &Arc<OneRings> {
        self.fans.rings()
    }

    /// The graph of the operator: rows and their neighbours. All edges of the mesh are in it, and
    /// for some schemes further pairs.
    pub fn graph(&self) -> &Arc<Graph> {
        self.operator.graph()
    }

    /// The operator's weights w_ij by halfedge i→j, for loops over edges; gathered when they are
    /// first asked for.
    pub fn halfedge_weights(&self) -> &HalfedgeMap<f64> {
        self.halfedge_weights.get_or_init(|| {
            let Some(rows) = &self.row_halfedges else {
                return self.rings().by_halfedge(self.operator.weights());
            };
            let mut weights = HalfedgeMap::filled(self.mesh.num_halfedges(), 0.0);
            for (h, weight) in rows.iter().zip(self.operator.weights()) {
                if let Some(h) = h {
                    weights[*h] = *weight;
                }
            }
            weights
        })
    }

    /// The halfedge along an entry of [`Self::graph`]; `None` for a pair that is no edge.
    ///
    /// # Panics
    /// If there is no such entry.
    #[inline]
    pub fn halfedge_of(&self, entry: usize) -> Option<HalfedgeId> {
        match &self.row_halfedges {
            None => Some(self.rings().halfedges()[entry]),
            Some(rows) => rows[entry],
        }
    }

    /// Returns true if every pair of the operator is an edge of the mesh.
    pub fn is_on_edges(&self) -> bool {
        self.row_halfedges.is_none()
    }

    /// The triangles around each vertex.
    pub(crate) fn fans(&self) -> &Fans {
        &self.fans
    }

    /// The original positions, in box units.
    pub fn positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// The original Laplacian coordinates ℓ⁰, in box units.
    pub fn laplacian(&self) -> &VertexMap<Vector3<T>> {
        &self.laplacian
    }

    /// The original scalar field |ℓ⁰|, in box units.
    pub fn magnitudes(&self) -> &VertexMap<T> {
        &self.magnitudes
    }

    /// The original unit vertex normals N⁰ (zero where undefined).
    pub fn normals(&self) -> &VertexMap<Vector3<T>> {
        &self.normals
    }

    /// The original areas A⁰: sums over the triangles around each vertex, in box units squared.
    pub fn areas(&self) -> &VertexMap<T> {
        &self.areas
    }

    /// Diagonal of the bounding box, in box units (between 1 and √3).
    pub fn diagonal(&self) -> T {
        self.units.diagonal()
    }

    /// Cotangent of the angle opposite each halfedge, 0 on the boundary.
    pub(crate) fn cotangents(&self) -> &HalfedgeMap<f64> {
        &self.cotangents
    }

    /// The cotangent weights, whatever the scheme, one per entry of [`Self::graph`], row after
    /// row: twice the stiffness of the membrane.
    pub fn membrane_weights(&self) -> &[f64] {
        let own = self.row_cotangents.as_deref();
        own.unwrap_or_else(|| self.operator.weights())
    }

    /// Whether the operator's weights are the cotangents, so that the membrane's edges pull by half
    /// of L⁰x.
    pub(crate) fn has_own_cotangents(&self) -> bool {
        self.row_cotangents.is_none()
    }

    /// Σ_j w_ij (x_j − x_i) and Σ_j s_ij (x_j − x_i) at vertex number `i`: the Laplacian
    /// coordinate, and by how much the membrane's edges pull.
    #[inline]
    pub(crate) fn laplacian_and_pull(
        &self,
        positions: &Positions<T>,
        i: usize,
    ) -> [Vector3<f64>; 2] {
        let x = positions.as_slice();
        let row = self.graph().range(i);
        let weights = &self.operator.weights()[row.clone()];
        let cotangents = &self.membrane_weights()[row.clone()];
        let mut sums = [Vector3::zeros(); 2];
        for ((j, w), c) in self.graph().neighbours()[row]
            .iter()
            .zip(weights)
            .zip(cotangents)
        {
            let edge = (x[j.index()] - x[i]).map(T::as_f64);
            sums[0] += edge * *w;
            sums[1] += edge * *c;
        }
        [sums[0], sums[1] * 0.5]
    }

    /// Twice the greatest distance of a vertex from the surface's centroid: a length of about the
    /// box's longest side that does not change when the mesh is turned.
    pub(crate) fn extent(&self) -> f64 {
        let center = surface_centroid(&self.surface());
        let farthest = self
            .positions
            .values()
            .map(|p| (p - center).norm().as_f64());
        2.0 * farthest.fold(0.0, f64::max)
    }

    /// Mean over the vertices of |Σ_j w_ij| for cotangent weights.
    pub(crate) fn mean_cotangent_diagonal(&self) -> f64 {
        let n = self.positions.len();
        let cotangents = self.membrane_weights();
        let sum = |i| cotangents[self.graph().range(i)].iter().sum::<f64>();
        (0..n).map(|i| sum(i).abs()).sum::<f64>() / n as f64
    }
}

/// The operator on a graph that has the edges of the mesh too, with weights of 0, and the halfedge
/// of each entry.
///
/// Energies of the flow have terms on the edges, whose arrays are stored like those of the operator.
fn with_edges<T: Scalar>(
    operator: &Operator<T>,
    rings: &OneRings,
) -> Result<(Operator<T>, Vec<Option<HalfedgeId>>), SchemeError> {
    let (own, n) = (operator.graph(), operator.num_rows());
    let mut pairs = Vec::with_capacity((own.num_entries() + rings.halfedges().len()) / 2);
    for i in 0..n {
        for graph in [own, rings.graph()] {
            let above = graph.row(i).filter(|(j, _)| j.index() > i);
            pairs.extend(above.map(|(j, _)| [RowId::new(i), j]));
        }
    }
    let graph = Arc::new(Graph::from_pairs(n, &pairs));
    let mut weights = Vec::with_capacity(graph.num_entries());
    let mut halfedges = Vec::with_capacity(graph.num_entries());
    for i in 0..n {
        // All three rows ascend.
        let (mut of_own, mut of_rings) = (own.row(i).peekable(), rings.ring(i).peekable());
        for (j, _) in graph.row(i) {
            let entry = of_own.next_if(|(own, _)| *own == j);
            weights.push(entry.map_or(0.0, |(_, k)| operator.weights()[k]));
            let edge = of_rings.next_if(|(v, _)| v.index() == j.index());
            halfedges.push(edge.map(|(_, h)| h));
        }
    }
    // The weights were finite before.
    let operator = Operator::new(graph, weights, operator.symmetry());
    let operator = operator.map_err(|_| SchemeError::Unsuitable {
        scheme: "given".into(),
        reason: "its weights add up to no finite number".into(),
    })?;
    Ok((operator, halfedges))
}

/// The cotangent weights, from cotangents that are known already.
struct SumOf<'a, T: Scalar> {
    cotangents: &'a HalfedgeMap<T>,
}

impl<T: Scalar> LaplacianScheme<T> for SumOf<'_, T> {
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError> {
        for e in surface.mesh().edges() {
            let [h, twin] = e.halfedges();
            let weight = self.cotangents[h] + self.cotangents[twin];
            (out[h], out[twin]) = (weight, weight);
        }
        Ok(())
    }

    fn symmetry(&self) -> Symmetry {
        Symmetry::Symmetric
    }

    fn name(&self) -> &str {
        "cotangent"
    }
}
