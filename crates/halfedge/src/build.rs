//! Construction from faces in linear time. Errors name the element at fault.
//!
//! Corner c of the face list is the halfedge from the vertex of that corner to the vertex of the
//! next one. Corners are bucketed by the smaller of their two vertices in one counting pass,
//! which puts the two sides of an edge into the same bucket of a few entries. There is no hash
//! map and no allocation per edge.

use crate::build_error::BuildError;
use crate::edit::MAX_EDGES;
use crate::ids::{FaceId, HalfedgeId, NONE, VertexId};
use crate::map::HalfedgeMap;
use crate::mesh::HalfedgeMesh;

impl HalfedgeMesh {
    /// Builds the connectivity of `num_vertices` vertices and the given faces.
    ///
    /// Each face lists its corners counter-clockwise as seen from the outside and has at least
    /// three of them. Vertices and faces keep their indices. The first halfedge of a face starts
    /// at its first corner. Edges are numbered by their first appearance in the faces. The time
    /// is linear in the number of corners (two passes over them and one counting sort).
    ///
    /// # Errors
    /// The first defect found, checked in this order: sizes (including more vertices than
    /// corners), corners of a face, edges, vertices. See [`BuildError`].
    ///
    /// ```
    /// use cotan_halfedge::HalfedgeMesh;
    /// let tetrahedron = [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]];
    /// let mesh = HalfedgeMesh::from_faces(4, &tetrahedron)?;
    /// assert_eq!((mesh.num_edges(), mesh.num_faces()), (6, 4));
    /// # Ok::<(), cotan_halfedge::BuildError>(())
    /// ```
    pub fn from_faces<F: AsRef<[u32]>>(
        num_vertices: usize,
        faces: &[F],
    ) -> Result<Self, BuildError> {
        let corners = Corners::gather(num_vertices, faces)?;
        let twins = corners.match_twins()?;
        let mut mesh = corners.link(&twins);
        corners.link_boundary(&twins, &mut mesh)?;
        mesh.check_fans()?;
        Ok(mesh)
    }
}

/// The faces, flattened: one entry per corner.
struct Corners {
    num_vertices: usize,
    /// The first corner of each face, followed by the total number of corners.
    starts: Vec<u32>,
    origins: Vec<u32>,
    targets: Vec<u32>,
}

impl Corners {
    fn gather<F: AsRef<[u32]>>(num_vertices: usize, faces: &[F]) -> Result<Self, BuildError> {
        let num_corners = faces
            .iter()
            .fold(0usize, |sum, face| sum.saturating_add(face.as_ref().len()));
        for (elements, count) in [("vertices", num_vertices), ("corners", num_corners)] {
            // There may be as many edges as corners.
            if count > MAX_EDGES {
                return Err(BuildError::TooLarge { elements, count });
            }
        }
        if num_vertices > num_corners {
            return Err(first_unused(faces, num_corners));
        }
        let mut corners = Self {
            num_vertices,
            starts: Vec::with_capacity(faces.len() + 1),
            origins: Vec::with_capacity(num_corners),
            targets: Vec::with_capacity(num_corners),
        };
        corners.starts.push(0);
        let mut sorted = Vec::new();
        for (face, polygon) in faces.iter().enumerate() {
            corners.push_face(face, polygon.as_ref(), &mut sorted)?;
        }
        Ok(corners)
    }

    /// Checks and appends a face; `sorted` is scratch space.
    fn push_face(
        &mut self,
        face: usize,
        polygon: &[u32],
        sorted: &mut Vec<u32>,
    ) -> Result<(), BuildError> {
        let (&first, rest) = match polygon.split_first() {
            Some(split) if polygon.len() >= 3 => split,
            _ => {
                return Err(BuildError::TooFewCorners {
                    face,
                    degree: polygon.len(),
                });
            }
        };
        let num_vertices = self.num_vertices;
        if let Some(&v) = polygon.iter().find(|&&v| v as usize >= num_vertices) {
            return Err(BuildError::IndexOutOfRange {
                face,
                vertex: v as usize,
                num_vertices,
            });
        }
        if let Some(v) = repeated(polygon, sorted) {
            return Err(BuildError::RepeatedVertex {
                face,
                vertex: VertexId(v),
            });
        }
        self.origins.extend_from_slice(polygon);
        self.targets.extend_from_slice(rest);
        self.targets.push(first);
        self.starts.push(self.origins.len() as u32);
        Ok(())
    }

