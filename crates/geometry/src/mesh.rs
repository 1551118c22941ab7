//! A triangle mesh that owns its connectivity and its positions.

mod builder;
mod error;

use cotan_halfedge::HalfedgeMesh;
use nalgebra::Point3;

use crate::scalar::Scalar;
use crate::surface::{Positions, Surface, SurfaceError};

pub use builder::{BuiltMesh, MeshBuilder};
pub use error::MeshError;

/// A triangle mesh: connectivity and one position per vertex, both owned.
///
/// Built from flat buffers and converted back to them. In between, [`Surface`] borrows it for
/// measuring and for every job.
///
/// ```
/// use cotan_geometry::Mesh;
///
/// let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let indices = [0, 1, 2, 0, 2, 3];
/// let mesh = Mesh::<f64>::from_triangles(&positions, &indices)?;
/// assert_eq!(mesh.surface().area(), 1.0);
/// assert_eq!(mesh.surface().bounding_box().longest_side(), 1.0);
///
/// assert_eq!(mesh.to_positions::<f32>(), positions);
/// assert_eq!(mesh.to_triangles(), indices);
/// # Ok::<(), cotan_geometry::MeshError>(())
/// ```
///
/// There are only triangles, and always as many positions as vertices, so [`Mesh::surface`]
/// cannot fail. Open boundaries, several components and degenerate triangles are allowed.
///
/// To edit the connectivity, take the mesh apart with [`Mesh::into_parts`], update the positions
/// with each edit, and put the two together again with [`Mesh::new`].
#[derive(Clone, PartialEq, Debug)]
pub struct Mesh<T: Scalar> {
    connectivity: HalfedgeMesh,
    positions: Positions<T>,
}

impl<T: Scalar> Mesh<T> {
    /// Combines connectivity and positions.
    ///
    /// # Errors
    /// Same as [`Surface::new`]: the mesh is empty or has a polygon with more than three corners,
    /// the number of positions differs from the number of vertices, or a coordinate is not
    /// finite.
    pub fn new(connectivity: HalfedgeMesh, positions: Positions<T>) -> Result<Self, SurfaceError> {
        Surface::new(&connectivity, &positions)?;
        Ok(Self {
            connectivity,
            positions,
        })
    }

    /// Combines connectivity and positions that [`Mesh::new`] or [`Surface::new`] has accepted
    /// before, without checking them again.
    ///
    /// # Panics
    /// If the number of positions differs from the number of vertices.
    #[must_use]
    pub fn assume_checked(connectivity: HalfedgeMesh, positions: Positions<T>) -> Self {
        assert_eq!(
            positions.len(),
            connectivity.num_vertices(),
            "one position per vertex"
        );
        Self {
            connectivity,
            positions,
        }
    }

    /// Builds a mesh from positions and three indices per triangle, counter-clockwise as seen
    /// from the outside.
    ///
    /// Vertices and triangles keep their indices. For meshes with duplicate or unused vertices,
    /// see [`MeshBuilder`].
    ///
    /// **Units**: those of `positions`, whose scalar type may differ from that of the mesh.
    ///
    /// # Errors
    /// [`MeshError`] if the triangles do not form an oriented 2-manifold, a vertex belongs to
    /// none of them, or a coordinate is not finite.
    pub fn from_triangles<P: Scalar>(
        positions: &[[P; 3]],
        indices: &[u32],
    ) -> Result<Self, MeshError> {
        Ok(MeshBuilder::new().triangles(positions, indices)?.mesh)
    }

    /// Builds a mesh from positions and polygons with at least three corners, counter-clockwise
    /// as seen from the outside.
    ///
    /// Vertices keep their indices. Polygons are cut as described for
    /// [`HalfedgeMesh::triangulate`], which ignores their shape, so cut non-convex polygons
    /// beforehand.
    ///
    /// **Units**: those of `positions`, whose scalar type may differ from that of the mesh.
    ///
    /// # Errors
    /// Same as [`Mesh::from_triangles`].
    ///
    /// ```
    /// use cotan_geometry::Mesh;
    /// let square = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]];
    /// let mesh = Mesh::<f64>::from_faces(&square, &[[0, 1, 2, 3]])?;
    /// assert_eq!((mesh.num_faces(), mesh.surface().area()), (2, 4.0));
    /// # Ok::<(), cotan_geometry::MeshError>(())
    /// ```
    pub fn from_faces<P: Scalar, F: AsRef<[u32]>>(
        positions: &[[P; 3]],
        faces: &[F],
    ) -> Result<Self, MeshError> {
        Ok(MeshBuilder::new().faces(positions, faces)?.mesh)
    }

