//! A triangle mesh together with its positions, on which all quantities are measured.

use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use nalgebra::{Point3, Vector3};
use thiserror::Error;

use crate::scalar::Scalar;

/// One position per vertex.
pub type Positions<T> = VertexMap<Point3<T>>;

/// The reason why a mesh and positions do not form a measurable surface.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The number of positions differs from the number of vertices.
    #[error("there are {positions} positions for {vertices} vertices; give one position a vertex")]
    LengthMismatch {
        /// The number of positions given.
        positions: usize,
        /// The number of vertices of the mesh.
        vertices: usize,
    },
    /// A face is not a triangle.
    #[error("face {face} has {degree} corners; triangulate the mesh first")]
    NotTriangles {
        /// The face, counted from 0.
        face: usize,
        /// Its number of corners.
        degree: usize,
    },
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} has a coordinate that is not a finite number")]
    NonFinite {
        /// The vertex.
        vertex: VertexId,
    },
    /// The mesh has no faces.
    #[error("the mesh has no faces")]
    Empty,
}

/// A triangle mesh and the positions of its vertices, both borrowed.
///
/// A `Surface` created by [`Surface::new`] has only triangles, one position per vertex, and
/// finite coordinates. It may have boundaries, several components and degenerate triangles.
#[derive(Debug)]
pub struct Surface<'a, T: Scalar> {
    mesh: &'a HalfedgeMesh,
    positions: &'a Positions<T>,
}

impl<T: Scalar> Clone for Surface<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T: Scalar> Copy for Surface<'_, T> {}

impl<'a, T: Scalar> From<&Surface<'a, T>> for Surface<'a, T> {
    fn from(surface: &Surface<'a, T>) -> Self {
        *surface
    }
}

impl<'a, T: Scalar> Surface<'a, T> {
    /// Checks that `positions` embed `mesh` and pairs the two.
    ///
    /// # Errors
    /// [`SurfaceError`] if the mesh is empty or has a polygon with more than three corners, if a
    /// position is missing, or if a coordinate is not finite.
    pub fn new(mesh: &'a HalfedgeMesh, positions: &'a Positions<T>) -> Result<Self, SurfaceError> {
        if mesh.num_faces() == 0 {
            return Err(SurfaceError::Empty);
        }
        if positions.len() != mesh.num_vertices() {
            return Err(SurfaceError::LengthMismatch {
                positions: positions.len(),
                vertices: mesh.num_vertices(),
            });
        }
        if let Some(f) = mesh.faces().find(|&f| mesh.degree(f) != 3) {
            return Err(SurfaceError::NotTriangles {
                face: f.index(),
                degree: mesh.degree(f),
            });
        }
        if let Some((vertex, _)) = positions
            .iter()
            .find(|(_, p)| p.iter().any(|x| !x.is_finite()))
        {
            return Err(SurfaceError::NonFinite { vertex });
        }
        Ok(Self { mesh, positions })
    }

    /// Pairs a mesh and positions that [`Surface::new`] has accepted before, without checking
    /// them again.
    ///
    /// For code that stores the parts of a checked surface and measures it in every iteration.
    ///
    /// # Panics
    /// If there is not one position per vertex.
    #[must_use]
    pub fn assume_checked(mesh: &'a HalfedgeMesh, positions: &'a Positions<T>) -> Self {
        assert_eq!(
            positions.len(),
            mesh.num_vertices(),
            "one position a vertex"
        );
        Self { mesh, positions }
    }

    /// Pairs the same mesh with other positions. Their number is checked, their values are not.
    ///
    /// For iterations that move the vertices of a surface that was checked once.
    ///
    /// # Panics
    /// If there is not one position per vertex.
    #[must_use]
    pub fn with_positions<'b>(&self, positions: &'b Positions<T>) -> Surface<'b, T>
    where
        'a: 'b,
    {
        assert_eq!(
            positions.len(),
            self.mesh.num_vertices(),
            "one position a vertex"
        );
        Surface {
            mesh: self.mesh,
            positions,
        }
    }

    /// The connectivity.
    #[inline]
    pub fn mesh(&self) -> &'a HalfedgeMesh {
        self.mesh
    }

    /// The positions.
    #[inline]
    pub fn positions(&self) -> &'a Positions<T> {
        self.positions
    }

    /// The vertices whose position satisfies a condition, in ascending order, for example as a
    /// handle.
    pub fn vertices_where(&self, condition: impl Fn(&Point3<T>) -> bool) -> Vec<VertexId> {
        self.positions
            .iter()
            .filter(|(_, p)| condition(p))
            .map(|(v, _)| v)
            .collect()
    }

    /// The position of a vertex.
    #[inline]
    pub fn position(&self, vertex: VertexId) -> Point3<T> {
        self.positions[vertex]
    }

    /// The vector from the origin of a halfedge to its target.
    #[inline]
    pub fn halfedge_vector(&self, halfedge: cotan_halfedge::HalfedgeId) -> Vector3<T> {
        self.position(self.mesh.target(halfedge)) - self.position(self.mesh.origin(halfedge))
    }
}
