//! Errors of edits.

use thiserror::Error;

use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};

/// The reason why an edit was rejected. The mesh is unchanged.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum EditError {
    /// The edge does not exist.
    #[error("there is no edge {edge}: the mesh has {num_edges} (numbered from 0)")]
    NoSuchEdge {
        /// The edge that was given.
        edge: EdgeId,
        /// The number of edges in the mesh.
        num_edges: usize,
    },
    /// The halfedge does not exist.
    #[error("there is no halfedge {halfedge}: the mesh has {num_halfedges} (numbered from 0)")]
    NoSuchHalfedge {
        /// The halfedge that was given.
        halfedge: HalfedgeId,
        /// The number of halfedges in the mesh.
        num_halfedges: usize,
    },
    /// The face does not exist.
    #[error("there is no face {face}: the mesh has {num_faces} (numbered from 0)")]
    NoSuchFace {
        /// The face that was given.
        face: FaceId,
        /// The number of faces in the mesh.
        num_faces: usize,
    },
    /// The component does not exist.
    #[error("there is no component {component}: the mesh has {num_components} (numbered from 0)")]
    NoSuchComponent {
        /// The component that was given.
        component: usize,
        /// The number of components in the mesh.
        num_components: usize,
    },
    /// The edit adds or removes vertices, and the mesh has copies of some.
    #[error(
        "the mesh was cut into pieces that share vertices; repair it into one manifold surface before vertices are added or removed"
    )]
    Copies,
    /// A copy has no row.
    #[error("vertex {row} is no row: the mesh has {num_rows}, numbered from 0, before its copies")]
    NoSuchRow {
        /// The row that was given.
        row: VertexId,
        /// The number of rows.
        num_rows: usize,
    },
    /// There would be more elements than 32-bit ids can number.
    #[error("the mesh is full: {num_edges} edges are as many as its ids can number")]
    TooLarge {
        /// The number of edges after the edit.
        num_edges: usize,
    },
    /// An edge has one face where two are required.
    #[error("edge {edge} lies on the boundary; only an edge between two faces can be flipped")]
    BoundaryEdge {
        /// The edge.
        edge: EdgeId,
    },
    /// A polygon has more than three corners where a triangle is required.
    #[error("face {face} has {degree} corners; triangulate it first")]
    NotTriangle {
        /// The face.
        face: FaceId,
        /// Its number of corners.
        degree: usize,
    },
    /// Two triangles are back to back: the same corner is opposite both sides of the edge.
    #[error("both triangles at edge {edge} have vertex {vertex} as their third corner")]
    BackToBack {
        /// The edge.
        edge: EdgeId,
        /// The corner opposite the edge, on both sides.
        vertex: VertexId,
    },
    /// The edit would create a second edge between two vertices.
    #[error("vertices {} and {} are joined by edge {edge} already", vertices[0], vertices[1])]
    EdgeExists {
        /// The two vertices.
        vertices: [VertexId; 2],
        /// The existing edge between them.
        edge: EdgeId,
    },
    /// The two corners do not belong to the same face.
    #[error("halfedges {} and {} are not two different corners of one face", corners[0], corners[1])]
    NotOneFace {
        /// The halfedges that were given.
        corners: [HalfedgeId; 2],
    },
    /// Collapsing an inner edge between two boundary vertices.
    #[error(
        "edge {edge} joins two boundary vertices across the inside; its collapse would pinch the surface"
    )]
    Pinch {
        /// The edge.
        edge: EdgeId,
    },
    /// Collapsing an edge whose ends have a common neighbour other than the corners opposite the
    /// edge.
    #[error(
        "both ends of edge {edge} are joined to vertex {vertex}; its collapse would double an edge"
    )]
    LinkCondition {
        /// The edge.
        edge: EdgeId,
        /// The common neighbour.
        vertex: VertexId,
    },
    /// Collapsing an edge whose ends are also corners of another common face.
    #[error(
        "both ends of edge {edge} are corners of face {face}; after its collapse the face would pass twice through one vertex"
    )]
    SharedFace {
        /// The edge.
        edge: EdgeId,
        /// The face.
        face: FaceId,
    },
    /// Collapsing an edge of a triangle that is a component of its own.
    #[error("face {face} is a single triangle; its collapse would leave an edge without a face")]
    LastFace {
        /// The triangle.
        face: FaceId,
    },
    /// Collapsing an edge that would leave two triangles back to back, as in a tetrahedron.
    #[error(
        "the collapse of edge {edge} would flatten its component to two triangles back to back"
    )]
    Flattens {
        /// The edge.
        edge: EdgeId,
    },
    /// Deleting faces that would leave several fans at a vertex.
    #[error(
        "without these faces vertex {vertex} would join {num_fans} separate fans (a bow-tie); delete all but one of them, too"
    )]
    BowTie {
        /// The vertex.
        vertex: VertexId,
        /// The number of fans that would remain at the vertex.
        num_fans: usize,
    },
    /// Every fan of the face has a diagonal that already exists as an edge.
    #[error(
        "each fan of face {face} ({degree} corners) would double an edge; split the face at a new vertex instead"
    )]
    NoFan {
        /// The face.
        face: FaceId,
        /// Its number of corners.
        degree: usize,
    },
    /// A map does not match the mesh as it was before the edit.
    #[error("the map has {found} entries, but there were {expected} {elements} before the edit")]
    MapLength {
        /// The kind of element that the map describes.
        elements: &'static str,
        /// The expected number of entries.
        expected: usize,
        /// The actual number of entries.
        found: usize,
    },
}