    /// The face of corner `c`. A binary search, used only for errors.
    fn face_of(&self, c: u32) -> usize {
        self.starts.partition_point(|&start| start <= c) - 1
    }

    /// For each corner, the corner on the other side of its edge, or `NONE`.
    fn match_twins(&self) -> Result<Vec<u32>, BuildError> {
        let n = self.origins.len();
        let low = |c: usize| self.origins[c].min(self.targets[c]) as usize;
        let mut bucket_ends = vec![0u32; self.num_vertices + 1];
        for c in 0..n {
            bucket_ends[low(c) + 1] += 1;
        }
        for v in 0..self.num_vertices {
            bucket_ends[v + 1] += bucket_ends[v];
        }
        // One bucket per smaller vertex, filled in corner order.
        let mut entries = vec![Side(0); n];
        let mut cursor = bucket_ends.clone();
        for c in 0..n {
            let slot = &mut cursor[low(c)];
            entries[*slot as usize] = Side::new(self.origins[c], self.targets[c], c);
            *slot += 1;
        }
        let mut twins = vec![NONE; n];
        for v in 0..self.num_vertices {
            let bucket = &mut entries[bucket_ends[v] as usize..bucket_ends[v + 1] as usize];
            // Buckets have a handful of entries, except at hubs. Sorting makes the sides of an
            // edge adjacent.
            bucket.sort_unstable();
            for edge in bucket.chunk_by(|a, b| a.high() == b.high()) {
                match *edge {
                    [_] => {}
                    [a, b] if a.runs_up() != b.runs_up() => {
                        twins[a.corner() as usize] = b.corner();
                        twins[b.corner() as usize] = a.corner();
                    }
                    _ => return Err(self.edge_error(edge)),
                }
            }
        }
        Ok(twins)
    }

    fn edge_error(&self, edge: &[Side]) -> BuildError {
        let first = edge[0].corner() as usize;
        let vertices = [VertexId(self.origins[first]), VertexId(self.targets[first])];
        match *edge {
            [a, b] => BuildError::InconsistentOrientation {
                vertices,
                faces: [self.face_of(a.corner()), self.face_of(b.corner())],
            },
            _ => BuildError::NonManifoldEdge {
                vertices,
                num_faces: edge.len(),
                face: self.face_of(edge[edge.len() - 1].corner()),
            },
        }
    }

    /// Numbers the edges by first appearance and links the halfedges of the faces.
    fn link(&self, twins: &[u32]) -> HalfedgeMesh {
        let n = self.origins.len();
        let mut halfedge_of = vec![HalfedgeId(NONE); n];
        let mut target = Vec::with_capacity(n + n / 8);
        for c in 0..n {
            if halfedge_of[c].0 == NONE {
                let h = HalfedgeId(target.len() as u32);
                halfedge_of[c] = h;
                if twins[c] != NONE {
                    halfedge_of[twins[c] as usize] = h.twin();
                }
                target.push(VertexId(self.targets[c]));
                target.push(VertexId(self.origins[c]));
            }
        }
        let num_halfedges = target.len();
        let mut mesh = HalfedgeMesh {
            vertex_halfedge: vec![HalfedgeId(NONE); self.num_vertices],
            face_halfedge: Vec::with_capacity(self.starts.len() - 1),
            target,
            next: vec![HalfedgeId(NONE); num_halfedges],
            prev: vec![HalfedgeId(NONE); num_halfedges],
            face: vec![NONE; num_halfedges],
            shared: None,
        };
        for (face, range) in self.starts.windows(2).enumerate() {
            let halfedges = &halfedge_of[range[0] as usize..range[1] as usize];
            mesh.face_halfedge.push(halfedges[0]);
            let mut previous = halfedges[halfedges.len() - 1];
            let origins = &self.origins[range[0] as usize..range[1] as usize];
            for (&h, &origin) in halfedges.iter().zip(origins) {
                mesh.face[h.index()] = FaceId::new(face).0;
                mesh.next[previous.index()] = h;
                mesh.prev[h.index()] = previous;
                let stored = &mut mesh.vertex_halfedge[origin as usize];
                if stored.0 == NONE {
                    *stored = h;
                }
                previous = h;
            }
        }
        mesh
    }

