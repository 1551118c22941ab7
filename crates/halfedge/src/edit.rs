//! Local changes of the connectivity. Every edit checks first and changes then, so that a
//! refused edit leaves the mesh as it was; there are no tombstones, so that ids stay 0, 1, 2, …
//!
//! | edit | adds | takes away |
//! |---|---|---|
//! | [`HalfedgeMesh::flip_edge`] | | |
//! | [`HalfedgeMesh::split_edge`] | a vertex, up to three edges, up to two faces | |
//! | [`HalfedgeMesh::split_face`] | a vertex, an edge a corner, a face a corner less one | |
//! | [`HalfedgeMesh::connect_corners`] | an edge, a face | |
//! | [`HalfedgeMesh::triangulate`] | edges and faces | |
//! | [`HalfedgeMesh::collapse`] | | a vertex, up to three edges, up to two faces |
//! | [`HalfedgeMesh::delete_faces`] | | faces, and the edges and vertices that only they use |
//!
//! New elements get the numbers after the last one, so a map is kept up with
//! [`DenseMap::push`](crate::DenseMap::push). Edits return the elements that are new with those
//! they come from ([`SplitEdge`], [`SplitFace`], [`CutFace`]), so that attributes can follow.
//! Edits that take elements away return a [`Renumbering`] to apply to the maps, a collapse as a
//! part of [`Collapsed`].

mod collapse;
mod delete;
mod flip;
mod renumbering;
mod split_edge;
mod split_face;
mod triangulate;

use thiserror::Error;

use crate::ids::{EdgeId, FaceId, HalfedgeId, Id, NONE, VertexId};
use crate::map::DenseMap;
use crate::mesh::HalfedgeMesh;

pub use collapse::{ClosedFace, Collapsed};
pub use flip::FlippedEdge;
pub use renumbering::Renumbering;
pub use split_edge::SplitEdge;
pub use split_face::{CutFace, SplitFace};

/// Why an edit was refused. The mesh is as it was before.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum EditError {
    /// An edge that the mesh does not have.
    #[error("there is no edge {edge}: the mesh has {num_edges} (numbered from 0)")]
    NoSuchEdge {
        /// The edge that was given.
        edge: EdgeId,
        /// How many there are.
        num_edges: usize,
    },
    /// A halfedge that the mesh does not have.
    #[error("there is no halfedge {halfedge}: the mesh has {num_halfedges} (numbered from 0)")]
    NoSuchHalfedge {
        /// The halfedge that was given.
        halfedge: HalfedgeId,
        /// How many there are.
        num_halfedges: usize,
    },
    /// A face that the mesh does not have.
    #[error("there is no face {face}: the mesh has {num_faces} (numbered from 0)")]
    NoSuchFace {
        /// The face that was given.
        face: FaceId,
        /// How many there are.
        num_faces: usize,
    },
    /// A component that the mesh does not have.
    #[error("there is no component {component}: the mesh has {num_components} (numbered from 0)")]
    NoSuchComponent {
        /// The component that was given.
        component: usize,
        /// How many there are.
        num_components: usize,
    },
    /// More elements than 32-bit ids can number.
    #[error("the mesh is full: {num_edges} edges are as many as its ids can number")]
    TooLarge {
        /// How many edges there would be.
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
        /// How many fans would be left there.
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
        /// What the map is about.
        elements: &'static str,
        /// How many entries the map should have.
        expected: usize,
        /// How many it has.
        found: usize,
    },
}

/// Appends for every child a clone of its parent's value. The children have the next numbers.
fn inherit<I: Id, T: Clone>(
    elements: &'static str,
    map: &mut DenseMap<I, T>,
    children: impl IntoIterator<Item = (I, I)>,
) -> Result<(), EditError> {
    for (parent, child) in children {
        check_length(elements, child.index(), map.len())?;
        map.push(map[parent].clone());
    }
    Ok(())
}

fn check_length(elements: &'static str, expected: usize, found: usize) -> Result<(), EditError> {
    (found == expected)
        .then_some(())
        .ok_or(EditError::MapLength {
            elements,
            expected,
            found,
        })
}

/// Checks that several edits share.
impl HalfedgeMesh {
    fn check_edge(&self, edge: EdgeId) -> Result<(), EditError> {
        let num_edges = self.num_edges();
        (edge.index() < num_edges)
            .then_some(())
            .ok_or(EditError::NoSuchEdge { edge, num_edges })
    }

    fn check_halfedge(&self, halfedge: HalfedgeId) -> Result<(), EditError> {
        let num_halfedges = self.num_halfedges();
        (halfedge.index() < num_halfedges)
            .then_some(())
            .ok_or(EditError::NoSuchHalfedge {
                halfedge,
                num_halfedges,
            })
    }

