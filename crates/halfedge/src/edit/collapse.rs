//! The edge collapse, and the conditions under which it preserves the surface.
//!
//! Source of the link condition: Dey, Edelsbrunner, Guha, Nekhayev, "Topology preserving edge
//! contraction" (1999). For polygons: the ends of the edge have no common neighbour and no common
//! face except those that the edge itself accounts for.

use super::renumbering::Changes;
use super::{EditError, Renumbering};
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::mesh::HalfedgeMesh;

/// The result of [`HalfedgeMesh::collapse`]: the merged and removed elements, and the
/// renumbering.
///
/// All fields except `renumbering` use the ids from *before* the edit, so that values can be
/// merged first and the maps renumbered afterwards:
///
/// ```
/// # use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
/// # let upper = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4]];
/// # let lower = [[2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
/// # let mut mesh = HalfedgeMesh::from_faces(6, &[upper, lower].concat())?;
/// # mesh.split_face(cotan_halfedge::FaceId::new(0))?;
/// let mut weight = VertexMap::filled(7, 1.0);
/// let short = mesh.halfedge_between(VertexId::new(6), VertexId::new(4)).unwrap();
/// let collapsed = mesh.collapse(short)?;
/// weight[collapsed.into] += weight[collapsed.gone];
/// collapsed.renumbering.apply_vertices(&mut weight)?;
/// assert_eq!(weight.as_slice(), [1.0, 1.0, 1.0, 1.0, 2.0, 1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
#[must_use = "the maps of the mesh must be renumbered too"]
pub struct Collapsed {
    /// The removed vertex: the origin of the halfedge.
    pub gone: VertexId,
    /// The vertex that it was merged into: the target of the halfedge. Its id after the edit is
    /// `renumbering.vertex(into)`.
    pub into: VertexId,
    /// The edge that was removed without a replacement.
    pub edge: EdgeId,
    /// The triangles on the left and on the right of the halfedge, each with its removed edge and
    /// the edge into which that was merged. `None` on a side without a triangle.
    pub closed: [Option<ClosedFace>; 2],
    /// The renumbering of the elements.
    pub renumbering: Renumbering,
}

/// A triangle closed by a collapse, with ids from before the edit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ClosedFace {
    /// The triangle, which is removed.
    pub face: FaceId,
    /// Its edge at the removed vertex, which is removed as well.
    pub gone: EdgeId,
    /// Its edge at the remaining vertex, into which the other one was merged.
    pub into: EdgeId,
}

