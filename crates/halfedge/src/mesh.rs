//! The mesh type: packed arrays and constant-time queries on them.
//!
//! Its other methods are in `build`, `circulate`, `edit`, `shared`, `topology` and `validate`,
//! which are one concept with this file and use each other.

use std::sync::Arc;

use crate::circulate::{BoundaryLoop, FaceHalfedges, IncomingHalfedges, OutgoingHalfedges};
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::shared::Shared;

/// Connectivity of a consistently oriented 2-manifold polygon mesh, with or without boundary.
///
/// ```text
///              target(h)
///                 ▲
///   next(twin)    │ │      face(h): on the left of h
///                 │ │
///               h │ │ twin(h) = h ^ 1
///                 │ │
///                   ▼      a side without a face is a boundary halfedge; `next` leads
///              origin(h)   round the hole from one boundary halfedge to the following one
/// ```
///
/// **Invariants** (checked by [`HalfedgeMesh::validate`], preserved by every edit): ids of each
/// kind are 0, 1, 2, … without gaps; halfedges 2e and 2e + 1 are the sides of edge e; `next` and
/// `prev` are inverse permutations; every vertex has an edge and exactly one fan of faces; the
/// outgoing halfedge stored for a boundary vertex is its boundary halfedge; no two edges join the
/// same two vertices; no face visits a vertex twice.
///
/// A surface that is not manifold or not consistently oriented is represented by pieces that are
/// ([`HalfedgeMesh::from_faces_in_pieces`]). The copies of a vertex then share a *row*, the index
/// of whatever belongs to the point and not to a piece of the surface. In all other meshes a row
/// is a vertex.
///
/// The mesh holds no positions: these are stored in a separate [`VertexMap`](crate::VertexMap).
///
/// Two faces may share several edges, and an inner vertex may have only two edges: a polygon mesh
/// can be a cell complex without being a simplicial complex.
///
/// # Panics
/// The queries of this type index into arrays: like a slice, they panic for an element that the
/// mesh does not have. Construction and edits check their input and return an error instead.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct HalfedgeMesh {
    /// Per vertex: an outgoing halfedge, namely the boundary halfedge if there is one.
    pub(crate) vertex_halfedge: Vec<HalfedgeId>,
    /// Per face: its first halfedge.
    pub(crate) face_halfedge: Vec<HalfedgeId>,
    /// Per halfedge: its target vertex.
    pub(crate) target: Vec<VertexId>,
    /// Per halfedge: the next halfedge of the same face or boundary loop.
    pub(crate) next: Vec<HalfedgeId>,
    /// Per halfedge: the previous halfedge of the same face or boundary loop.
    pub(crate) prev: Vec<HalfedgeId>,
    /// Per halfedge: the index of the face on its left, or `NONE` on the boundary.
    pub(crate) face: Vec<u32>,
    /// The copies of vertices, if the mesh was cut into pieces.
    pub(crate) shared: Option<Box<Shared>>,
}

/// Clones the mesh into an `Arc`, for functions that take `impl Into<Arc<HalfedgeMesh>>`.
impl From<&HalfedgeMesh> for Arc<HalfedgeMesh> {
    fn from(mesh: &HalfedgeMesh) -> Self {
        Self::new(mesh.clone())
    }
}

