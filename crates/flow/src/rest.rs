//! The original mesh and its measurements.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, Surface, surface_centroid, unit_or_zero};
use cotan_halfedge::{HalfedgeId, HalfedgeMap, HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::{
    Copies, Cotangent, FanSums, Fans, Graph, IntrinsicTriangulation, LaplacianScheme, OneRings,
    Operator, SchemeError, Symmetry,
};
use nalgebra::Vector3;

use crate::box_units::BoxUnits;
use crate::error::FlowError;
use crate::point_tie::PointTie;

/// The original mesh in box units, its operator, and its Laplacian coordinates split into their
/// parts.
///
/// There is one unknown per *row*, and all maps here have one entry per row. A row is a vertex,
/// unless the mesh was cut into pieces: then all copies of a vertex are one row, which has the
/// index of that vertex ([`HalfedgeMesh::row_of`]). Weights, areas and rotations are those of the
/// row. Normals are sums over the pieces as they are oriented, and mean something only for rows
/// without copies.
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
    /// The positions per vertex, if vertices have copies.
    of_vertices: Option<Positions<T>>,
    laplacian: VertexMap<Vector3<T>>,
    magnitudes: VertexMap<T>,
    normals: VertexMap<Vector3<T>>,
    areas: VertexMap<T>,
    /// Cotangent of the angle opposite each halfedge, 0 on the boundary.
    cotangents: HalfedgeMap<f64>,
    /// Cotangent weights, row after row; `None` where they are the operator's own.
    row_cotangents: Option<Vec<f64>>,
    ties: Vec<PointTie>,
}

/// The identity of a rest shape.
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
    /// **Shapes**: one position per vertex, or one per row, in any unit. A copy of a vertex takes
    /// the position of its row.
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
        let n = mesh.num_rows();
        let (original, units) = in_rows(&mesh, original)?;
        let positions = units.to_box_all(&original);
        let of_vertices = mesh
            .has_copies()
            .then(|| mesh.to_vertices(positions.clone()));
        let surface = Surface::new(&mesh, of_vertices.as_ref().unwrap_or(&positions))?;
        let rings = Arc::new(OneRings::new(&mesh));
        let operator = scheme.operator(&rings, &surface)?;
        check_graph(&*scheme, &operator, &rings)?;
        let mut laplacian = VertexMap::filled(n, Vector3::zeros());
        operator.apply(&positions, &mut laplacian);
        let magnitudes = laplacian.map(|ell| ell.norm());
        // As the current mesh is measured, to the last digit: a shape at rest shows no change.
        let fans = Fans::new(&mesh, rings.clone());
        let mut sums = FanSums::default();
        fans.areas(&positions, &mut sums);
        let mut cotangents = HalfedgeMap::filled(mesh.num_halfedges(), T::zero());
        Cotangent::default().opposite_cotangents(&surface, &mut cotangents);
        let row_cotangents = match operator.triangles() {
            Some(triangles) => cotangents_of(triangles, &operator)?,
            None => cotangents_on_rings(&rings, &cotangents, &operator, &surface),
        };
        let cotangents = cotangents.map(|c| c.as_f64());
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
            of_vertices,
            laplacian,
            magnitudes,
            cotangents,
            row_cotangents,
            ties: Vec::new(),
        })
    }

    /// With ties between parts of the mesh.
    pub(crate) fn tied(mut self, ties: Vec<PointTie>) -> Self {
        self.ties = ties;
        self
    }

    /// The ties between parts of the mesh.
    pub(crate) fn ties(&self) -> &[PointTie] {
        &self.ties
    }

    pub(crate) fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The unit in which everything here is given.
    pub fn box_units(&self) -> &BoxUnits<T> {
        &self.units
    }

    /// The original positions as they came, in the units of the input, one per row.
    pub fn original_positions(&self) -> &Arc<Positions<T>> {
        &self.original
    }

    /// The connectivity, to be shared.
    pub fn shared_mesh(&self) -> &Arc<HalfedgeMesh> {
        &self.mesh
    }

    pub(crate) fn shared_scheme(&self) -> &Arc<dyn LaplacianScheme<T>> {
        &self.scheme
    }

    /// The scheme that chose the weights.
    pub fn scheme(&self) -> &dyn LaplacianScheme<T> {
        &*self.scheme
    }

    /// The mesh with its original positions, in box units.
    pub fn surface(&self) -> Surface<'_, T> {
        let positions = self.of_vertices.as_ref().unwrap_or(&self.positions);
        Surface::assume_checked(&self.mesh, positions)
    }

    /// Checks another shape of the mesh and gives its positions per row.
    ///
    /// **Shapes**: one position per vertex, or one per row.
    pub(crate) fn rows_of(&self, shape: &Positions<T>) -> Result<Positions<T>, FlowError> {
        if self.mesh.has_copies() && shape.len() == self.mesh.num_rows() {
            Surface::new(&self.mesh, &self.mesh.to_vertices(shape.clone()))?;
        } else {
            Surface::new(&self.mesh, shape)?;
        }
        Ok(self.mesh.to_rows(shape))
    }

    /// The connectivity.
    pub fn mesh(&self) -> &HalfedgeMesh {
        &self.mesh
    }

    /// The operator of the original mesh, L⁰.
    pub fn operator(&self) -> &Operator<T> {
        &self.operator
    }

    /// The one-rings of the mesh, whose entries are those of [`Self::graph`] unless the scheme has
    /// triangles of its own ([`Operator::triangles`]).
    pub fn rings(&self) -> &Arc<OneRings> {
        self.fans.rings()
    }

    /// The graph of the operator: rows and their neighbours.
    pub fn graph(&self) -> &Arc<Graph> {
        self.operator.graph()
    }

    /// The copies of a row's vertex, if the mesh was cut into pieces.
    pub fn copies_of(&self, row: VertexId) -> impl ExactSizeIterator<Item = VertexId> + '_ {
        let copies = self.fans.copies_of(row.index()).iter();
        copies.map(|&v| VertexId::new(v as usize))
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

    /// The cotangent weights of the mesh or of the scheme's own triangles, whatever the weights of
    /// the operator: one per entry of [`Self::graph`], row after row. Twice the stiffness of the
    /// membrane.
    pub fn membrane_weights(&self) -> &[f64] {
        let own = self.row_cotangents.as_deref();
        own.unwrap_or_else(|| self.operator.weights())
    }

    /// Returns `true` if the operator's weights are the cotangents, so that the membrane's edges
    /// pull by half of L⁰x.
    pub(crate) fn has_own_cotangents(&self) -> bool {
        self.row_cotangents.is_none()
    }

    /// Σ_j w_ij (x_j − x_i) and Σ_j s_ij (x_j − x_i) at vertex `i`: the Laplacian
    /// coordinate, and the pull of the membrane's edges.
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