    /// Links the sides without a face into boundary loops.
    fn link_boundary(&self, twins: &[u32], mesh: &mut HalfedgeMesh) -> Result<(), BuildError> {
        if !twins.contains(&NONE) {
            return Ok(());
        }
        let boundary: Vec<HalfedgeId> = mesh
            .halfedges()
            .filter(|&h| mesh.is_boundary_halfedge(h))
            .collect();
        for &h in &boundary {
            let origin = mesh.origin(h);
            let stored = mesh.vertex_halfedge(origin);
            if mesh.is_boundary_halfedge(stored) {
                let num_fans = mesh.count_fans(origin);
                return Err(BuildError::SeveralFans {
                    vertex: origin,
                    num_fans,
                });
            }
            mesh.vertex_halfedge[origin.index()] = h;
        }
        for &h in &boundary {
            let next = mesh.vertex_halfedge(mesh.target(h));
            mesh.next[h.index()] = next;
            mesh.prev[next.index()] = h;
        }
        Ok(())
    }
}

/// A corner as one side of an edge, packed so that a plain sort makes the sides of an edge
/// adjacent: the larger vertex, then the corner, then a bit that is set if the corner points to
/// the larger vertex.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side(u64);

impl Side {
    fn new(origin: u32, target: u32, corner: usize) -> Self {
        // A corner is below 2^31, which leaves a bit for the direction.
        let low_half = (corner as u64) << 1 | u64::from(origin < target);
        Self(u64::from(origin.max(target)) << 32 | low_half)
    }

    fn high(self) -> u32 {
        (self.0 >> 32) as u32
    }

    fn corner(self) -> u32 {
        self.0 as u32 >> 1
    }

    fn runs_up(self) -> bool {
        self.0 & 1 == 1
    }
}

/// Returns a vertex that a face visits twice, if there is one.
fn repeated(polygon: &[u32], sorted: &mut Vec<u32>) -> Option<u32> {
    // Up to this size, pairwise comparison is faster than sorting.
    const FEW: usize = 8;
    if polygon.len() <= FEW {
        let twice = |&(i, v): &(usize, &u32)| polygon[..i].contains(v);
        return polygon.iter().enumerate().find(twice).map(|(_, &v)| v);
    }
    sorted.clear();
    sorted.extend_from_slice(polygon);
    sorted.sort_unstable();
    sorted
        .windows(2)
        .find(|pair| pair[0] == pair[1])
        .map(|pair| pair[0])
}

/// The error for more vertices than corners: one of the lowest vertices must be without a face.
///
/// Detected before anything is allocated for the vertices, whose number may come from a hostile
/// file.
fn first_unused<F: AsRef<[u32]>>(faces: &[F], num_corners: usize) -> BuildError {
    let mut used = vec![false; num_corners + 1];
    for &v in faces.iter().flat_map(|face| face.as_ref()) {
        if let Some(mark) = used.get_mut(v as usize) {
            *mark = true;
        }
    }
    let vertex = used.iter().position(|&mark| !mark).unwrap_or(num_corners);
    BuildError::IsolatedVertex {
        vertex: VertexId::new(vertex),
    }
}

