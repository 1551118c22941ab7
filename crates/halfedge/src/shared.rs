//! Rows: vertices of several pieces that are one point of a surface which is not manifold or not
//! consistently oriented.

use crate::build_error::BuildError;
use crate::edit::EditError;
use crate::ids::VertexId;
use crate::map::VertexMap;
use crate::mesh::HalfedgeMesh;
use crate::pieces::{Orientation, Sides};

/// The rows of a mesh that was cut.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Shared {
    /// The row of each vertex after the rows' own.
    rows: Vec<VertexId>,
    /// Per row: whether it has a copy.
    is_copied: Vec<bool>,
    /// Per row: whether it has an edge with a single face.
    is_rim: Vec<bool>,
}

impl HalfedgeMesh {
    /// Builds the connectivity of any list of faces. Edges with more than two faces, vertices
    /// with several fans (bow-ties) and inconsistent orientation are allowed.
    ///
    /// Faces that [`Self::from_faces`] accepts give the same mesh. Others are cut into *pieces*,
    /// each manifold and consistently oriented, in three steps:
    ///
    /// 1. Faces are turned until neighbours agree, as few as possible per surface. (Neighbours
    ///    share an edge with exactly two faces.) A one-sided surface is cut open.
    /// 2. At an edge with more than two faces, two faces stay together if they belong to the same
    ///    surface, no third one there does, and they agree. All others get edges of their own.
    /// 3. Each fan of faces gets a vertex of its own.
    ///
    /// The result depends on the order of the faces only where a one-sided surface is cut, and not
    /// on their directions.
    ///
    /// The `num_vertices` vertices keep their indices, and copies follow. A vertex with all its
    /// copies is one *row* ([`Self::row_of`]), which has the index of that vertex. Faces keep
    /// their indices and first corners.
    ///
    /// # Errors
    /// [`BuildError`] as from [`Self::from_faces`], except for non-manifold edges, several fans
    /// and inconsistent orientation.
    ///
    /// ```
    /// use cotan_halfedge::{HalfedgeMesh, VertexId};
    /// // A book with three pages.
    /// let pages = [[0, 1, 2], [0, 1, 3], [1, 0, 4]];
    /// let mesh = HalfedgeMesh::from_faces_in_pieces(5, &pages)?;
    /// assert_eq!((mesh.num_rows(), mesh.num_vertices()), (5, 9));
    /// assert_eq!(mesh.row_of(VertexId::new(8)), VertexId::new(0));
    /// # Ok::<(), cotan_halfedge::BuildError>(())
    /// ```
    pub fn from_faces_in_pieces<F: AsRef<[u32]>>(
        num_vertices: usize,
        faces: &[F],
    ) -> Result<Self, BuildError> {
        match Self::from_faces(num_vertices, faces) {
            Err(
                BuildError::NonManifoldEdge { .. }
                | BuildError::InconsistentOrientation { .. }
                | BuildError::SeveralFans { .. },
            ) => {}
            result => return result,
        }
        let sides = Sides::new(faces);
        let orientation = Orientation::new(&sides);
        let fans = sides.fans(&orientation);
        let (corners, rows) = sides.copies(num_vertices, &fans);
        let pieces: Vec<Vec<u32>> = (0..faces.len())
            .map(|face| sides.piece_face(&corners, face, orientation.is_turned[face]))
            .collect();
        let mut mesh = Self::from_faces(num_vertices + rows.len(), &pieces)?;
        // Faces that only had to be turned need no copies.
        if !rows.is_empty() {
            mesh.share(num_vertices, rows, &sides);
        }
        Ok(mesh)
    }