    /// Borrows the mesh as a surface, which can be measured and passed to jobs. Free of cost.
    #[inline]
    #[must_use]
    pub fn surface(&self) -> Surface<'_, T> {
        Surface::assume_checked(&self.connectivity, &self.positions)
    }

    /// The connectivity, which consists of triangles only.
    #[inline]
    pub fn connectivity(&self) -> &HalfedgeMesh {
        &self.connectivity
    }

    /// One position per vertex.
    #[inline]
    pub fn positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// The positions in vertex order, mutable.
    ///
    /// The values are not checked: if a coordinate is not finite, measures are not finite either,
    /// and jobs return an error.
    #[inline]
    pub fn positions_mut(&mut self) -> &mut [Point3<T>] {
        self.positions.as_mut_slice()
    }

    /// Clones the connectivity with other positions.
    ///
    /// # Errors
    /// [`SurfaceError`] if the number of positions differs from the number of vertices, or if a
    /// coordinate is not finite.
    pub fn with_positions(&self, positions: Positions<T>) -> Result<Self, SurfaceError> {
        Self::new(self.connectivity.clone(), positions)
    }

    /// Takes the mesh apart into connectivity and positions, for edits.
    pub fn into_parts(self) -> (HalfedgeMesh, Positions<T>) {
        (self.connectivity, self.positions)
    }

    /// Number of vertices.
    pub fn num_vertices(&self) -> usize {
        self.connectivity.num_vertices()
    }

    /// Number of triangles.
    pub fn num_faces(&self) -> usize {
        self.connectivity.num_faces()
    }

    /// Returns the positions as a flat buffer, rounded to `P`.
    ///
    /// **Shapes**: one entry per vertex. **Units**: those of the mesh.
    #[must_use]
    pub fn to_positions<P: Scalar>(&self) -> Vec<[P; 3]> {
        let points = self.positions.values();
        points
            .map(|p| p.map(|x| P::of_f64(x.as_f64())).into())
            .collect()
    }

    /// Returns the corners of all triangles as a flat buffer of vertex indices, in the form that
    /// [`Mesh::from_triangles`] takes.
    ///
    /// **Shapes**: three entries per triangle.
    #[must_use]
    pub fn to_triangles(&self) -> Vec<u32> {
        let corners = |f| self.connectivity.triangle(f).map(|v| v.index() as u32);
        self.connectivity.faces().flat_map(corners).collect()
    }

    /// Converts the positions to another scalar type, with a single rounding.
    ///
    /// A coordinate that is too large for the other type becomes infinite.
    #[must_use]
    pub fn cast<P: Scalar>(&self) -> Mesh<P> {
        Mesh {
            connectivity: self.connectivity.clone(),
            positions: self.positions.map(|p| p.map(|x| P::of_f64(x.as_f64()))),
        }
    }
}

impl<'m, T: Scalar> From<&'m Mesh<T>> for Surface<'m, T> {
    fn from(mesh: &'m Mesh<T>) -> Self {
        mesh.surface()
    }
}

#[cfg(test)]
mod tests {
    use cotan_halfedge::VertexId;
    use proptest::prelude::*;

    use super::*;
    use crate::shapes::{bar, icosphere};
    use crate::testing;

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let (connectivity, positions) = bar::<f64>([1.0; 3], [1; 3]).into_parts();
        let few: Positions<f64> = positions.values().copied().take(7).collect();
        assert_eq!(
            Mesh::new(connectivity.clone(), few),
            Err(SurfaceError::LengthMismatch {
                positions: 7,
                vertices: 8
            })
        );
        let mut infinite = positions;
        infinite[VertexId::new(3)].y = f64::NAN;
        let vertex = VertexId::new(3);
        assert_eq!(
            Mesh::new(connectivity, infinite),
            Err(SurfaceError::NonFinite { vertex })
        );
    }

    #[test]
    fn casting_rounds_once() {
        let single = icosphere::<f32>(2);
        assert_eq!(icosphere::<f64>(2).cast::<f32>(), single);
        assert_eq!(single.cast::<f64>().cast::<f32>(), single);
    }

    proptest! {
        #[test]
        fn flat_buffers_make_the_mesh_again(mesh in testing::surfaces()) {
            let (positions, indices) = (mesh.to_positions::<f64>(), mesh.to_triangles());
            let again = Mesh::<f64>::from_triangles(&positions, &indices).unwrap();
            prop_assert_eq!(again.positions(), mesh.positions());
            prop_assert_eq!(again.connectivity().to_faces(), mesh.connectivity().to_faces());
        }
    }
}