    fn check_face(&self, face: FaceId) -> Result<(), EditError> {
        let num_faces = self.num_faces();
        (face.index() < num_faces)
            .then_some(())
            .ok_or(EditError::NoSuchFace { face, num_faces })
    }

    /// That `more` edges still get numbers. Vertices and faces are fewer than edges.
    fn check_room(&self, more: usize) -> Result<(), EditError> {
        let num_edges = self.num_edges().saturating_add(more);
        (num_edges <= MOST_EDGES)
            .then_some(())
            .ok_or(EditError::TooLarge { num_edges })
    }

    fn check_no_edge(&self, a: VertexId, b: VertexId) -> Result<(), EditError> {
        match self.halfedge_between(a, b) {
            Some(h) => Err(EditError::EdgeExists {
                vertices: [a, b],
                edge: h.edge(),
            }),
            None => Ok(()),
        }
    }

    /// Whether `halfedge` has a triangle on its left.
    fn has_triangle(&self, halfedge: HalfedgeId) -> bool {
        !self.is_boundary_halfedge(halfedge)
            && self.next(self.next(self.next(halfedge))) == halfedge
    }
}

/// The steps that edits are made of. Between two of them the mesh may be broken.
impl HalfedgeMesh {
    /// Makes `after` follow `before`.
    fn link(&mut self, before: HalfedgeId, after: HalfedgeId) {
        self.next[before.index()] = after;
        self.prev[after.index()] = before;
    }

    fn set_target(&mut self, halfedge: HalfedgeId, vertex: VertexId) {
        self.target[halfedge.index()] = vertex;
    }

    fn copy_face(&mut self, from: HalfedgeId, to: HalfedgeId) {
        self.face[to.index()] = self.face[from.index()];
    }

    /// Appends an edge without links and faces; the halfedge from `origin` to `target`.
    fn push_edge(&mut self, origin: VertexId, target: VertexId) -> HalfedgeId {
        let h = HalfedgeId::new(self.num_halfedges());
        self.target.extend([target, origin]);
        self.next.extend([h, h.twin()]);
        self.prev.extend([h, h.twin()]);
        self.face.extend([NONE; 2]);
        h
    }

    /// Appends a face whose halfedges are the loop of `first`. O(degree).
    fn push_face(&mut self, first: HalfedgeId) -> FaceId {
        let face = FaceId::new(self.num_faces());
        self.face_halfedge.push(first);
        let mut h = first;
        loop {
            self.face[h.index()] = face.0;
            h = self.next(h);
            if h == first {
                return face;
            }
        }
    }

    /// Joins the origins of two halfedges of one face by a new edge.
    ///
    /// ```text
    ///    ◀───── to            ◀───── to
    ///   ╱         ▲          ╱    f    ▲ new face:
    ///  ▼     f     ╲   ──▶  ▼  ──────▶  ╲ from … up to `to`
    ///   ╲         ╱          ╲  result ╱
    ///    ● from ─▶            ● from ─▶
    /// ```
    ///
    /// The result runs from the origin of `from` to that of `to` and has the old face on its
    /// left. Takes as long as the cut-off part has corners.
    fn cut_face(&mut self, from: HalfedgeId, to: HalfedgeId) -> HalfedgeId {
        let (before_from, before_to) = (self.prev(from), self.prev(to));
        let cut = self.push_edge(self.origin(from), self.origin(to));
        self.copy_face(from, cut);
        self.link(before_from, cut);
        self.link(cut, to);
        self.link(before_to, cut.twin());
        self.link(cut.twin(), from);
        let old_face = self.face(cut);
        let new_face = self.push_face(cut.twin());
        if let Some(face) = old_face
            && self.face(self.face_halfedge(face)) == Some(new_face)
        {
            // The first halfedge went over to the new face.
            self.face_halfedge[face.index()] = cut;
        }
        cut
    }
}

