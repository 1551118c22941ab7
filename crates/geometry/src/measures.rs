//! The measures of a surface as its methods. Each is the free function of the same topic, where
//! the definition is.

use cotan_halfedge::{EdgeId, EdgeMap, FaceId, FaceMap, HalfedgeMap, VertexMap};
use nalgebra::{Point3, Vector3};

use crate::angles::{AngleStatistics, angle_statistics, corner_angles, opposite_cotangents};
use crate::areas::{dual_areas, face_areas, one_ring_areas, surface_area};
use crate::bounds::{BoundingBox, bounding_box};
use crate::curvature::{angle_defects, dihedral_angles, integrated_mean_curvatures};
use crate::degenerate::degenerate_faces;
use crate::lengths::{edge_length, edge_lengths, mean_edge_length};
use crate::normals::{face_normal, face_normals, vertex_normals};
use crate::scalar::Scalar;
use crate::surface::Surface;
use crate::volume::{surface_centroid, volume, volume_centroid};

/// Measures. With a coordinate that is not finite the results are not finite.
impl<T: Scalar> Surface<'_, T> {
    /// The area of the surface. **Units**: area.
    ///
    /// See [`surface_area`].
    #[must_use]
    pub fn area(&self) -> T {
        surface_area(self)
    }

    /// The signed volume that a closed surface encloses, positive if its normals point outwards.
    /// **Units**: length cubed.
    ///
    /// See [`volume`], also for open surfaces.
    #[must_use]
    pub fn volume(&self) -> T {
        volume(self)
    }

    /// The centroid of the surface, each face weighted with its area. **Units**: a point.
    ///
    /// See [`surface_centroid`].
    #[must_use]
    pub fn centroid(&self) -> Point3<T> {
        surface_centroid(self)
    }

    /// The centroid of the body that a closed surface encloses, or `None` if it encloses no volume.
    /// **Units**: a point.
    ///
    /// See [`volume_centroid`].
    #[must_use]
    pub fn volume_centroid(&self) -> Option<Point3<T>> {
        volume_centroid(self)
    }

    /// The axis-aligned bounding box of the vertices. **Units**: length.
    ///
    /// See [`bounding_box`].
    #[must_use]
    pub fn bounding_box(&self) -> BoundingBox<T> {
        bounding_box(self)
    }

    /// The length of one edge. **Units**: length.
    ///
    /// See [`edge_length`].
    #[inline]
    #[must_use]
    pub fn edge_length(&self, edge: EdgeId) -> T {
        edge_length(self, edge)
    }

    /// The length of every edge. **Units**: length.
    ///
    /// See [`edge_lengths`].
    #[must_use]
    pub fn edge_lengths(&self) -> EdgeMap<T> {
        edge_lengths(self)
    }

    /// The mean of the edge lengths. **Units**: length.
    ///
    /// See [`mean_edge_length`].
    #[must_use]
    pub fn mean_edge_length(&self) -> T {
        mean_edge_length(self)
    }

    /// The area of every face. **Units**: area.
    ///
    /// See [`face_areas`].
    #[must_use]
    pub fn face_areas(&self) -> FaceMap<T> {
        face_areas(self)
    }

    /// A third of the area of the triangles around each vertex. **Units**: area.
    ///
    /// See [`dual_areas`].
    #[must_use]
    pub fn dual_areas(&self) -> VertexMap<T> {
        dual_areas(self)
    }

    /// The sum of the areas of the triangles around each vertex. **Units**: area.
    ///
    /// See [`one_ring_areas`].
    #[must_use]
    pub fn one_ring_areas(&self) -> VertexMap<T> {
        one_ring_areas(self)
    }

    /// The unit normal of one face; zero if the face has no area. **Units**: none.
    ///
    /// See [`face_normal`].
    #[inline]
    #[must_use]
    pub fn face_normal(&self, face: FaceId) -> Vector3<T> {
        face_normal(self, face)
    }

    /// The unit normal of every face; zero where a face has no area. **Units**: none.
    ///
    /// See [`face_normals`].
    #[must_use]
    pub fn face_normals(&self) -> FaceMap<Vector3<T>> {
        face_normals(self)
    }

    /// The unit normal of every vertex: the direction of the sum of the area vectors of the faces
    /// around it, or zero where that vanishes. **Units**: none.
    ///
    /// See [`vertex_normals`].
    #[must_use]
    pub fn vertex_normals(&self) -> VertexMap<Vector3<T>> {
        vertex_normals(self)
    }

    /// The angle of the corner that each halfedge leaves, within its face; zero at the boundary.
    /// **Units**: radians.
    ///
    /// See [`corner_angles`].
    #[must_use]
    pub fn corner_angles(&self) -> HalfedgeMap<T> {
        corner_angles(self)
    }

    /// Smallest, largest and mean smallest corner angle. **Units**: radians.
    ///
    /// See [`angle_statistics`].
    #[must_use]
    pub fn angle_statistics(&self) -> AngleStatistics<T> {
        angle_statistics(self)
    }

    /// The cotangent of the angle opposite each halfedge in its face; zero at the boundary.
    /// **Units**: none.
    ///
    /// See [`opposite_cotangents`].
    #[must_use]
    pub fn opposite_cotangents(&self) -> HalfedgeMap<T> {
        opposite_cotangents(self)
    }

    /// The signed angle between the normals of the two faces at each edge, positive where the
    /// surface is convex. **Units**: radians.
    ///
    /// See [`dihedral_angles`].
    #[must_use]
    pub fn dihedral_angles(&self) -> EdgeMap<T> {
        dihedral_angles(self)
    }

    /// The integral of the Gaussian curvature over the cell of each vertex: 2π less the sum of
    /// the angles around it. **Units**: radians.
    ///
    /// See [`angle_defects`], also for the boundary.
    #[must_use]
    pub fn angle_defects(&self) -> VertexMap<T> {
        angle_defects(self)
    }

    /// The integral of the mean curvature over the cell of each vertex. **Units**: length.
    ///
    /// See [`integrated_mean_curvatures`].
    #[must_use]
    pub fn integrated_mean_curvatures(&self) -> VertexMap<T> {
        integrated_mean_curvatures(self)
    }

    /// The faces without area, or whose smallest height over the longest edge is at most `eps`, in
    /// ascending order. **Units**: `eps` has none.
    ///
    /// See [`degenerate_faces`].
    #[must_use]
    pub fn degenerate_faces(&self, eps: T) -> Vec<FaceId> {
        degenerate_faces(self, eps)
    }
}
