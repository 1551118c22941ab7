//! The elements that an edit removed, and those that got a new id to close the gaps.

use super::{EditError, check_length};
use crate::ids::{EdgeId, FaceId, HalfedgeId, Id, VertexId};
use crate::map::{DenseMap, EdgeMap, FaceMap, HalfedgeMap, VertexMap};
use crate::mesh::HalfedgeMesh;

/// The change of ids made by an edit. Apply it to every map that belongs to the mesh.
///
/// There is a sparse list for each kind of element in ascending order of the old ids, with `None`
/// for a removed element and the new id for a moved one. Elements that are not listed keep their
/// ids. Halfedges move with their edges.
///
/// ```
/// use cotan_halfedge::{FaceId, HalfedgeMesh, VertexId, VertexMap};
/// let mut mesh = HalfedgeMesh::from_faces(4, &[[0, 1, 2], [0, 2, 3]])?;
/// let mut names = VertexMap::from_vec(vec!["a", "b", "c", "d"]);
/// let renumbering = mesh.delete_faces(&[FaceId::new(0)])?;
/// renumbering.apply_vertices(&mut names)?;
/// assert_eq!(names.as_slice(), ["a", "c", "d"]);
/// assert_eq!(renumbering.vertex(VertexId::new(1)), None);
/// assert_eq!(renumbering.vertex(VertexId::new(3)), Some(VertexId::new(2)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
#[must_use = "the maps of the mesh must be renumbered too"]
pub struct Renumbering {
    pub(super) vertices: Changes<VertexId>,
    pub(super) edges: Changes<EdgeId>,
    pub(super) faces: Changes<FaceId>,
}

/// The changes for one kind of element.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) struct Changes<I> {
    old_len: usize,
    new_len: usize,
    /// In ascending order of the old ids. A new id is below `new_len`, and its place is free once
    /// all earlier changes have been applied.
    list: Vec<(I, Option<I>)>,
}

impl<I: Id> Changes<I> {
    /// Closes the gaps with the last elements. The list has at most twice as many entries as
    /// `removed`.
    pub(super) fn fill_gaps(old_len: usize, mut removed: Vec<I>) -> Self {
        removed.sort_unstable();
        removed.dedup();
        let new_len = old_len - removed.len();
        let stays = |id: &I| removed.binary_search(id).is_err();
        let last = (new_len..old_len).map(I::new).filter(stays);
        let gaps = removed
            .iter()
            .copied()
            .take_while(|id| id.index() < new_len);
        let moves = last.zip(gaps).map(|(old, gap)| (old, Some(gap)));
        let mut list: Vec<_> = removed.iter().map(|&id| (id, None)).chain(moves).collect();
        list.sort_unstable_by_key(|&(old, _)| old);
        Self {
            old_len,
            new_len,
            list,
        }
    }

    /// Closes the gaps by moving all later elements up, which preserves the order of the others.
    pub(super) fn move_up(removed: &DenseMap<I, bool>) -> Self {
        let mut new_len = 0;
        let mut list = Vec::new();
        for (old, &is_removed) in removed.iter() {
            if is_removed {
                list.push((old, None));
                continue;
            }
            if old.index() != new_len {
                list.push((old, Some(I::new(new_len))));
            }
            new_len += 1;
        }
        Self {
            old_len: removed.len(),
            new_len,
            list,
        }
    }

    /// Old and new ids of the moved elements, in the order of `list`.
    fn moves(&self) -> impl Iterator<Item = (I, I)> + '_ {
        self.list.iter().filter_map(|&(old, new)| Some((old, new?)))
    }

    fn new_id(&self, old: I) -> Option<I> {
        match self.list.binary_search_by_key(&old, |&(id, _)| id) {
            Ok(at) => self.list[at].1,
            Err(_) => (old.index() < self.old_len).then_some(old),
        }
    }

    fn apply<T>(&self, elements: &'static str, map: &mut DenseMap<I, T>) -> Result<(), EditError> {
        check_length(elements, self.old_len, map.len())?;
        for (old, new) in self.moves() {
            map.as_mut_slice().swap(old.index(), new.index());
        }
        map.truncate(self.new_len);
        Ok(())
    }
}

impl Renumbering {
    /// The removed (`None`) and moved vertices, in ascending order of their old ids.
    pub fn vertices(&self) -> &[(VertexId, Option<VertexId>)] {
        &self.vertices.list
    }

    /// The removed (`None`) and moved edges, in ascending order of their old ids.
    pub fn edges(&self) -> &[(EdgeId, Option<EdgeId>)] {
        &self.edges.list
    }

    /// The removed (`None`) and moved faces, in ascending order of their old ids.
    pub fn faces(&self) -> &[(FaceId, Option<FaceId>)] {
        &self.faces.list
    }

    /// The new id of the vertex that was `old`, or `None` if it was removed.
    pub fn vertex(&self, old: VertexId) -> Option<VertexId> {
        self.vertices.new_id(old)
    }

    /// The new id of the halfedge that was `old`, or `None` if it was removed.
    pub fn halfedge(&self, old: HalfedgeId) -> Option<HalfedgeId> {
        let [first, second] = self.edge(old.edge())?.halfedges();
        Some(if old == old.edge().halfedge() {
            first
        } else {
            second
        })
    }

    /// The new id of the edge that was `old`, or `None` if it was removed.
    pub fn edge(&self, old: EdgeId) -> Option<EdgeId> {
        self.edges.new_id(old)
    }

