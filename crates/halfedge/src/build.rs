//! Construction from faces in linear time, with an error that names the element at fault.
//!
//! Corner c of the face list is the halfedge from that corner's vertex to the next corner's.
//! Corners are bucketed by the smaller of their two vertices (one counting pass); the two sides
//! of an edge then meet in a bucket of a few entries. No hash map, no allocation per edge.

use thiserror::Error;

use crate::ids::{FaceId, HalfedgeId, NONE, VertexId};
use crate::mesh::HalfedgeMesh;

/// Why a list of faces is not an oriented 2-manifold.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum BuildError {
    /// More elements than 32-bit ids can number.
    #[error("{count} {elements} are too many: a mesh holds fewer than 2^31 corners and vertices")]
    TooLarge {
        /// What there are too many of.
        elements: &'static str,
        /// How many were given.
        count: usize,
    },
    /// A face with fewer than three corners.
    #[error("face {face} has {degree} corners; a face needs three or more")]
    TooFewCorners {
        /// The face, counted from 0.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
    /// A corner that refers to a vertex that does not exist.
    #[error("face {face} refers to vertex {vertex}, but there are only {num_vertices} vertices (numbered from 0)")]
    IndexOutOfRange {
        /// The face, counted from 0.
        face: usize,
        /// The vertex number that was given.
        vertex: usize,
        /// How many vertices there are.
        num_vertices: usize,
    },
    /// A face that passes twice through the same vertex.
    #[error("face {face} passes twice through vertex {vertex}; drop or split the face")]
    RepeatedVertex {
        /// The face, counted from 0.
        face: usize,
        /// The vertex that is repeated.
        vertex: VertexId,
    },
    /// An edge with three or more faces.
    #[error("the edge between vertices {} and {} has {num_faces} faces (among them face {face}); a manifold edge has at most two", vertices[0], vertices[1])]
    NonManifoldEdge {
        /// The ends of the edge.
        vertices: [VertexId; 2],
        /// How many faces meet there.
        num_faces: usize,
        /// One of them.
        face: usize,
    },
    /// Two faces that run through an edge in the same direction.
    #[error("faces {} and {} both run from vertex {} to vertex {}: they are oriented against each other; flip one of them", faces[0], faces[1], vertices[0], vertices[1])]
    InconsistentOrientation {
        /// Origin and target of the directed edge that both faces have.
        vertices: [VertexId; 2],
        /// The two faces.
        faces: [usize; 2],
    },
    /// A vertex whose faces form more than one fan (a bow-tie).
    #[error("vertex {vertex} joins {num_fans} separate fans of faces (a bow-tie); split it into one vertex a fan")]
    SeveralFans {
        /// The vertex.
        vertex: VertexId,
        /// How many fans meet there.
        num_fans: usize,
    },
    /// A vertex that no face uses.
    #[error("vertex {vertex} belongs to no face; leave unreferenced vertices out")]
    IsolatedVertex {
        /// The vertex.
        vertex: VertexId,
    },
}

impl HalfedgeMesh {
    /// Builds the connectivity of `num_vertices` vertices and the given faces.
    ///
    /// Each face lists its corners counter-clockwise seen from the outside; faces may have any
    /// number of corners from three. Vertices and faces keep their numbers; the first halfedge of
    /// a face leaves its first corner; edges are numbered by their first appearance in the faces.
    /// Linear in the number of corners (two passes over them and one counting sort).
    ///
    /// # Errors
    /// The first defect found, in this order: sizes, corners of a face, edges, vertices. See
    /// [`BuildError`].
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
        mesh.check_fans(num_vertices, corners.origins.len())?;
        Ok(mesh)
    }
}

/// The faces, flattened: one entry a corner.
struct Corners {
    num_vertices: usize,
    /// First corner of each face, and the total at the end.
    starts: Vec<u32>,
    origins: Vec<u32>,
    targets: Vec<u32>,
}

impl Corners {
    fn gather<F: AsRef<[u32]>>(num_vertices: usize, faces: &[F]) -> Result<Self, BuildError> {
        // Edges may be as many as corners, halfedges twice that: all of them below 2^32 - 1.
        const MOST: usize = (1 << 31) - 2;
        let num_corners: usize = faces.iter().map(|f| f.as_ref().len()).sum();
        for (elements, count) in [("vertices", num_vertices), ("corners", num_corners)] {
            if count > MOST {
                return Err(BuildError::TooLarge { elements, count });
            }
        }
        let mut corners = Self {
            num_vertices,
            starts: Vec::with_capacity(faces.len() + 1),
            origins: Vec::with_capacity(num_corners),
            targets: Vec::with_capacity(num_corners),
        };
        corners.starts.push(0);
        // `seen[v] == face` marks the vertices of the face at hand.
        let mut seen = vec![NONE; num_vertices];
        for (face, polygon) in faces.iter().enumerate() {
            corners.push_face(face, polygon.as_ref(), &mut seen)?;
        }
        Ok(corners)
    }