    /// Declares the last vertices of a manifold mesh copies of others: `rows` has the row of each.
    /// For a mesh that was cut elsewhere, along seams for example.
    ///
    /// # Errors
    /// [`EditError::NoSuchRow`] for a row that is not a vertex, or itself a copy;
    /// [`EditError::Copies`] if the mesh has copies already.
    ///
    /// ```
    /// use cotan_halfedge::{HalfedgeMesh, VertexId};
    /// // Two triangles that were cut apart along their common edge.
    /// let mesh = HalfedgeMesh::from_faces(6, &[[0, 1, 2], [4, 3, 5]])?;
    /// # // Vertex 3 is the free corner of the second one.
    /// let mesh = mesh.with_copies(vec![VertexId::new(0), VertexId::new(2)])?;
    /// assert_eq!((mesh.num_rows(), mesh.components().count()), (4, 1));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_copies(mut self, rows: Vec<VertexId>) -> Result<Self, EditError> {
        if self.has_copies() {
            return Err(EditError::Copies);
        }
        let num_rows = self.num_vertices().saturating_sub(rows.len());
        if let Some(&row) = rows.iter().find(|row| row.index() >= num_rows) {
            return Err(EditError::NoSuchRow { row, num_rows });
        }
        if rows.is_empty() {
            return Ok(self);
        }
        let row = |v: VertexId| match v.index().checked_sub(num_rows) {
            Some(copy) => rows[copy].index() as u32,
            None => v.index() as u32,
        };
        let of_face = |f| self.face_vertices(f).map(row).collect::<Vec<_>>();
        let faces: Vec<Vec<u32>> = self.faces().map(of_face).collect();
        self.share(num_rows, rows, &Sides::new(&faces));
        Ok(self)
    }

    fn share(&mut self, num_rows: usize, rows: Vec<VertexId>, sides: &Sides) {
        let mut is_copied = vec![false; num_rows];
        rows.iter().for_each(|row| is_copied[row.index()] = true);
        self.shared = Some(Box::new(Shared {
            rows,
            is_copied,
            is_rim: sides.rim(num_rows),
        }));
    }

    /// Returns true if the mesh was cut into pieces and some vertex has copies.
    #[inline]
    pub fn has_copies(&self) -> bool {
        self.shared.is_some()
    }

    /// Number of rows: vertices without their copies. The rows are the first vertices.
    #[inline]
    pub fn num_rows(&self) -> usize {
        let num_copies = self.shared.as_ref().map_or(0, |shared| shared.rows.len());
        self.num_vertices() - num_copies
    }

    /// The row of `vertex`: the vertex that it is a copy of, or itself.
    ///
    /// # Panics
    /// May panic if the mesh has no such vertex.
    #[inline]
    pub fn row_of(&self, vertex: VertexId) -> VertexId {
        match &self.shared {
            None => vertex,
            Some(shared) => {
                let first = shared.is_rim.len();
                let copy = vertex.index().checked_sub(first);
                copy.map_or(vertex, |at| shared.rows[at])
            }
        }
    }

    /// The copies, each with its row.
    pub fn copies(&self) -> impl Iterator<Item = (VertexId, VertexId)> + '_ {
        let rows = self.shared.as_ref().map_or(&[][..], |shared| &shared.rows);
        let first = self.num_rows();
        let copy = move |(at, row): (usize, &VertexId)| (VertexId::new(first + at), *row);
        rows.iter().enumerate().map(copy)
    }

    /// Returns true if another vertex has the same row.
    #[inline]
    pub fn is_shared_vertex(&self, vertex: VertexId) -> bool {
        let shared = self.shared.as_ref();
        shared.is_some_and(|shared| shared.is_copied[self.row_of(vertex).index()])
    }

    /// Returns true if the row of `vertex` has an edge with a single face. Unlike
    /// [`Self::is_boundary_vertex`], this does not count the edges at which a mesh was cut.
    #[inline]
    pub fn is_rim_vertex(&self, vertex: VertexId) -> bool {
        match &self.shared {
            None => self.is_boundary_vertex(vertex),
            Some(shared) => shared.is_rim[self.row_of(vertex).index()],
        }
    }

    /// Returns true if the faces around `vertex` are one closed fan: it is on no boundary and
    /// shares its row with no copy. Curvature and other measures along a normal make sense only
    /// there.
    #[inline]
    pub fn is_inner_vertex(&self, vertex: VertexId) -> bool {
        !self.is_rim_vertex(vertex) && !self.is_shared_vertex(vertex)
    }

    /// All rows in ascending order.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = VertexId> + DoubleEndedIterator + use<> {
        (0..self.num_rows()).map(VertexId::new)
    }

    /// Values per row from values per vertex; those of copies are dropped.
    ///
    /// # Panics
    /// If there are fewer values than rows.
    pub fn to_rows<T: Clone>(&self, of_vertices: &VertexMap<T>) -> VertexMap<T> {
        VertexMap::from_vec(of_vertices.as_slice()[..self.num_rows()].to_vec())
    }

    /// Values per vertex from values per row: each copy has that of its row.
    ///
    /// # Panics
    /// If there is not one value per row.
    pub fn to_vertices<T: Clone>(&self, mut of_rows: VertexMap<T>) -> VertexMap<T> {
        assert_eq!(of_rows.len(), self.num_rows(), "one value per row");
        for (_, row) in self.copies() {
            of_rows.push(of_rows[row].clone());
        }
        of_rows
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    fn pieces(num_vertices: usize, faces: &[[u32; 3]]) -> HalfedgeMesh {
        let mesh = HalfedgeMesh::from_faces_in_pieces(num_vertices, faces).unwrap();
        mesh.validate().unwrap();
        // Every face has its rows, in one direction or the other, from the same corner on.
        for (face, corners) in mesh.faces().zip(faces) {
            let mut rows = mesh.triangle(face).map(|v| mesh.row_of(v).index() as u32);
            if rows != *corners {
                rows[1..].reverse();
            }
            assert_eq!(rows, *corners);
        }
        mesh
    }

    #[test]
    fn a_book_has_a_piece_per_page() {
        let mesh = pieces(5, &[[0, 1, 2], [0, 1, 3], [1, 0, 4]]);
        assert_eq!((mesh.pieces().count(), mesh.components().count()), (3, 1));
        assert_eq!(mesh.components().sizes(), [9]);
        assert!((0..9).all(|v| mesh.is_rim_vertex(VertexId::new(v))));
        assert!(
            mesh.is_shared_vertex(VertexId::new(7)) && !mesh.is_shared_vertex(VertexId::new(2))
        );
    }

    #[test]
    fn inconsistent_faces_are_turned_and_nothing_is_cut() {
        let mut tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
        tetrahedron[2].swap(1, 2);
        let mesh = pieces(4, &tetrahedron);
        assert!(mesh.is_closed() && mesh.num_vertices() == 4);
    }

    #[test]
    fn closed_bodies_that_share_an_edge_or_a_vertex_stay_closed() {
        let tetrahedron = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d], [a, d, b], [b, d, c]];
        for (n, other, shared) in [(6, [0, 1, 4, 5], 2), (7, [0, 4, 5, 6], 1)] {
            let faces = [tetrahedron([0, 1, 2, 3]), tetrahedron(other)].concat();
            let mesh = pieces(n, &faces);
            assert!(mesh.is_closed());
            assert_eq!((mesh.num_rows(), mesh.num_vertices()), (n, n + shared));
            assert!(mesh.vertices().all(|v| !mesh.is_rim_vertex(v)));
        }
    }

    #[test]
    fn a_moebius_strip_is_cut_across() {
        let strip: Vec<[u32; 3]> = (0..5)
            .flat_map(|k| {
                let [a, b, c, d] = [2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 3];
                let at = |v: u32| if v < 10 { v } else { 11 - v };
                [[a, b, c], [b, d, c]].map(|t| t.map(at))
            })
            .collect();
        let mesh = pieces(10, &strip);
        assert_eq!((mesh.pieces().count(), mesh.genus()), (1, 0));
        assert_eq!(mesh.num_vertices(), 12);
        assert_eq!(
            mesh.to_vertices(mesh.to_rows(&VertexMap::filled(12, 1)))
                .len(),
            12
        );
    }

    #[test]
    fn faces_that_come_twice_and_sheets_that_touch_themselves() {
        let twice = pieces(3, &[[0, 1, 2], [0, 1, 2], [2, 1, 0]]);
        assert_eq!(twice.num_rows(), 3);
        // A strip whose last edge is glued to one of its inner edges.
        let strip = [
            [0, 1, 2],
            [2, 1, 3],
            [2, 3, 4],
            [4, 3, 5],
            [4, 5, 0],
            [0, 5, 1],
            [0, 1, 6],
        ];
        let mesh = pieces(7, &strip);
        assert_eq!(mesh.components().count(), 1);
    }

    proptest! {
        #[test]
        fn any_list_of_triangles_has_pieces(
            faces in prop::collection::vec(
                (0u32..7, 1u32..7, 1u32..6).prop_map(|(a, i, j)| {
                    let j = if j >= i { j + 1 } else { j };
                    [a, (a + i) % 7, (a + j) % 7]
                }),
                1..25,
            ),
        ) {
            let mut used: Vec<u32> = faces.iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            let number = |v: &u32| used.binary_search(v).unwrap() as u32;
            let faces: Vec<[u32; 3]> = faces.iter().map(|f| [0, 1, 2].map(|k| number(&f[k]))).collect();
            pieces(used.len(), &faces);
        }

        #[test]
        fn a_manifold_mesh_is_unchanged_even_with_faces_turned(
            mesh in testing::arbitrary_mesh(),
            seed in any::<u64>(),
        ) {
            let mut faces = mesh.to_faces();
            let same = HalfedgeMesh::from_faces_in_pieces(mesh.num_vertices(), &faces).unwrap();
            prop_assert_eq!(same.to_faces(), mesh.to_faces());
            prop_assert!(!same.has_copies());
            for (k, face) in faces.iter_mut().enumerate() {
                if (seed >> (k % 64)) & 1 == 1 {
                    face[1..].reverse();
                }
            }
            let turned = HalfedgeMesh::from_faces_in_pieces(mesh.num_vertices(), &faces).unwrap();
            prop_assert_eq!(turned.topology(), mesh.topology());
        }
    }
}