impl HalfedgeMesh {
    /// Merges the origin of a halfedge into its target.
    ///
    /// ```text
    ///      ╲   d   ╱             ╲   d   ╱
    ///       ╲ ╱ ╲ ╱               ╲  │  ╱
    ///      ──u──h▶v──     ──▶      ──v──
    ///       ╱ ╲ ╱ ╲               ╱  │  ╲
    ///      ╱   c   ╲             ╱   c   ╲
    /// ```
    ///
    /// The vertex u and the edge are removed. A triangle at the edge is removed together with its
    /// edge at u, while its edge at v remains; a larger polygon loses a corner. The topology is
    /// preserved: components, boundary loops and genus. Gaps are filled with the last elements,
    /// so the cost is O(k log k), where k is the sum of the valences of u, v and the moved vertex
    /// and of the degrees of the moved faces. It does not depend on the size of the mesh.
    ///
    /// An inner vertex next to larger polygons may be left with only two edges.
    ///
    /// # Errors
    /// - [`EditError::LinkCondition`], [`EditError::SharedFace`]: the ends have a common
    ///   neighbour or face other than those at the edge.
    /// - [`EditError::Pinch`]: an inner edge between two boundary vertices.
    /// - [`EditError::LastFace`], [`EditError::BackToBack`], [`EditError::Flattens`]: too little
    ///   would be left, as for a single triangle or a tetrahedron.
    /// - [`EditError::NoSuchHalfedge`].
    pub fn collapse(&mut self, halfedge: HalfedgeId) -> Result<Collapsed, EditError> {
        self.can_collapse(halfedge)?;

        let (u, v) = (self.origin(halfedge), self.target(halfedge));
        let incoming: Vec<HalfedgeId> = self.incoming_halfedges(u).collect();
        for h in incoming {
            self.set_target(h, v);
        }
        // An edge of v other than the collapsed one; it remains.
        let stays = self.next(halfedge);
        let closed = [halfedge, halfedge.twin()].map(|side| {
            let (before, after) = (self.prev(side), self.next(side));
            let had_triangle = self.has_triangle(side);
            self.link(before, after);
            let face = self.face(side)?;
            if self.face_halfedge(face) == side {
                self.face_halfedge[face.index()] = after;
            }
            if !had_triangle {
                return None;
            }
            // The halfedge on the side of v is the one after `halfedge`, or before its twin.
            let [keep, drop] = if side == halfedge {
                [after, before]
            } else {
                [before, after]
            };
            self.close_digon(keep, drop);
            Some(ClosedFace {
                face,
                gone: drop.edge(),
                into: keep.edge(),
            })
        });
        self.store_outgoing(stays);

        let mut edges = vec![halfedge.edge()];
        edges.extend(closed.iter().flatten().map(|closed| closed.gone));
        let faces = closed.iter().flatten().map(|closed| closed.face).collect();
        let renumbering = Renumbering {
            vertices: Changes::fill_gaps(self.num_vertices(), vec![u]),
            edges: Changes::fill_gaps(self.num_edges(), edges),
            faces: Changes::fill_gaps(self.num_faces(), faces),
        };
        self.renumber(&renumbering);
        Ok(Collapsed {
            gone: u,
            into: v,
            edge: halfedge.edge(),
            closed,
            renumbering,
        })
    }

    /// Checks whether [`Self::collapse`] would merge the origin of the halfedge into its target,
    /// and returns the reason if not. The mesh is not changed.
    ///
    /// The time is proportional to the valences of the two vertices.
    ///
    /// # Errors
    /// Same as [`Self::collapse`].
    pub fn can_collapse(&self, halfedge: HalfedgeId) -> Result<(), EditError> {
        self.check_no_copies()?;
        self.check_halfedge(halfedge)?;
        self.check_collapse(halfedge)
    }

    /// Closes a face with two sides: `keep` replaces the twin of `drop`.
    ///
    /// ```text
    ///        drop.twin()
    ///     x ────────────▶ y
    ///     x ◀──── drop ── y       ──▶      x ── keep ──▶ y
    ///     x ─── keep ───▶ y
    /// ```
    fn close_digon(&mut self, keep: HalfedgeId, drop: HalfedgeId) {
        let outer = drop.twin();
        let (x, y) = (self.target(drop), self.target(keep));
        self.link(self.prev(outer), keep);
        self.link(keep, self.next(outer));
        self.copy_face(outer, keep);
        if let Some(face) = self.face(outer)
            && self.face_halfedge(face) == outer
        {
            self.face_halfedge[face.index()] = keep;
        }
        if self.vertex_halfedge(x) == outer {
            self.vertex_halfedge[x.index()] = keep;
        }
        if self.vertex_halfedge(y) == drop {
            self.vertex_halfedge[y.index()] = keep.twin();
        }
    }

    /// Stores `outgoing` at its origin, or the boundary halfedge of the same fan if there is one.
    fn store_outgoing(&mut self, outgoing: HalfedgeId) {
        let mut h = outgoing;
        while !self.is_boundary_halfedge(h) {
            h = self.next(h.twin());
            if h == outgoing {
                break;
            }
        }
        let vertex = self.origin(h);
        self.vertex_halfedge[vertex.index()] = h;
    }