    fn push_face(
        &mut self,
        face: usize,
        polygon: &[u32],
        seen: &mut [u32],
    ) -> Result<(), BuildError> {
        let (&first, rest) = match polygon.split_first() {
            Some(split) if polygon.len() >= 3 => split,
            _ => return Err(BuildError::TooFewCorners { face, degree: polygon.len() }),
        };
        for &v in polygon {
            let mark = seen.get_mut(v as usize).ok_or(BuildError::IndexOutOfRange {
                face,
                vertex: v as usize,
                num_vertices: self.num_vertices,
            })?;
            if *mark == face as u32 {
                return Err(BuildError::RepeatedVertex { face, vertex: VertexId(v) });
            }
            *mark = face as u32;
        }
        self.origins.extend_from_slice(polygon);
        self.targets.extend_from_slice(rest);
        self.targets.push(first);
        self.starts.push(self.origins.len() as u32);
        Ok(())
    }

    /// The face of corner `c` (only for errors: a binary search).
    fn face_of(&self, c: u32) -> usize {
        self.starts.partition_point(|&start| start <= c) - 1
    }

    /// For every corner the corner on the other side of its edge, or `NONE`.
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
        // Entries (larger vertex, corner), in one bucket per smaller vertex.
        let mut entries = vec![(0u32, 0u32); n];
        let mut cursor = bucket_ends.clone();
        for c in 0..n {
            let slot = &mut cursor[low(c)];
            entries[*slot as usize] = (self.origins[c].max(self.targets[c]), c as u32);
            *slot += 1;
        }
        let mut twins = vec![NONE; n];
        for v in 0..self.num_vertices {
            let bucket = &mut entries[bucket_ends[v] as usize..bucket_ends[v + 1] as usize];
            // A handful of entries, save for hubs; equal vertices become neighbours.
            bucket.sort_unstable();
            for edge in bucket.chunk_by(|a, b| a.0 == b.0) {
                match *edge {
                    [_] => {}
                    [(_, a), (_, b)] if self.origins[a as usize] != self.origins[b as usize] => {
                        twins[a as usize] = b;
                        twins[b as usize] = a;
                    }
                    _ => return Err(self.edge_error(edge)),
                }
            }
        }
        Ok(twins)
    }

    fn edge_error(&self, edge: &[(u32, u32)]) -> BuildError {
        let c = edge[0].1;
        let vertices = [VertexId(self.origins[c as usize]), VertexId(self.targets[c as usize])];
        match *edge {
            [(_, a), (_, b)] => BuildError::InconsistentOrientation {
                vertices,
                faces: [self.face_of(a), self.face_of(b)],
            },
            _ => BuildError::NonManifoldEdge {
                vertices,
                num_faces: edge.len(),
                face: self.face_of(edge[edge.len() - 1].1),
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
        };
        for (face, range) in self.starts.windows(2).enumerate() {
            let halfedges = &halfedge_of[range[0] as usize..range[1] as usize];
            mesh.face_halfedge.push(halfedges[0]);
            let mut previous = halfedges[halfedges.len() - 1];
            for &h in halfedges {
                mesh.face[h.index()] = FaceId::new(face).0;
                mesh.next[previous.index()] = h;
                mesh.prev[h.index()] = previous;
                let origin = mesh.origin(h).index();
                if mesh.vertex_halfedge[origin].0 == NONE {
                    mesh.vertex_halfedge[origin] = h;
                }
                previous = h;
            }
        }
        mesh
    }

    /// Chains the sides without a face into boundary loops.
    fn link_boundary(&self, twins: &[u32], mesh: &mut HalfedgeMesh) -> Result<(), BuildError> {
        if !twins.contains(&NONE) {
            return Ok(());
        }
        let boundary: Vec<HalfedgeId> =
            mesh.halfedges().filter(|&h| mesh.is_boundary_halfedge(h)).collect();
        for &h in &boundary {
            let origin = mesh.origin(h);
            let stored = mesh.vertex_halfedge(origin);
            if mesh.is_boundary_halfedge(stored) {
                let num_fans =
                    boundary.iter().filter(|&&b| mesh.origin(b) == origin).count();
                return Err(BuildError::SeveralFans { vertex: origin, num_fans });
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

impl HalfedgeMesh {
    /// Checks that every vertex has exactly one fan of faces, by counting corners.
    fn check_fans(&self, num_vertices: usize, num_corners: usize) -> Result<(), BuildError> {
        let mut reached = 0;
        for i in 0..num_vertices {
            if self.vertex_halfedge[i].0 == NONE {
                return Err(BuildError::IsolatedVertex { vertex: VertexId::new(i) });
            }
            reached += self.vertex_faces(VertexId::new(i)).count();
        }
        if reached == num_corners {
            return Ok(());
        }
        // Some vertex has corners that its fan does not reach: find the first one.
        let mut unreached = vec![0usize; num_vertices];
        for h in self.halfedges().filter(|&h| !self.is_boundary_halfedge(h)) {
            unreached[self.origin(h).index()] += 1;
        }
        for vertex in self.vertices() {
            if unreached[vertex.index()] != self.vertex_faces(vertex).count() {
                return Err(BuildError::SeveralFans { vertex, num_fans: self.count_fans(vertex) });
            }
        }
        Ok(())
    }

    /// How many fans of faces meet at `vertex` (slow: looks at every halfedge).
    fn count_fans(&self, vertex: VertexId) -> usize {
        let mut left: Vec<HalfedgeId> =
            self.halfedges().filter(|&h| self.origin(h) == vertex).collect();
        let mut fans = 0;
        while let Some(start) = left.pop() {
            fans += 1;
            let mut h = self.prev(start).twin();
            while h != start {
                left.retain(|&other| other != h);
                h = self.prev(h).twin();
            }
        }
        fans
    }
}
