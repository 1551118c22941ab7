//! Insertion of a vertex into an edge.

use super::{CutFace, EditError};
use crate::ids::{EdgeId, FaceId, VertexId};
use crate::map::{EdgeMap, FaceMap};
use crate::mesh::HalfedgeMesh;

/// The result of [`HalfedgeMesh::split_edge`]: the new elements and their parents.
///
/// ```
/// # use cotan_halfedge::{EdgeId, FaceMap, HalfedgeMesh, VertexMap};
/// let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]])?;
/// let mut height = VertexMap::from_vec(vec![0.0, 1.0, 4.0, 9.0]);
/// let mut label = FaceMap::from_vec(vec!["red", "blue"]);
/// let split = mesh.split_edge(EdgeId::new(2))?; // between vertices 2 and 0
/// let [u, v] = split.ends;
/// height.push((height[u] + height[v]) / 2.0);
/// split.apply_faces(&mut label)?;
/// assert_eq!(height[split.vertex], 2.0);
/// assert_eq!(label.as_slice(), ["red", "blue", "red", "blue"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SplitEdge {
    /// The new vertex on the edge.
    pub vertex: VertexId,
    /// The ends of the edge before the split: origin and target of its first halfedge.
    pub ends: [VertexId; 2],
    /// The two halves of the edge, at the first end and at the second. The first half keeps the
    /// id of the edge, the second is new.
    pub halves: [EdgeId; 2],
    /// The triangles on the left and on the right of the edge, each cut in two by a new edge from
    /// the new vertex to the opposite corner. `None` at a boundary and for a larger polygon,
    /// which only gains a corner.
    pub cuts: [Option<CutFace>; 2],
}

impl SplitEdge {
    /// Parent and child of each new face, in the order of the children.
    pub fn faces(&self) -> impl Iterator<Item = (FaceId, FaceId)> + use<> {
        let cuts = self.cuts.into_iter().flatten();
        cuts.map(|cut| (cut.parent, cut.child))
    }

    /// Appends the value of the parent for each new face.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_faces<T: Clone>(&self, map: &mut FaceMap<T>) -> Result<(), EditError> {
        super::inherit("faces", map, self.faces())
    }

    /// Appends the value of the edge for its second half, and `inside` for the edges that cut the
    /// triangles.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_edges<T: Clone>(&self, map: &mut EdgeMap<T>, inside: T) -> Result<(), EditError> {
        let [parent, child] = self.halves;
        super::inherit("edges", map, [(parent, child)])?;
        let num_cuts = self.cuts.iter().flatten().count();
        map.extend(std::iter::repeat_n(inside, num_cuts));
        Ok(())
    }
}

impl HalfedgeMesh {
    /// Inserts a vertex into an edge. Triangles at the edge are split in two; a larger polygon
    /// gains a corner.
    ///
    /// ```text
    ///         d                     d
    ///        ╱ ╲                   ╱│╲
    ///       ╱   ╲                 ╱ │ ╲
    ///      u──h─▶v      ──▶      u─▶m─▶v
    ///       ╲   ╱                 ╲ │ ╱
    ///        ╲ ╱                   ╲│╱
    ///         c                     c
    /// ```
    ///
    /// Here h is the first halfedge of the edge. The edge keeps its id, its origin u and the
    /// faces on the side of u. New elements, in this order: the vertex m, the edge m→v; if there
    /// is a triangle with d, the edge m→d and the face (m, v, d); if there is one with c, the
    /// edge c→m and the face (c, v, m). A triangle mesh therefore stays a triangle mesh, also at
    /// the boundary.
    ///
    /// # Errors
    /// [`EditError::BackToBack`] if c = d, because m would be joined to it twice;
    /// [`EditError::NoSuchEdge`], [`EditError::TooLarge`].
    ///
    /// ```
    /// # use cotan_halfedge::{HalfedgeMesh, VertexId};
    /// let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]])?;
    /// let diagonal = mesh.halfedge_between(VertexId::new(0), VertexId::new(2)).unwrap();
    /// let split = mesh.split_edge(diagonal.edge())?;
    /// assert_eq!((mesh.valence(split.vertex), mesh.num_faces()), (4, 4));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn split_edge(&mut self, edge: EdgeId) -> Result<SplitEdge, EditError> {
        self.check_no_copies()?;
        self.check_edge(edge)?;
        let [h, t] = edge.halfedges();
        let (left, right) = (self.has_triangle(h), self.has_triangle(t));
        let d = self.target(self.next(h));
        if left && right && d == self.target(self.next(t)) {
            return Err(EditError::BackToBack { edge, vertex: d });
        }
        self.check_room(3)?;