impl HalfedgeMesh {
    /// Checks that every vertex has exactly one fan of faces, by counting fans.
    fn check_fans(&self) -> Result<(), BuildError> {
        if let Some(i) = self.vertex_halfedge.iter().position(|h| h.0 == NONE) {
            return Err(BuildError::IsolatedVertex {
                vertex: VertexId::new(i),
            });
        }
        // Visiting halfedges in index order follows the faces, whose neighbours are close in
        // memory regardless of the vertex order.
        let mut seen = vec![false; self.num_halfedges()];
        let mut num_fans = 0;
        for start in self.halfedges() {
            num_fans += usize::from(!seen[start.index()]);
            let mut h = start;
            while !std::mem::replace(&mut seen[h.index()], true) {
                h = self.prev(h).twin();
            }
        }
        if num_fans == self.num_vertices() {
            return Ok(());
        }
        // Some vertex has halfedges that cannot be reached from its stored one. Find the first.
        let mut leaving = vec![0usize; self.num_vertices()];
        for h in self.halfedges() {
            leaving[self.origin(h).index()] += 1;
        }
        match self
            .vertices()
            .find(|&v| self.valence(v) != leaving[v.index()])
        {
            Some(vertex) => Err(BuildError::SeveralFans {
                vertex,
                num_fans: self.count_fans(vertex),
            }),
            None => Ok(()),
        }
    }