/// Edges whose halfedges all have numbers below `NONE`.
pub(crate) const MOST_EDGES: usize = (1 << 31) - 2;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::map::{EdgeMap, FaceMap, HalfedgeMap, VertexMap};
    use crate::testing::{self, Edit};

    /// What an edit promises about the topology, and that a refusal changes nothing.
    fn check(edit: &Edit, mesh: &mut HalfedgeMesh) -> Result<(), TestCaseError> {
        let before = mesh.clone();
        let result = edit.apply(mesh);
        prop_assert_eq!(mesh.validate(), Ok(()), "after {:?}", edit);
        testing::check_euler(mesh)?;
        if result.is_err() {
            prop_assert_eq!(mesh, &before);
        } else if !matches!(edit, Edit::DeleteFaces(_)) {
            let shape = |mesh: &HalfedgeMesh| {
                let mut shape: Vec<_> = mesh
                    .topology()
                    .iter()
                    .map(|p| (p.genus(), p.num_boundary_loops))
                    .collect();
                shape.sort_unstable();
                shape
            };
            prop_assert_eq!(shape(mesh), shape(&before), "after {:?}", edit);
        }
        Ok(())
    }

    /// Renumbered maps must say of every element that stays what they said before.
    fn check_renumbering(
        before: &HalfedgeMesh,
        after: &HalfedgeMesh,
        renumbering: &Renumbering,
    ) -> Result<(), TestCaseError> {
        let mut vertices: VertexMap<_> = before.vertices().collect();
        let mut halfedges: HalfedgeMap<_> = before.halfedges().collect();
        let mut edges: EdgeMap<_> = before.edges().collect();
        let mut faces: FaceMap<_> = before.faces().collect();
        renumbering.apply_vertices(&mut vertices).unwrap();
        renumbering.apply_halfedges(&mut halfedges).unwrap();
        renumbering.apply_edges(&mut edges).unwrap();
        renumbering.apply_faces(&mut faces).unwrap();
        prop_assert_eq!(vertices.len(), after.num_vertices());
        prop_assert_eq!(halfedges.len(), after.num_halfedges());
        prop_assert_eq!(edges.len(), after.num_edges());
        prop_assert_eq!(faces.len(), after.num_faces());
        for (new, &old) in vertices.iter() {
            prop_assert_eq!(renumbering.vertex(old), Some(new));
        }
        for (new, &old) in halfedges.iter() {
            prop_assert_eq!(renumbering.halfedge(old), Some(new));
        }
        for (new, &old) in edges.iter() {
            prop_assert_eq!(renumbering.edge(old), Some(new));
        }
        for (new, &old) in faces.iter() {
            prop_assert_eq!(renumbering.face(old), Some(new));
        }
        let gone = before
            .vertices()
            .filter(|&v| renumbering.vertex(v).is_none())
            .count();
        prop_assert_eq!(gone, before.num_vertices() - after.num_vertices());
        Ok(())
    }

    /// Removed elements must be gone, and merged edges must have met in the triangle.
    fn check_collapsed(
        before: &HalfedgeMesh,
        after: &HalfedgeMesh,
        halfedge: HalfedgeId,
        collapsed: &Collapsed,
    ) -> Result<(), TestCaseError> {
        let new = &collapsed.renumbering;
        prop_assert_eq!(collapsed.gone, before.origin(halfedge));
        prop_assert_eq!(collapsed.into, before.target(halfedge));
        prop_assert_eq!(collapsed.edge, halfedge.edge());
        prop_assert_eq!(new.vertex(collapsed.gone), None);
        prop_assert_eq!(new.edge(collapsed.edge), None);
        let mut num_edges = before.num_edges() - 1;
        for (closed, side) in collapsed.closed.iter().zip([halfedge, halfedge.twin()]) {
            let Some(ClosedFace { face, gone, into }) = *closed else {
                continue;
            };
            num_edges -= 1;
            prop_assert_eq!(before.face(side), Some(face));
            prop_assert_eq!((new.face(face), new.edge(gone)), (None, None));
            // Both edges lead to the corner opposite to the halfedge.
            let apex = before.target(before.next(side));
            for (edge, end) in [(gone, collapsed.gone), (into, collapsed.into)] {
                let mut ends = before.edge_vertices(edge);
                ends.sort_unstable();
                prop_assert_eq!(ends, [apex.min(end), apex.max(end)]);
            }
            let mut merged = after.edge_vertices(new.edge(into).unwrap());
            merged.sort_unstable();
            let mut expected = [apex, collapsed.into].map(|v| new.vertex(v).unwrap());
            expected.sort_unstable();
            prop_assert_eq!(merged, expected);
        }
        prop_assert_eq!(after.num_edges(), num_edges);
        Ok(())
    }

    /// The corners that a child has in common with its parent before the edit.
    fn is_part(
        before: &HalfedgeMesh,
        after: &HalfedgeMesh,
        parent: FaceId,
        part: FaceId,
        new: &[VertexId],
    ) -> bool {
        let corners: Vec<_> = before.face_vertices(parent).collect();
        after
            .face_vertices(part)
            .all(|v| corners.contains(&v) || new.contains(&v))
    }

    proptest! {
        #[test]
        fn children_lie_in_their_parents(
            mesh in testing::arbitrary_mesh(),
            at in any::<prop::sample::Index>(),
            steps in 1..6_usize,
        ) {
            let mut faces: FaceMap<_> = mesh.faces().collect();
            let mut edges: EdgeMap<_> = mesh.edges().map(Some).collect();

            // The edge split: halves, cuts, and the maps that follow.
            let edge = EdgeId::new(at.index(mesh.num_edges()));
            let mut edited = mesh.clone();
            if let Ok(split) = edited.split_edge(edge) {
                split.apply_faces(&mut faces).unwrap();
                split.apply_edges(&mut edges, None).unwrap();
                prop_assert_eq!(faces.len(), edited.num_faces());
                prop_assert_eq!(edges.len(), edited.num_edges());
                prop_assert_eq!(split.ends, mesh.edge_vertices(edge));
                prop_assert_eq!(split.vertex.index(), mesh.num_vertices());
                for (half, end) in split.halves.into_iter().zip(split.ends) {
                    let ends = edited.edge_vertices(half);
                    prop_assert!(ends.contains(&end) && ends.contains(&split.vertex));
                    prop_assert_eq!(edges[half], Some(edge));
                }
                for cut in split.cuts.into_iter().flatten() {
                    let sides = cut.edge.halfedges().map(|h| edited.face(h));
                    prop_assert!(sides.contains(&Some(cut.parent)));
                    prop_assert!(sides.contains(&Some(cut.child)));
                    prop_assert!(edited.edge_vertices(cut.edge).contains(&split.vertex));
                    prop_assert_eq!(edges[cut.edge], None);
                }
                for (part, &parent) in &faces {
                    prop_assert!(is_part(&mesh, &edited, parent, part, &[split.vertex]));
                }
                // A map of the mesh after the edit does not fit once more.
                prop_assert!(split.apply_faces(&mut faces).is_err() == split.faces().next().is_some());
            }

            // The face split.
            let face = FaceId::new(at.index(mesh.num_faces()));
            let mut edited = mesh.clone();
            let mut faces: FaceMap<_> = mesh.faces().collect();
            let split = edited.split_face(face).unwrap();
            split.apply_faces(&mut faces).unwrap();
            prop_assert_eq!(faces.len(), edited.num_faces());
            prop_assert_eq!(&split.corners, &mesh.face_vertices(face).collect::<Vec<_>>());
            prop_assert_eq!(split.parent, face);
            for (&spoke, &corner) in split.edges.iter().zip(&split.corners) {
                prop_assert_eq!(edited.edge_vertices(spoke), [split.vertex, corner]);
            }
            for (part, &parent) in &faces {
                prop_assert!(is_part(&mesh, &edited, parent, part, &[split.vertex]));
                if part == face || split.children.contains(&part) {
                    prop_assert!(edited.face_vertices(part).any(|v| v == split.vertex));
                }
            }

            // The diagonal.
            let mut edited = mesh.clone();
            let mut faces: FaceMap<_> = mesh.faces().collect();
            let from = HalfedgeId::new(at.index(mesh.num_halfedges()));
            let to = (0..steps).fold(from, |h, _| mesh.next(h));
            if let Ok(cut) = edited.connect_corners(from, to) {
                cut.apply_faces(&mut faces).unwrap();
                prop_assert_eq!(faces.len(), edited.num_faces());
                let sides = cut.edge.halfedges().map(|h| edited.face(h));
                prop_assert_eq!(sides, [Some(cut.parent), Some(cut.child)]);
                for (part, &parent) in &faces {
                    prop_assert!(is_part(&mesh, &edited, parent, part, &[]));
                }
            }
        }

        #[test]
        fn any_edits_keep_every_invariant(
            mut mesh in testing::arbitrary_mesh(),
            edits in testing::edits(40),
        ) {
            for edit in &edits {
                check(edit, &mut mesh)?;
            }
            let rebuilt = HalfedgeMesh::from_faces(mesh.num_vertices(), &mesh.to_faces()).unwrap();
            prop_assert_eq!(rebuilt.to_faces(), mesh.to_faces());
            prop_assert_eq!(rebuilt.topology(), mesh.topology());
        }

        #[test]
        fn collapses_as_far_as_they_go(
            mesh in testing::triangle_mesh(),
            order in prop::collection::vec(any::<prop::sample::Index>(), 200),
        ) {
            // A long run on one mesh reaches the small cases where most conditions bite.
            let mut small = mesh.clone();
            for at in order {
                let h = HalfedgeId::new(at.index(small.num_halfedges()));
                let before = small.clone();
                let can_collapse = before.can_collapse(h);
                let collapsed = small.collapse(h);
                prop_assert_eq!(collapsed.as_ref().map(drop), can_collapse.as_ref().map(drop));
                match collapsed {
                    Ok(collapsed) => {
                        check_renumbering(&before, &small, &collapsed.renumbering)?;
                        check_collapsed(&before, &small, h, &collapsed)?;
                    }
                    Err(_) => prop_assert_eq!(&small, &before),
                }
            }
            prop_assert_eq!(small.validate(), Ok(()));
            prop_assert!(small.is_triangle_mesh());
            prop_assert_eq!(small.components().count(), mesh.components().count());
            prop_assert_eq!(small.genus(), mesh.genus());
            prop_assert_eq!(small.boundary_loops().len(), mesh.boundary_loops().len());
        }

        #[test]
        fn deletion_keeps_the_other_faces(
            mesh in testing::arbitrary_mesh(),
            choice in prop::collection::vec(any::<prop::sample::Index>(), 1..8),
        ) {
            let faces: Vec<_> =
                choice.iter().map(|at| FaceId::new(at.index(mesh.num_faces()))).collect();
            let mut edited = mesh.clone();
            match edited.delete_faces(&faces) {
                Ok(renumbering) => {
                    prop_assert_eq!(edited.validate(), Ok(()));
                    check_renumbering(&mesh, &edited, &renumbering)?;
                    let stay: Vec<Vec<_>> = mesh
                        .faces()
                        .filter(|face| !faces.contains(face))
                        .map(|f| mesh.face_vertices(f).map(|v| renumbering.vertex(v)).collect())
                        .collect();
                    let found: Vec<Vec<_>> = edited
                        .faces()
                        .map(|f| edited.face_vertices(f).map(Some).collect())
                        .collect();
                    prop_assert_eq!(found, stay);
                }
                Err(EditError::BowTie { vertex, num_fans }) => {
                    prop_assert_eq!(&edited, &mesh);
                    prop_assert!(num_fans > 1);
                    prop_assert!(mesh.vertex_faces(vertex).any(|f| faces.contains(&f)));
                }
                Err(error) => return Err(TestCaseError::fail(error.to_string())),
            }
        }

        #[test]
        fn split_then_collapse_restores_the_counts(
            mesh in testing::triangle_mesh(),
            at in any::<prop::sample::Index>(),
        ) {
            let edge = EdgeId::new(at.index(mesh.num_edges()));
            let mut edited = mesh.clone();
            let m = edited.split_edge(edge).unwrap().vertex;
            prop_assert!(edited.is_triangle_mesh());
            let half = edited.halfedge_between(m, mesh.edge_vertices(edge)[1]).unwrap();
            let _ = edited.collapse(half).unwrap();
            prop_assert_eq!(edited.topology(), mesh.topology());
        }

        #[test]
        fn triangles_say_which_face_they_come_from(mesh in testing::polygon_mesh()) {
            let mut cut = mesh.clone();
            let source = cut.triangulate().unwrap();
            prop_assert_eq!(cut.validate(), Ok(()));
            prop_assert!(cut.is_triangle_mesh());
            prop_assert_eq!(source.len(), cut.num_faces());
            let mut parts = FaceMap::filled(mesh.num_faces(), 0);
            for (part, &face) in source.iter() {
                parts[face] += 1;
                let corners: Vec<_> = mesh.face_vertices(face).collect();
                prop_assert!(cut.face_vertices(part).all(|v| corners.contains(&v)));
            }
            for face in mesh.faces() {
                prop_assert_eq!(parts[face] + 2, mesh.degree(face));
            }
        }

        #[test]
        fn two_flips_restore_the_edge(
            mesh in testing::closed_mesh(),
            at in any::<prop::sample::Index>(),
        ) {
            let edge = EdgeId::new(at.index(mesh.num_edges()));
            let mut flipped = mesh.clone();
            if flipped.flip_edge(edge).is_ok() {
                flipped.flip_edge(edge).unwrap();
                let [u, v] = mesh.edge_vertices(edge);
                prop_assert_eq!(flipped.edge_vertices(edge), [v, u]);
                // Up to the two triangles, which have swapped their numbers.
                let rings = |mesh: &HalfedgeMesh| -> Vec<Vec<VertexId>> {
                    let sorted = |v| {
                        let mut ring: Vec<_> = mesh.one_ring(v).collect();
                        ring.sort_unstable();
                        ring
                    };
                    mesh.vertices().map(sorted).collect()
                };
                prop_assert_eq!(rings(&flipped), rings(&mesh));
            }
        }
    }
}
