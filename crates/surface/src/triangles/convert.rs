//! From a half-edge mesh and back.

use cotan_geometry::{Mesh, Scalar, Surface};
use cotan_halfedge::{HalfedgeMesh, VertexMap};
use nalgebra::{Point3, Vector3};

#[cfg(test)]
use super::next;
use super::{NONE, Triangles};
use crate::tessellation_error::TessellationError;

/// The triangles that are left, without gaps.
pub(crate) struct Compacted<T: Scalar> {
    pub(crate) mesh: Mesh<T>,
    /// Per vertex of the structure: its index in `mesh`, or [`NONE`].
    pub(crate) new_vertex: Vec<u32>,
    /// Per vertex of `mesh`: its index in the structure.
    pub(crate) old_vertex: Vec<u32>,
}

impl Triangles {
    /// The triangles of a mesh. Faces and vertices keep their indices; corner k of a face is its
    /// k-th halfedge.
    pub(crate) fn new<T: Scalar>(surface: &Surface<'_, T>) -> Result<Self, TessellationError> {
        let mesh = surface.mesh();
        let num_corners = 3 * mesh.num_faces() as u64;
        if num_corners >= u64::from(NONE) {
            return Err(TessellationError::TooLarge {
                faces: mesh.num_faces() as u64,
            });
        }
        let num_corners = num_corners as usize;
        let mut origin = Vec::with_capacity(num_corners);
        let mut corner_of = vec![NONE; mesh.num_halfedges()];
        for face in mesh.faces() {
            for h in mesh.face_halfedges(face) {
                corner_of[h.index()] = origin.len() as u32;
                origin.push(mesh.origin(h).index() as u32);
            }
        }
        let mut twin = vec![NONE; num_corners];
        for e in mesh.edges() {
            let [a, b] = e.halfedges().map(|h| corner_of[h.index()]);
            for (side, other) in [(a, b), (b, a)] {
                if side != NONE {
                    twin[side as usize] = other;
                }
            }
        }
        // The border of a vertex is the face's halfedge that leaves it and has no twin.
        let outgoing = cotan_parallel::filled(mesh.num_vertices(), |v| {
            let boundary = mesh.vertex_halfedge(cotan_halfedge::VertexId::new(v));
            let inner = if mesh.is_boundary_halfedge(boundary) {
                mesh.prev(boundary).twin()
            } else {
                boundary
            };
            corner_of[inner.index()]
        });
        let points = surface.positions().as_slice();
        Ok(Self {
            origin,
            twin,
            tag: vec![NONE; num_corners],
            outgoing,
            points: cotan_parallel::filled(points.len(), |i| points[i].coords.map(T::as_f64)),
            num_faces: mesh.num_faces(),
            seen: vec![0; points.len()],
            search: 0,
        })
    }

    /// The mesh of the triangles that are left, in their order.
    pub(crate) fn compact<T: Scalar>(
        &self,
        position: impl Fn(usize, Vector3<f64>) -> Point3<T>,
    ) -> Result<Compacted<T>, TessellationError> {
        let mut new_vertex = vec![NONE; self.points.len()];
        let mut old_vertex = Vec::new();
        for (v, &h) in self.outgoing.iter().enumerate() {
            if h != NONE {
                new_vertex[v] = old_vertex.len() as u32;
                old_vertex.push(v as u32);
            }
        }
        let mut faces = Vec::with_capacity(self.num_faces);
        for f in 0..(self.origin.len() / 3) as u32 {
            if self.is_alive(3 * f) {
                faces.push(self.corners(f).map(|v| new_vertex[v as usize]));
            }
        }
        let connectivity = HalfedgeMesh::from_faces(old_vertex.len(), &faces)?;
        let positions: VertexMap<Point3<T>> = old_vertex
            .iter()
            .map(|&v| position(v as usize, self.points[v as usize]))
            .collect();
        let mesh = Mesh::new(connectivity, positions)?;
        Ok(Compacted {
            mesh,
            new_vertex,
            old_vertex,
        })
    }

    /// Checks every invariant. For tests.
    #[cfg(test)]
    pub(crate) fn check(&self) {
        for h in 0..self.origin.len() as u32 {
            if !self.is_alive(h) {
                continue;
            }
            let t = self.twin(h);
            if t != NONE {
                assert_eq!(self.twin(t), h);
                assert_eq!(
                    (self.origin(t), self.target(t)),
                    (self.target(h), self.origin(h))
                );
                assert_eq!(self.tag(t), self.tag(h));
            }
            let v = self.origin(h);
            assert_eq!(self.origin(self.outgoing[v as usize]), v);
            assert!(
                self.ring(v).any(|g| g == h),
                "the ring of {v} misses a corner"
            );
            assert_eq!(
                self.corners(next(h) / 3)
                    .iter()
                    .filter(|&&w| w == v)
                    .count(),
                1
            );
        }
    }
}