    /// The new id of the face that was `old`, or `None` if it was removed.
    pub fn face(&self, old: FaceId) -> Option<FaceId> {
        self.faces.new_id(old)
    }

    /// Updates a vertex map to match the edited mesh.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_vertices<T>(&self, map: &mut VertexMap<T>) -> Result<(), EditError> {
        self.vertices.apply("vertices", map)
    }

    /// Updates a halfedge map to match the edited mesh.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_halfedges<T>(&self, map: &mut HalfedgeMap<T>) -> Result<(), EditError> {
        check_length("halfedges", 2 * self.edges.old_len, map.len())?;
        for (old, new) in self.edges.moves() {
            for (from, to) in old.halfedges().into_iter().zip(new.halfedges()) {
                map.as_mut_slice().swap(from.index(), to.index());
            }
        }
        map.truncate(2 * self.edges.new_len);
        Ok(())
    }

    /// Updates an edge map to match the edited mesh.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_edges<T>(&self, map: &mut EdgeMap<T>) -> Result<(), EditError> {
        self.edges.apply("edges", map)
    }

    /// Updates a face map to match the edited mesh.
    ///
    /// # Errors
    /// [`EditError::MapLength`] if the map does not match the mesh before the edit.
    pub fn apply_faces<T>(&self, map: &mut FaceMap<T>) -> Result<(), EditError> {
        self.faces.apply("faces", map)
    }
}

impl HalfedgeMesh {
    /// Moves the elements to their new places and drops the rest.
    ///
    /// No remaining element may refer to a removed one. Moving an edge takes constant time,
    /// moving a vertex or a face takes time proportional to its valence or degree.
    pub(super) fn renumber(&mut self, renumbering: &Renumbering) {
        for (old, new) in renumbering.edges.moves() {
            self.move_edge(old, new);
        }
        let num_halfedges = 2 * renumbering.edges.new_len;
        self.target.truncate(num_halfedges);
        self.next.truncate(num_halfedges);
        self.prev.truncate(num_halfedges);
        self.face.truncate(num_halfedges);
        for (old, new) in renumbering.faces.moves() {
            self.move_face(old, new);
        }
        self.face_halfedge.truncate(renumbering.faces.new_len);
        for (old, new) in renumbering.vertices.moves() {
            self.move_vertex(old, new);
        }
        self.vertex_halfedge.truncate(renumbering.vertices.new_len);
    }

    fn move_edge(&mut self, old: EdgeId, new: EdgeId) {
        let (from, to) = (old.halfedges(), new.halfedges());
        // No edge links to itself: each remaining vertex has at least two edges.
        for side in 0..2 {
            let (next, prev) = (self.next(from[side]), self.prev(from[side]));
            self.set_target(to[side], self.target(from[side]));
            self.copy_face(from[side], to[side]);
            self.link(to[side], next);
            self.link(prev, to[side]);
        }
        for side in 0..2 {
            let origin = self.origin(to[side]).index();
            if self.vertex_halfedge[origin] == from[side] {
                self.vertex_halfedge[origin] = to[side];
            }
            if let Some(face) = self.face(to[side])
                && self.face_halfedge(face) == from[side]
            {
                self.face_halfedge[face.index()] = to[side];
            }
        }
    }

    fn move_face(&mut self, old: FaceId, new: FaceId) {
        let first = self.face_halfedge(old);
        self.face_halfedge[new.index()] = first;
        let mut h = first;
        loop {
            self.face[h.index()] = new.0;
            h = self.next(h);
            if h == first {
                return;
            }
        }
    }

    fn move_vertex(&mut self, old: VertexId, new: VertexId) {
        let first = self.vertex_halfedge(old);
        self.vertex_halfedge[new.index()] = first;
        let mut h = first;
        loop {
            self.set_target(h.twin(), new);
            h = self.next(h.twin());
            if h == first {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(changes: &Changes<FaceId>) -> Vec<(usize, Option<usize>)> {
        changes
            .list
            .iter()
            .map(|&(old, new)| (old.index(), new.map(FaceId::index)))
            .collect()
    }

    #[test]
    fn gaps_are_filled_from_the_end() {
        let changes = Changes::fill_gaps(10, vec![FaceId(8), FaceId(3), FaceId(1)]);
        let expected = [(1, None), (3, None), (7, Some(1)), (8, None), (9, Some(3))];
        assert_eq!(pairs(&changes), expected);
        let mut map = FaceMap::from_fn(10, FaceId::index);
        changes.apply("faces", &mut map).unwrap();
        assert_eq!(map.as_slice(), [0, 7, 2, 9, 4, 5, 6]);
    }

    #[test]
    fn moving_up_keeps_the_order() {
        let removed = FaceMap::from_fn(6, |f: FaceId| [1, 4].contains(&f.index()));
        let changes = Changes::move_up(&removed);
        let expected = [
            (1, None),
            (2, Some(1)),
            (3, Some(2)),
            (4, None),
            (5, Some(3)),
        ];
        assert_eq!(pairs(&changes), expected);
        let mut map = FaceMap::from_fn(6, FaceId::index);
        changes.apply("faces", &mut map).unwrap();
        assert_eq!(map.as_slice(), [0, 2, 3, 5]);
    }

    #[test]
    fn a_map_of_another_mesh_is_refused() {
        let changes = Changes::fill_gaps(10, vec![FaceId(8)]);
        let mut map = FaceMap::filled(9, 'x');
        let error = changes.apply("faces", &mut map).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the map has 9 entries, but there were 10 faces before the edit"
        );
        assert_eq!(map.len(), 9);
    }
}
