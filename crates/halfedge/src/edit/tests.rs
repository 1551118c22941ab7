//! The guarantees of every edit: topology, invariants, and updated maps.

use proptest::prelude::*;

use super::*;
use crate::ids::{EdgeId, FaceId, HalfedgeId, VertexId};
use crate::map::{EdgeMap, FaceMap, HalfedgeMap, VertexMap};
use crate::mesh::HalfedgeMesh;
use crate::testing::{self, Edit};

/// Checks the guarantees about the topology, and that a rejected edit changes nothing.
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

/// Checks that renumbered maps keep the value of every remaining element.
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

/// Checks that removed elements are gone, and that merged edges were sides of the triangle.
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
        // Both edges lead to the corner opposite the halfedge.
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

/// The corners that a child shares with its parent before the edit.
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

        // The edge split: halves, cuts, and updated maps.
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
            // A map that was already updated no longer fits.
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
        // A long run on one mesh reaches the small cases in which most conditions apply.
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
            // Equal except for the two triangles, which have swapped their ids.
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