impl HalfedgeMesh {
    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.vertex_halfedge.len()
    }

    /// Number of halfedges: twice the number of edges.
    pub fn num_halfedges(&self) -> usize {
        self.target.len()
    }

    /// Number of undirected edges.
    pub fn num_edges(&self) -> usize {
        self.target.len() / 2
    }

    /// Number of faces (boundary loops are not faces).
    pub fn num_faces(&self) -> usize {
        self.face_halfedge.len()
    }

    /// Memory used by the connectivity, in bytes: 16 per halfedge, 4 per vertex and 4 per face.
    pub fn num_bytes(&self) -> usize {
        let handles = self.vertex_halfedge.len() + self.face_halfedge.len();
        size_of::<HalfedgeId>() * (handles + 4 * self.target.len())
    }

    /// All vertices in ascending order.
    pub fn vertices(
        &self,
    ) -> impl ExactSizeIterator<Item = VertexId> + DoubleEndedIterator + use<> {
        (0..self.num_vertices()).map(VertexId::new)
    }

    /// All halfedges in ascending order.
    pub fn halfedges(
        &self,
    ) -> impl ExactSizeIterator<Item = HalfedgeId> + DoubleEndedIterator + use<> {
        (0..self.num_halfedges()).map(HalfedgeId::new)
    }

    /// All edges in ascending order.
    pub fn edges(&self) -> impl ExactSizeIterator<Item = EdgeId> + DoubleEndedIterator + use<> {
        (0..self.num_edges()).map(EdgeId::new)
    }

    /// All faces in ascending order.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = FaceId> + DoubleEndedIterator + use<> {
        (0..self.num_faces()).map(FaceId::new)
    }

    /// The vertex that `halfedge` points to.
    #[inline]
    pub fn target(&self, halfedge: HalfedgeId) -> VertexId {
        self.target[halfedge.index()]
    }

    /// The vertex that `halfedge` starts from.
    #[inline]
    pub fn origin(&self, halfedge: HalfedgeId) -> VertexId {
        self.target[halfedge.twin().index()]
    }

    /// The next halfedge of the same face or boundary loop.
    #[inline]
    pub fn next(&self, halfedge: HalfedgeId) -> HalfedgeId {
        self.next[halfedge.index()]
    }

    /// The previous halfedge of the same face or boundary loop.
    #[inline]
    pub fn prev(&self, halfedge: HalfedgeId) -> HalfedgeId {
        self.prev[halfedge.index()]
    }

    /// The face on the left of `halfedge`, or `None` on the boundary.
    #[inline]
    pub fn face(&self, halfedge: HalfedgeId) -> Option<FaceId> {
        FaceId::some(self.face[halfedge.index()])
    }

    /// An outgoing halfedge of `vertex`, namely its boundary halfedge if it lies on the boundary.
    #[inline]
    pub fn vertex_halfedge(&self, vertex: VertexId) -> HalfedgeId {
        self.vertex_halfedge[vertex.index()]
    }

    /// The first halfedge of `face`.
    #[inline]
    pub fn face_halfedge(&self, face: FaceId) -> HalfedgeId {
        self.face_halfedge[face.index()]
    }

    /// Returns true if there is no face on the left of `halfedge`.
    #[inline]
    pub fn is_boundary_halfedge(&self, halfedge: HalfedgeId) -> bool {
        self.face[halfedge.index()] == crate::ids::NONE
    }

    /// Returns true if one side of `edge` has no face.
    pub fn is_boundary_edge(&self, edge: EdgeId) -> bool {
        edge.halfedges()
            .into_iter()
            .any(|h| self.is_boundary_halfedge(h))
    }

    /// Returns true if `vertex` lies on a boundary loop.
    #[inline]
    pub fn is_boundary_vertex(&self, vertex: VertexId) -> bool {
        self.is_boundary_halfedge(self.vertex_halfedge(vertex))
    }

    /// The two ends of `edge`: origin and target of its first halfedge.
    pub fn edge_vertices(&self, edge: EdgeId) -> [VertexId; 2] {
        let h = edge.halfedge();
        [self.origin(h), self.target(h)]
    }

    /// Number of edges at `vertex`.
    pub fn valence(&self, vertex: VertexId) -> usize {
        self.outgoing_halfedges(vertex).count()
    }

    /// Number of corners of `face`.
    pub fn degree(&self, face: FaceId) -> usize {
        self.face_halfedges(face).count()
    }

    /// Returns true if every face has three corners.
    pub fn is_triangle_mesh(&self) -> bool {
        self.faces().all(|f| {
            let h = self.face_halfedge(f);
            self.next(self.next(self.next(h))) == h
        })
    }

    /// The three corners of a triangle, starting at the origin of its first halfedge.
    ///
    /// For a larger polygon, the first three corners.
    #[inline]
    pub fn triangle(&self, face: FaceId) -> [VertexId; 3] {
        let h = self.face_halfedge(face);
        let n = self.next(h);
        [self.origin(h), self.target(h), self.target(n)]
    }

    /// The halfedge from `origin` to `target`, if an edge joins them.
    ///
    /// The time is proportional to the smaller of the two valences, so a hub costs no more than
    /// its neighbour.
    pub fn halfedge_between(&self, origin: VertexId, target: VertexId) -> Option<HalfedgeId> {
        let mut from_target = self.outgoing_halfedges(target);
        for h in self.outgoing_halfedges(origin) {
            if self.target(h) == target {
                return Some(h);
            }
            let back = from_target.next()?;
            if self.target(back) == origin {
                return Some(back.twin());
            }
        }
        None
    }

    /// The halfedges that leave `vertex`, counter-clockwise as seen from the outside.
    ///
    /// At a boundary vertex the boundary halfedge comes last, so the fan runs from one border to
    /// the other. Use `.rev()` to walk clockwise.
    #[inline]
    pub fn outgoing_halfedges(&self, vertex: VertexId) -> OutgoingHalfedges<'_> {
        OutgoingHalfedges::new(self, vertex)
    }

    /// The halfedges that arrive at `vertex`: the twins of [`Self::outgoing_halfedges`].
    pub fn incoming_halfedges(&self, vertex: VertexId) -> IncomingHalfedges<'_> {
        IncomingHalfedges(self.outgoing_halfedges(vertex))
    }

    /// The neighbours of `vertex`, in the order of [`Self::outgoing_halfedges`].
    pub fn one_ring(
        &self,
        vertex: VertexId,
    ) -> impl DoubleEndedIterator<Item = VertexId> + Clone + '_ {
        self.outgoing_halfedges(vertex).map(|h| self.target(h))
    }

    /// The faces around `vertex`, in the order of [`Self::outgoing_halfedges`].
    pub fn vertex_faces(
        &self,
        vertex: VertexId,
    ) -> impl DoubleEndedIterator<Item = FaceId> + Clone + '_ {
        self.outgoing_halfedges(vertex).filter_map(|h| self.face(h))
    }

    /// The halfedges of `face`, counter-clockwise from its first one.
    #[inline]
    pub fn face_halfedges(&self, face: FaceId) -> FaceHalfedges<'_> {
        FaceHalfedges::new(self, self.face_halfedge(face))
    }

    /// The corners of `face`, counter-clockwise from the origin of its first halfedge.
    pub fn face_vertices(
        &self,
        face: FaceId,
    ) -> impl DoubleEndedIterator<Item = VertexId> + Clone + '_ {
        self.face_halfedges(face).map(|h| self.origin(h))
    }

    /// The halfedges of the boundary loop that contains `halfedge`, starting with it.
    ///
    /// Empty if `halfedge` has a face.
    pub fn boundary_loop(&self, halfedge: HalfedgeId) -> BoundaryLoop<'_> {
        BoundaryLoop::new(self, halfedge)
    }

    /// The vertex indices of each face, in the form that [`Self::from_faces`] takes.
    ///
    /// Building from them gives this mesh again, with the same vertices, faces and first corners.
    /// If the mesh was edited, the edge ids may differ.
    pub fn to_faces(&self) -> Vec<Vec<u32>> {
        self.faces()
            .map(|f| self.face_vertices(f).map(|v| v.0).collect())
            .collect()
    }
}