    fn check_collapse(&self, h: HalfedgeId) -> Result<(), EditError> {
        let (u, v, t) = (self.origin(h), self.target(h), h.twin());
        let edge = h.edge();
        let on_boundary = [u, v].map(|end| self.is_boundary_vertex(end));
        if on_boundary == [true; 2] && !self.is_boundary_edge(edge) {
            return Err(EditError::Pinch { edge });
        }
        let mut apexes = Vec::with_capacity(2);
        for side in [h, t] {
            let Some(face) = self.face(side).filter(|_| self.has_triangle(side)) else {
                continue;
            };
            let others = [self.next(side), self.prev(side)];
            if others
                .iter()
                .all(|other| self.is_boundary_halfedge(other.twin()))
            {
                // In this case the edge is on the boundary as well, because its ends are: see the
                // pinch check above.
                return Err(EditError::LastFace { face });
            }
            apexes.push(self.target(others[0]));
        }
        if let [d, c] = apexes[..]
            && d == c
        {
            return Err(EditError::BackToBack { edge, vertex: d });
        }
        self.check_links(h, &apexes)?;
        let valence = self.valence(u) + self.valence(v) - 2 - apexes.len();
        if on_boundary == [false; 2] && valence == 2 && self.leaves_two_triangles(h) {
            return Err(EditError::Flattens { edge });
        }
        Ok(())
    }

    /// Checks that the ends of `h` share only the `apexes` as neighbours, and no faces but those
    /// of `h`.
    fn check_links(&self, h: HalfedgeId, apexes: &[VertexId]) -> Result<(), EditError> {
        let (u, v, edge) = (self.origin(h), self.target(h), h.edge());
        let mut neighbours: Vec<VertexId> = self.one_ring(u).collect();
        neighbours.sort_unstable();
        let shared = |w: &VertexId| !apexes.contains(w) && neighbours.binary_search(w).is_ok();
        if let Some(vertex) = self.one_ring(v).find(shared) {
            return Err(EditError::LinkCondition { edge, vertex });
        }
        let own = edge.halfedges().map(|side| self.face(side));
        let mut faces: Vec<FaceId> = self.vertex_faces(u).collect();
        faces.sort_unstable();
        let shared = |f: &FaceId| !own.contains(&Some(*f)) && faces.binary_search(f).is_ok();
        match self.vertex_faces(v).find(shared) {
            Some(face) => Err(EditError::SharedFace { edge, face }),
            None => Ok(()),
        }
    }