    /// Counts the fans of faces that meet at `vertex`.
    ///
    /// Used only for errors, since it visits every halfedge. It walks through faces only, so the
    /// boundary does not have to be linked.
    fn count_fans(&self, vertex: VertexId) -> usize {
        let (open, inner): (Vec<HalfedgeId>, Vec<HalfedgeId>) = self
            .halfedges()
            .filter(|&h| self.origin(h) == vertex)
            .partition(|&h| self.is_boundary_halfedge(h));
        let mut seen = HalfedgeMap::filled(self.num_halfedges(), false);
        let mut num_fans = 0;
        // An open fan is walked from its boundary halfedge, a closed one from any halfedge.
        for start in open.into_iter().chain(inner) {
            num_fans += usize::from(!seen[start]);
            let mut h = start;
            while !std::mem::replace(&mut seen[h], true) && !self.is_boundary_halfedge(h.twin()) {
                h = self.next(h.twin());
            }
        }
        num_fans
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing;

    fn message<F: AsRef<[u32]>>(num_vertices: usize, faces: &[F]) -> String {
        HalfedgeMesh::from_faces(num_vertices, faces)
            .unwrap_err()
            .to_string()
    }

    #[test]
    fn errors_name_the_element() {
        assert_eq!(
            message(1 << 31, &[[0, 1, 2]]),
            "2147483648 vertices are too many: a mesh holds fewer than 2^31 corners and vertices"
        );
        assert_eq!(
            message(4, &[vec![0, 1, 2], vec![2, 3]]),
            "face 1 has 2 corners; a face needs three or more"
        );
        assert_eq!(
            message(3, &[[0, 1, 2], [1, 0, 7]]),
            "face 1 refers to vertex 7, but there are only 3 vertices (numbered from 0)"
        );
        assert_eq!(
            message(3, &[[0, 1, 2], [2, 0, 2]]),
            "face 1 passes twice through vertex 2; drop or split the face"
        );
        assert_eq!(
            message(5, &[[0, 1, 2], [1, 0, 3], [0, 1, 4]]),
            "the edge between vertices 0 and 1 has 3 faces (among them face 2); a manifold edge has at most two"
        );
        assert_eq!(
            message(4, &[[0, 1, 2], [0, 1, 3]]),
            "faces 0 and 1 both run from vertex 0 to vertex 1: they are oriented against each other; flip one of them"
        );
        assert_eq!(
            message(4, &[[0, 1, 3], [1, 0, 3]]),
            "vertex 2 belongs to no face; leave unreferenced vertices out"
        );
    }

    #[test]
    fn bow_ties_of_open_and_closed_fans() {
        let tetrahedron = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d], [a, d, b], [b, d, c]];
        let open = [[0, 1, 2], [0, 3, 4]];
        let bow_tie = |num_fans| {
            format!(
                "vertex 0 joins {num_fans} separate fans of faces (a bow-tie); split it into one vertex per fan"
            )
        };
        assert_eq!(message(5, &open), bow_tie(2));
        let closed = [tetrahedron([0, 1, 2, 3]), tetrahedron([0, 4, 5, 6])].concat();
        assert_eq!(message(7, &closed), bow_tie(2));
        let mut mixed = vec![[0, 7, 8]];
        mixed.extend(&closed);
        assert_eq!(message(9, &mixed), bow_tie(3));
        mixed.push([9, 10, 0]);
        assert_eq!(message(11, &mixed), bow_tie(4));
    }

    #[test]
    fn more_vertices_than_corners_costs_nothing() {
        let vertex = VertexId(3);
        let most = MAX_EDGES;
        let error = HalfedgeMesh::from_faces(most, &[[0, 1, 2]]).unwrap_err();
        assert_eq!(error, BuildError::IsolatedVertex { vertex });
        let error = HalfedgeMesh::from_faces(most, &[[0u32; 0]; 0]).unwrap_err();
        assert_eq!(
            error,
            BuildError::IsolatedVertex {
                vertex: VertexId(0)
            }
        );
        let error = HalfedgeMesh::from_faces(4, &[[u32::MAX, 0, 1]]).unwrap_err();
        assert_eq!(
            error,
            BuildError::IsolatedVertex {
                vertex: VertexId(2)
            }
        );
    }

    #[test]
    fn no_faces_make_the_empty_mesh() {
        let mesh = HalfedgeMesh::from_faces(0, &[[0u32; 3]; 0]).unwrap();
        assert_eq!(mesh, HalfedgeMesh::default());
    }

    #[test]
    fn faces_back_to_back_are_a_sphere() {
        let mesh = HalfedgeMesh::from_faces(3, &[[0, 1, 2], [0, 2, 1]]).unwrap();
        mesh.validate().unwrap();
        assert_eq!(
            (mesh.num_edges(), mesh.genus(), mesh.is_closed()),
            (3, 0, true)
        );
    }

    #[test]
    fn a_hub_of_many_faces_is_quick() {
        // Each step is O(n log n) at most; a quadratic one would take minutes.
        const N: u32 = 100_000;
        let hub = 0;
        let mut fan: Vec<_> = (1..N).map(|i| [hub, i, i + 1]).collect();
        let mesh = HalfedgeMesh::from_faces(N as usize + 1, &fan).unwrap();
        assert_eq!(mesh.valence(VertexId(hub)), N as usize);
        // The same hub, interrupted in the middle.
        fan.remove(N as usize / 2);
        assert!(message(N as usize + 1, &fan).starts_with("vertex 0 joins 2 separate fans"));
    }

    proptest! {
        #[test]
        fn building_from_exported_faces_gives_the_same_mesh(
            triangles in testing::triangle_faces(),
            polygons in testing::polygon_mesh(),
        ) {
            let mesh = triangles.mesh().unwrap();
            prop_assert_eq!(testing::TriangleFaces::of(&mesh), triangles);
            let fresh =
                HalfedgeMesh::from_faces(polygons.num_vertices(), &polygons.to_faces()).unwrap();
            for mesh in [mesh, polygons, fresh] {
                prop_assert_eq!(mesh.validate(), Ok(()));
                let faces = mesh.to_faces();
                let again = HalfedgeMesh::from_faces(mesh.num_vertices(), &faces).unwrap();
                prop_assert_eq!(again, mesh);
            }
        }

        #[test]
        fn any_faces_build_or_name_a_defect(
            num_vertices in 0..9usize,
            faces in prop::collection::vec(prop::collection::vec(0..9u32, 0..5), 0..9),
        ) {
            if let Ok(mesh) = HalfedgeMesh::from_faces(num_vertices, &faces) {
                prop_assert_eq!(mesh.validate(), Ok(()));
                prop_assert_eq!(mesh.to_faces(), faces);
                testing::check_euler(&mesh)?;
            }
        }

        #[test]
        fn damaged_faces_build_or_name_a_defect(
            mut triangles in testing::triangle_faces(),
            damage in prop::collection::vec((any::<prop::sample::Index>(), 0..3usize, any::<prop::sample::Index>()), 1..3),
        ) {
            for (face, corner, vertex) in damage {
                let face = face.index(triangles.faces.len());
                triangles.faces[face][corner] = vertex.index(triangles.num_vertices) as u32;
            }
            if let Ok(mesh) = triangles.mesh() {
                prop_assert_eq!(mesh.validate(), Ok(()));
            }
        }
    }
}
