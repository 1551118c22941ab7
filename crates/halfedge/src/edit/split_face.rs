//! Splitting a face at a new vertex or between two of its corners.

use super::EditError;
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::map::FaceMap;
use crate::mesh::HalfedgeMesh;

/// A face cut in two by a new edge: the result of [`HalfedgeMesh::connect_corners`], and of
/// [`HalfedgeMesh::split_edge`] for each triangle at the edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct CutFace {
    /// The new edge between the two parts.
    pub edge: EdgeId,
    /// The face that was cut. It keeps its id as one of the parts.
    pub parent: FaceId,
    /// The other part, a new face.
    pub child: FaceId,
}

impl CutFace {
    /// Appends the value of the parent for the new face.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_faces<T: Clone>(&self, map: &mut FaceMap<T>) -> Result<(), EditError> {
        super::inherit("faces", map, [(self.parent, self.child)])
    }
}

/// The result of [`HalfedgeMesh::split_face`]: the new elements and their parent.
///
/// ```
/// # use cotan_halfedge::{FaceId, FaceMap, HalfedgeMesh, VertexMap};
/// let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]])?;
/// let mut height = VertexMap::from_vec(vec![0.0, 3.0, 6.0, 0.0]);
/// let mut label = FaceMap::from_vec(vec!["red", "blue"]);
/// let split = mesh.split_face(FaceId::new(0))?;
/// height.push(split.corners.iter().map(|&v| height[v]).sum::<f64>() / 3.0);
/// split.apply_faces(&mut label)?;
/// assert_eq!(height[split.vertex], 3.0);
/// assert_eq!(label.as_slice(), ["red", "blue", "red", "red"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SplitFace {
    /// The new vertex inside the face.
    pub vertex: VertexId,
    /// The corners of the face that was split, starting from its first halfedge.
    pub corners: Vec<VertexId>,
    /// The new edges from the vertex to the corners, in the order of the corners.
    pub edges: Vec<EdgeId>,
    /// The face that was split. It keeps its id as the triangle at its first halfedge.
    pub parent: FaceId,
    /// The new faces: the triangles at the other halfedges, in order.
    pub children: Vec<FaceId>,
}

impl SplitFace {
    /// Appends the value of the parent for each new face.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_faces<T: Clone>(&self, map: &mut FaceMap<T>) -> Result<(), EditError> {
        let children = self.children.iter().map(|&child| (self.parent, child));
        super::inherit("faces", map, children)
    }
}

impl HalfedgeMesh {
    /// Inserts a vertex into a face and joins it to all corners.
    ///
    /// ```text
    ///          c                     c
    ///         ╱ ╲                   ╱│╲
    ///        ╱   ╲                 ╱ │ ╲
    ///       ╱  f  ╲      ──▶      ╱  m  ╲
    ///      ╱       ╲             ╱ ╱   ╲ ╲
    ///     ╱         ╲           ╱ ╱  f  ╲ ╲
    ///    a───first──▶b         a─────────▶b
    /// ```
    ///
    /// The face keeps its id and its first halfedge. The triangles at the other halfedges become
    /// new faces in order. New edges run from m to the corners, in order from the first.
    ///
    /// # Errors
    /// [`EditError::NoSuchFace`], [`EditError::TooLarge`]. A face that exists can always be split.
    pub fn split_face(&mut self, face: FaceId) -> Result<SplitFace, EditError> {
        self.check_no_copies()?;
        self.check_face(face)?;
        let sides: Vec<HalfedgeId> = self.face_halfedges(face).collect();
        self.check_room(sides.len())?;

        let m = VertexId::new(self.num_vertices());
        let spokes: Vec<HalfedgeId> = sides
            .iter()
            .map(|&side| self.push_edge(m, self.origin(side)))
            .collect();
        self.vertex_halfedge.push(spokes[0]);
        let mut children = Vec::with_capacity(sides.len() - 1);
        for (i, (&side, &spoke)) in sides.iter().zip(&spokes).enumerate() {
            let back = spokes[(i + 1) % spokes.len()].twin();
            self.link(spoke, side);
            self.link(side, back);
            self.link(back, spoke);
            if i == 0 {
                self.copy_face(side, spoke);
                self.copy_face(side, back);
            } else {
                children.push(self.push_face(side));
            }
        }
        Ok(SplitFace {
            vertex: m,
            corners: spokes.iter().map(|&spoke| self.target(spoke)).collect(),
            edges: spokes.into_iter().map(HalfedgeId::edge).collect(),
            parent: face,
            children,
        })
    }