    /// Returns true if all remaining faces at the ends of `h` will be triangles.
    fn leaves_two_triangles(&self, h: HalfedgeId) -> bool {
        let own = h.edge().halfedges().map(|side| self.face(side));
        let ends = [self.origin(h), self.target(h)];
        ends.into_iter()
            .flat_map(|end| self.vertex_faces(end))
            .all(|face| {
                let degree = self.face_halfedges(face).take(5).count();
                // A triangle at the edge is removed; a quad there becomes a triangle.
                degree == 3 || (degree == 4 && own.contains(&Some(face)))
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::TriangleFaces;

    fn halfedge(mesh: &HalfedgeMesh, origin: u32, target: u32) -> HalfedgeId {
        mesh.halfedge_between(VertexId(origin), VertexId(target))
            .unwrap()
    }

    fn refused(mesh: &HalfedgeMesh, origin: u32, target: u32) -> EditError {
        let mut edited = mesh.clone();
        let h = halfedge(mesh, origin, target);
        let error = edited.collapse(h).unwrap_err();
        assert_eq!(&edited, mesh);
        assert_eq!(mesh.can_collapse(h).as_ref(), Err(&error));
        error
    }

    #[test]
    fn split_then_collapse_restores_the_counts() {
        let mesh = TriangleFaces::octahedron().mesh().unwrap();
        for edge in mesh.edges() {
            let mut edited = mesh.clone();
            let m = edited.split_edge(edge).unwrap().vertex;
            let [u, v] = mesh.edge_vertices(edge);
            for end in [u, v] {
                let mut collapsed = edited.clone();
                let changes = collapsed.collapse(halfedge(&edited, m.0, end.0)).unwrap();
                collapsed.validate().unwrap();
                assert_eq!((changes.gone, changes.into), (m, end));
                assert_eq!(changes.renumbering.vertices(), [(m, None)]);
                assert!(collapsed.halfedge_between(u, v).is_some());
                assert_eq!(collapsed.num_edges(), mesh.num_edges());
                assert_eq!(collapsed.num_faces(), mesh.num_faces());
            }
        }
    }

    #[test]
    fn the_last_elements_fill_the_gaps() {
        let mesh = TriangleFaces::icosahedron().mesh().unwrap();
        let h = halfedge(&mesh, 3, mesh.target(mesh.vertex_halfedge(VertexId(3))).0);
        let mut edited = mesh.clone();
        let changes = edited.collapse(h).unwrap().renumbering;
        edited.validate().unwrap();
        assert_eq!(changes.vertices()[0], (VertexId(3), None));
        assert_eq!(changes.vertices()[1], (VertexId(11), Some(VertexId(3))));
        // Each remaining edge joins the same vertices as before, with u merged into v.
        let renamed = |w| {
            let w = if w == VertexId(3) { mesh.target(h) } else { w };
            changes.vertex(w).unwrap()
        };
        for old in mesh.halfedges() {
            if let Some(new) = changes.halfedge(old) {
                assert_eq!(edited.origin(new), renamed(mesh.origin(old)));
                assert_eq!(edited.target(new), renamed(mesh.target(old)));
            }
        }
    }

    #[test]
    fn tetrahedron_and_triangle_are_refused() {
        let tetrahedron = TriangleFaces::tetrahedron().mesh().unwrap();
        let triangle = HalfedgeMesh::from_faces(3, &[[0, 1, 2]]).unwrap();
        for (a, b) in [(0, 1), (1, 0), (1, 2), (2, 0)] {
            assert!(matches!(
                refused(&tetrahedron, a, b),
                EditError::Flattens { .. }
            ));
            assert!(matches!(
                refused(&triangle, a, b),
                EditError::LastFace { .. }
            ));
        }
        let pillow = HalfedgeMesh::from_faces(3, &[[0, 1, 2], [0, 2, 1]]).unwrap();
        assert!(matches!(
            refused(&pillow, 0, 1),
            EditError::BackToBack { .. }
        ));
    }

    #[test]
    fn pinch_link_and_shared_face_are_refused() {
        // In a strip of four triangles, the inner edges join opposite borders.
        let strip = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]];
        let strip = HalfedgeMesh::from_faces(6, &strip).unwrap();
        assert!(matches!(refused(&strip, 2, 3), EditError::Pinch { .. }));
        assert!(matches!(refused(&strip, 1, 2), EditError::Pinch { .. }));
        // Around a hole with three sides, each side has the third corner as a common neighbour.
        let mut ring = TriangleFaces::octahedron().mesh().unwrap();
        let _ = ring.delete_faces(&[FaceId(0)]).unwrap();
        let [a, b] = ring.edge_vertices(ring.boundary_loops()[0].edge());
        assert!(matches!(
            refused(&ring, a.0, b.0),
            EditError::LinkCondition { .. }
        ));
        // Two quads back to back, one of them with a roof: 0 and 2 are also both corners of the
        // bottom.
        let faces = [vec![0, 1, 2], vec![0, 2, 3], vec![3, 2, 1, 0]];
        let roof = HalfedgeMesh::from_faces(4, &faces).unwrap();
        assert!(matches!(
            refused(&roof, 0, 2),
            EditError::SharedFace {
                face: FaceId(2),
                ..
            }
        ));
    }

    #[test]
    fn polygons_lose_a_corner() {
        let cube = [
            [0, 3, 2, 1],
            [4, 5, 6, 7],
            [0, 1, 5, 4],
            [1, 2, 6, 5],
            [2, 3, 7, 6],
            [3, 0, 4, 7],
        ];
        let mut mesh = HalfedgeMesh::from_faces(8, &cube).unwrap();
        let _ = mesh.collapse(halfedge(&mesh, 0, 1)).unwrap();
        mesh.validate().unwrap();
        let mut degrees: Vec<_> = mesh.faces().map(|f| mesh.degree(f)).collect();
        degrees.sort_unstable();
        assert_eq!(degrees, [3, 3, 4, 4, 4, 4]);
        assert_eq!((mesh.num_vertices(), mesh.num_edges()), (7, 11));
    }
}