/// The positions of the rows, and the unit.
fn in_rows<T: Scalar>(
    mesh: &HalfedgeMesh,
    original: Arc<Positions<T>>,
) -> Result<(Arc<Positions<T>>, BoxUnits<T>), FlowError> {
    if !mesh.has_copies() {
        let units = BoxUnits::of(&Surface::new(mesh, &original)?)?;
        return Ok((original, units));
    }
    if original.len() != mesh.num_rows() {
        Surface::new(mesh, &original)?;
    }
    let rows = mesh.to_rows(&original);
    let of_vertices = mesh.to_vertices(rows.clone());
    let units = BoxUnits::of(&Surface::new(mesh, &of_vertices)?)?;
    Ok((Arc::new(rows), units))
}

/// The energies of the flow are sums over triangles: those of the mesh, or those that the operator
/// has. Its graph must be the sides of these.
fn check_graph<T: Scalar>(
    scheme: &dyn LaplacianScheme<T>,
    operator: &Operator<T>,
    rings: &OneRings,
) -> Result<(), SchemeError> {
    if operator.triangles().is_some() || operator.graph() == rings.graph() {
        return Ok(());
    }
    Err(SchemeError::Unsuitable {
        scheme: scheme.name().into(),
        reason: "its operator joins vertices that no edge of this mesh joins, and has no \
                 triangles; remesh the surface, or choose a scheme on the edges of the mesh"
            .into(),
    })
}

/// The cotangent weights on the one-rings; `None` if they are the operator's own.
///
/// With the weights of the same cotangents K is L/2 to the last digit, and one array serves both.
fn cotangents_on_rings<T: Scalar>(
    rings: &OneRings,
    cotangents: &HalfedgeMap<T>,
    operator: &Operator<T>,
    surface: &Surface<'_, T>,
) -> Option<Vec<f64>> {
    let own = Operator::assemble_on(rings, &SumOf { cotangents }, surface);
    if own.is_ok_and(|own| own.weights() == operator.weights()) {
        return None;
    }
    let both = |h: &HalfedgeId| cotangents[*h].as_f64() + cotangents[h.twin()].as_f64();
    let weight = |k| rings.halfedges_of(k).iter().map(both).sum();
    Some((0..rings.graph().num_entries()).map(weight).collect())
}

/// The cotangent weights of an operator's own triangles; `None` if they are the operator's.
fn cotangents_of<T: Scalar>(
    triangles: &IntrinsicTriangulation,
    operator: &Operator<T>,
) -> Result<Option<Vec<f64>>, SchemeError> {
    let own: Operator<T> = triangles.operator()?;
    Ok((own.weights() != operator.weights()).then(|| own.weights().to_vec()))
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

    fn copies(&self) -> Copies {
        Copies::Sum
    }

    fn name(&self) -> &str {
        "cotangent"
    }
}