        let [u, v] = self.edge_vertices(edge);
        let m = VertexId::new(self.num_vertices());
        let (after_h, before_t) = (self.next(h), self.prev(t));
        let m_v = self.push_edge(m, v);
        let v_m = m_v.twin();
        self.set_target(h, m);
        self.link(h, m_v);
        self.link(m_v, after_h);
        self.link(before_t, v_m);
        self.link(v_m, t);
        self.copy_face(h, m_v);
        self.copy_face(t, v_m);
        if self.vertex_halfedge(v) == t {
            self.vertex_halfedge[v.index()] = v_m;
        }
        let stored = if self.is_boundary_halfedge(t) { t } else { m_v };
        self.vertex_halfedge.push(stored);
        let before_h = self.prev(h);
        let cuts = [(left, m_v, before_h), (right, before_t, t)];
        let cuts = cuts.map(|(is_triangle, from, to)| {
            let parent = self.face(from).filter(|_| is_triangle)?;
            let edge = self.cut_face(from, to).edge();
            let child = FaceId::new(self.num_faces() - 1);
            Some(CutFace {
                edge,
                parent,
                child,
            })
        });
        Ok(SplitEdge {
            vertex: m,
            ends: [u, v],
            halves: [edge, m_v.edge()],
            cuts,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ids::HalfedgeId;
    use crate::testing::TriangleFaces;

    #[test]
    fn ids_of_the_new_elements() {
        let mut mesh = TriangleFaces::octahedron().mesh().unwrap();
        let edge = EdgeId(3);
        let [h, t] = edge.halfedges();
        let (u, v) = (mesh.origin(h), mesh.target(h));
        let (d, c) = (mesh.target(mesh.next(h)), mesh.target(mesh.next(t)));
        let faces = [mesh.face(h), mesh.face(t)];
        let split = mesh.split_edge(edge).unwrap();
        let m = split.vertex;
        mesh.validate().unwrap();
        assert_eq!(
            (mesh.num_vertices(), mesh.num_edges(), mesh.num_faces()),
            (7, 15, 10)
        );
        assert_eq!(mesh.edge_vertices(edge), [u, m]);
        assert_eq!([mesh.face(h), mesh.face(t)], faces);
        assert_eq!(m, VertexId(6));
        assert_eq!(mesh.edge_vertices(EdgeId(12)), [m, v]);
        assert_eq!(mesh.edge_vertices(EdgeId(13)), [m, d]);
        assert_eq!(mesh.edge_vertices(EdgeId(14)), [c, m]);
        let corners = |face| mesh.face_vertices(FaceId(face)).collect::<Vec<_>>();
        assert_eq!(corners(8), [d, m, v]);
        assert_eq!(corners(9), [m, c, v]);
        assert!(mesh.is_triangle_mesh());
        let cuts = [(13, faces[0], 8), (14, faces[1], 9)].map(|(edge, parent, child)| {
            Some(CutFace {
                edge: EdgeId(edge),
                parent: parent?,
                child: FaceId(child),
            })
        });
        let halves = [edge, EdgeId(12)];
        assert_eq!(
            (split.ends, split.halves, split.cuts),
            ([u, v], halves, cuts)
        );
    }

    #[test]
    fn boundary_edges_split_on_either_side() {
        for faces in [[[0, 1, 2], [0, 2, 3]], [[2, 0, 1], [3, 0, 2]]] {
            let mesh = HalfedgeMesh::from_faces(4, &faces).unwrap();
            for edge in mesh.edges().filter(|&e| mesh.is_boundary_edge(e)) {
                for flip in [false, true] {
                    let mut split = mesh.clone();
                    if flip {
                        split.flip_orientation(0).unwrap();
                    }
                    let m = split.split_edge(edge).unwrap().vertex;
                    split.validate().unwrap();
                    assert!(split.is_boundary_vertex(m));
                    assert_eq!((split.valence(m), split.num_faces()), (3, 3));
                }
            }
        }
    }

    #[test]
    fn a_polygon_gains_a_corner() {
        let mut mesh = HalfedgeMesh::from_faces(5, &[vec![0, 1, 2], vec![0, 2, 3, 4]]).unwrap();
        let shared = mesh.halfedge_between(VertexId(0), VertexId(2)).unwrap();
        mesh.split_edge(shared.edge()).unwrap();
        mesh.validate().unwrap();
        let degrees: Vec<_> = mesh.faces().map(|f| mesh.degree(f)).collect();
        assert_eq!(degrees, [3, 5, 3]);
    }

    #[test]
    fn triangles_back_to_back_are_refused() {
        let mesh = HalfedgeMesh::from_faces(3, &[[0, 1, 2], [0, 2, 1]]).unwrap();
        let mut edited = mesh.clone();
        let error = edited.split_edge(HalfedgeId(0).edge()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "both triangles at edge 0 have vertex 2 as their third corner"
        );
        assert_eq!(edited, mesh);
    }
}
