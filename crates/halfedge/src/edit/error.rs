//! Why an edit was refused.

use thiserror::Error;

use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};

/// Why an edit was refused. The mesh is as it was before.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum EditError {
    /// An edge that the mesh does not have.
    #[error("there is no edge {edge}: the mesh has {num_edges} (numbered from 0)")]
    NoSuchEdge {
        /// The edge that was given.
        edge: EdgeId,
        /// The number of those that exist.
        num_edges: usize,
    },
    /// A halfedge that the mesh does not have.
    #[error("there is no halfedge {halfedge}: the mesh has {num_halfedges} (numbered from 0)")]
    NoSuchHalfedge {
        /// The halfedge that was given.
        halfedge: HalfedgeId,
        /// The number of those that exist.
        num_halfedges: usize,
    },
    /// A face that the mesh does not have.
    #[error("there is no face {face}: the mesh has {num_faces} (numbered from 0)")]
    NoSuchFace {
        /// The face that was given.
        face: FaceId,
        /// The number of those that exist.
        num_faces: usize,
    },
    /// A component that the mesh does not have.
    #[error("there is no component {component}: the mesh has {num_components} (numbered from 0)")]
    NoSuchComponent {
        /// The component that was given.
        component: usize,
        /// The number of those that exist.
        num_components: usize,
    },
    /// More elements than 32-bit ids can number.
    #[error("the mesh is full: {num_edges} edges are as many as its ids can number")]
    TooLarge {
        /// The number of edges that there would be.
        num_edges: usize,
    },
    /// An edge with one face where two are needed.
    #[error("edge {edge} lies on the boundary; only an edge between two faces can be flipped")]
    BoundaryEdge {
        /// The edge.
        edge: EdgeId,
    },
    /// A larger polygon where a triangle is needed.
    #[error("face {face} has {degree} corners; triangulate it first")]
    NotTriangle {
        /// The face.
        face: FaceId,
        /// Its number of corners.
        degree: usize,
    },
    /// Two triangles back to back: the same corner is opposite to both sides of the edge.
    #[error("both triangles at edge {edge} have vertex {vertex} as their third corner")]
    BackToBack {
        /// The edge.
        edge: EdgeId,
        /// The corner opposite to it, on both sides.
        vertex: VertexId,
    },
    /// The edit would make a second edge between two vertices.
    #[error("vertices {} and {} are joined by edge {edge} already", vertices[0], vertices[1])]
    EdgeExists {
        /// The two vertices.
        vertices: [VertexId; 2],
        /// The edge that joins them.
        edge: EdgeId,
    },
    /// Two corners that are not corners of one and the same face.
    #[error("halfedges {} and {} are not two different corners of one face", corners[0], corners[1])]
    NotOneFace {
        /// The halfedges that were given.
        corners: [HalfedgeId; 2],
    },
    /// Collapse of an inner edge between two boundary vertices.
    #[error(
        "edge {edge} joins two boundary vertices across the inside; its collapse would pinch the surface"
    )]
    Pinch {
        /// The edge.
        edge: EdgeId,
    },
    /// Collapse of an edge whose ends have a common neighbour besides the corners opposite to it.
    #[error(
        "both ends of edge {edge} are joined to vertex {vertex}; its collapse would double an edge"
    )]
    LinkCondition {
        /// The edge.
        edge: EdgeId,
        /// The common neighbour.
        vertex: VertexId,
    },
    /// Collapse of an edge whose ends are corners of a face elsewhere, too.
    #[error(
        "both ends of edge {edge} are corners of face {face}; after its collapse the face would pass twice through one vertex"
    )]
    SharedFace {
        /// The edge.
        edge: EdgeId,
        /// The face.
        face: FaceId,
    },
    /// Collapse of an edge of a triangle that is a component of its own.
    #[error("face {face} is a single triangle; its collapse would leave an edge without a face")]
    LastFace {
        /// The triangle.
        face: FaceId,
    },
    /// Collapse that would leave two triangles back to back, as that of a tetrahedron does.
    #[error(
        "the collapse of edge {edge} would flatten its component to two triangles back to back"
    )]
    Flattens {
        /// The edge.
        edge: EdgeId,
    },
    /// Deletion after which a vertex joins several fans.
    #[error(
        "without these faces vertex {vertex} would join {num_fans} separate fans (a bow-tie); delete all but one of them, too"
    )]
    BowTie {
        /// The vertex.
        vertex: VertexId,
        /// The number of fans that would be left there.
        num_fans: usize,
    },
    /// A face in which every fan has a diagonal that is an edge already.
    #[error(
        "each fan of face {face} ({degree} corners) would double an edge; split the face at a new vertex instead"
    )]
    NoFan {
        /// The face.
        face: FaceId,
        /// Its number of corners.
        degree: usize,
    },
    /// A map that does not belong to the mesh as it was before the edit.
    #[error("the map has {found} entries, but there were {expected} {elements} before the edit")]
    MapLength {
        /// The elements that the map is about.
        elements: &'static str,
        /// The number of entries that the map should have.
        expected: usize,
        /// The number of entries that it has.
        found: usize,
    },
}