    /// Cuts a face in two with an edge between two of its corners.
    ///
    /// ```text
    ///    ◀──── to            ◀──── to
    ///   ╱        ▲          ╱   f   ▲
    ///  ▼    f     ╲   ──▶  ▼ ──────▶ ╲
    ///   ╲        ╱          ╲  new  ╱
    ///    ● from ▶            ● from ▶
    /// ```
    ///
    /// The corners are the origins of the halfedges `from` and `to`. The new edge runs from the
    /// first to the second and has the old face on its left; the part from `from` to `to` becomes
    /// the new face.
    ///
    /// # Errors
    /// - [`EditError::NotOneFace`]: the halfedges do not belong to the same face, or are
    ///   identical.
    /// - [`EditError::EdgeExists`]: an edge already joins the corners, possibly a side of the
    ///   face.
    /// - [`EditError::NoSuchHalfedge`], [`EditError::TooLarge`].
    pub fn connect_corners(
        &mut self,
        from: HalfedgeId,
        to: HalfedgeId,
    ) -> Result<CutFace, EditError> {
        self.check_halfedge(from)?;
        self.check_halfedge(to)?;
        let parent = match self.face(from) {
            Some(face) if from != to && self.face(to) == Some(face) => face,
            _ => {
                return Err(EditError::NotOneFace {
                    corners: [from, to],
                });
            }
        };
        self.check_no_edge(self.origin(from), self.origin(to))?;
        self.check_room(1)?;
        let child = FaceId::new(self.num_faces());
        let edge = self.cut_face(from, to).edge();
        Ok(CutFace {
            edge,
            parent,
            child,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hexagon() -> HalfedgeMesh {
        HalfedgeMesh::from_faces(6, &[[0, 1, 2, 3, 4, 5]]).unwrap()
    }

    #[test]
    fn a_hexagon_splits_into_six() {
        let mut mesh = hexagon();
        let split = mesh.split_face(FaceId(0)).unwrap();
        let m = split.vertex;
        mesh.validate().unwrap();
        assert_eq!((mesh.valence(m), mesh.num_faces()), (6, 6));
        assert!(mesh.is_triangle_mesh());
        for i in 0..6 {
            assert_eq!(mesh.origin(mesh.face_halfedge(FaceId(i))), VertexId(i));
            assert_eq!(mesh.edge_vertices(EdgeId(6 + i)), [m, VertexId(i)]);
        }
        assert_eq!((m, split.parent), (VertexId(6), FaceId(0)));
        assert_eq!(split.corners, (0..6).map(VertexId).collect::<Vec<_>>());
        assert_eq!(split.edges, (6..12).map(EdgeId).collect::<Vec<_>>());
        assert_eq!(split.children, (1..6).map(FaceId).collect::<Vec<_>>());
        let face = FaceId(6);
        let error = EditError::NoSuchFace { face, num_faces: 6 };
        assert_eq!(mesh.split_face(face), Err(error));
    }

    #[test]
    fn a_hexagon_cut_in_two() {
        let mut mesh = hexagon();
        let sides: Vec<_> = mesh.face_halfedges(FaceId(0)).collect();
        let cut = mesh.connect_corners(sides[1], sides[4]).unwrap();
        mesh.validate().unwrap();
        assert_eq!((cut.parent, cut.child), (FaceId(0), FaceId(1)));
        assert_eq!(mesh.edge_vertices(cut.edge), [VertexId(1), VertexId(4)]);
        assert_eq!(mesh.to_faces(), [[0, 1, 4, 5], [4, 1, 2, 3]]);
    }

    #[test]
    fn refusals() {
        let mesh = hexagon();
        let sides: Vec<_> = mesh.face_halfedges(FaceId(0)).collect();
        let refused = |from: HalfedgeId, to| {
            let mut edited = mesh.clone();
            let error = edited.connect_corners(from, to).unwrap_err();
            assert_eq!(edited, mesh);
            error
        };
        let [a, b, c] = [sides[0], sides[1], sides[2]];
        assert_eq!(refused(a, a), EditError::NotOneFace { corners: [a, a] });
        assert_eq!(
            refused(a, c.twin()),
            EditError::NotOneFace {
                corners: [a, c.twin()]
            }
        );
        let edge = a.edge();
        let vertices = [VertexId(0), VertexId(1)];
        assert_eq!(refused(a, b), EditError::EdgeExists { vertices, edge });
        assert!(matches!(
            refused(a, HalfedgeId(99)),
            EditError::NoSuchHalfedge { .. }
        ));
    }
}
