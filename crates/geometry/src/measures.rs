//! The measures of a surface as methods. Each is implemented in the module of its topic.

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
use crate::self_intersections::self_intersections;
use crate::surface::Surface;
use crate::volume::{surface_centroid, volume, volume_centroid};

/// Measures. They are not finite if a coordinate is not finite.
impl<T: Scalar> Surface<'_, T> {
    /// The area of the surface.
    ///
    /// **Units**: area.
    #[must_use]
    pub fn area(&self) -> T {
        surface_area(self)
    }

    /// The signed volume enclosed by a closed surface: ⅙ Σ_f (a × b)·c.
    ///
    /// Corners are taken relative to the centre of the bounding box, so that a mesh far from the
    /// origin loses no digits. Positive if the faces are counter-clockwise as seen from the
    /// outside.
    ///
    /// **Units**: length cubed. For an open surface it is the volume of the cone over the surface
    /// with its apex at that centre: invariant under translation, but not a property of the
    /// surface alone.
    ///
    /// ```
    /// use cotan_geometry::bar;
    /// let shape = bar::<f64>([1.0, 2.0, 3.0], [1, 2, 3]);
    /// assert!((shape.surface().volume() - 6.0).abs() < 1e-14);
    /// ```
    #[must_use]
    pub fn volume(&self) -> T {
        volume(self)
    }

    /// The centroid of the surface, weighted by face area.
    ///
    /// **Units**: a point. The mean of the vertices if the total area is zero.
    #[must_use]
    pub fn centroid(&self) -> Point3<T> {
        surface_centroid(self)
    }

    /// The centroid of the body enclosed by a closed surface, or `None` if it encloses no volume.
    ///
    /// **Units**: a point. Meaningless for open surfaces.
    #[must_use]
    pub fn volume_centroid(&self) -> Option<Point3<T>> {
        volume_centroid(self)
    }

    /// The axis-aligned bounding box of the vertices.
    ///
    /// **Units**: length.
    #[must_use]
    pub fn bounding_box(&self) -> BoundingBox<T> {
        bounding_box(self)
    }

    /// The length of an edge.
    ///
    /// **Units**: length. Zero if the two ends coincide.
    #[inline]
    #[must_use]
    pub fn edge_length(&self, edge: EdgeId) -> T {
        edge_length(self, edge)
    }

    /// The length of each edge.
    ///
    /// **Shapes**: one entry per edge. **Units**: length.
    ///
    /// ```
    /// use cotan_geometry::tetrahedron;
    /// let shape = tetrahedron::<f64>();
    /// let lengths = shape.surface().edge_lengths();
    /// assert!(lengths.values().all(|l| (l - (8.0_f64 / 3.0).sqrt()).abs() < 1e-15));
    /// ```
    #[must_use]
    pub fn edge_lengths(&self) -> EdgeMap<T> {
        edge_lengths(self)
    }

    /// The mean edge length.
    ///
    /// **Units**: length.
    #[must_use]
    pub fn mean_edge_length(&self) -> T {
        mean_edge_length(self)
    }

    /// The area of each face.
    ///
    /// **Shapes**: one entry per face. **Units**: area.
    #[must_use]
    pub fn face_areas(&self) -> FaceMap<T> {
        face_areas(self)
    }

    /// A third of the area of the triangles around each vertex: the barycentric dual cells.
    ///
    /// They sum to the area of the surface.
    ///
    /// **Shapes**: `n` vertices. **Units**: area.
    #[must_use]
    pub fn dual_areas(&self) -> VertexMap<T> {
        dual_areas(self)
    }

    /// A_i of the paper: the **sum** of the areas of the triangles around each vertex, not a
    /// third of it.
    ///
    /// They sum to three times the area of the surface.
    ///
    /// **Shapes**: `n` vertices. **Units**: area. A boundary vertex has the area of its open fan.
    ///
    /// **Source**: Au et al. 2005, section 2, where the mean curvature normal is κ_i n_i = ℓ_i /
    /// (4 A_i).
    #[must_use]
    pub fn one_ring_areas(&self) -> VertexMap<T> {
        one_ring_areas(self)
    }

    /// The unit normal of a face, or zero if the face has no area.
    ///
    /// **Units**: dimensionless.
    #[inline]
    #[must_use]
    pub fn face_normal(&self, face: FaceId) -> Vector3<T> {
        face_normal(self, face)
    }

    /// The unit normal of each face, or zero for a face without area.
    ///
    /// **Shapes**: one entry per face. **Units**: dimensionless.
    #[must_use]
    pub fn face_normals(&self) -> FaceMap<Vector3<T>> {
        face_normals(self)
    }

    /// N_i of the paper: the unit normal of each vertex, in the direction of the sum of the area
    /// vectors of the faces around it.
    ///
    /// **Shapes**: `n` vertices. **Units**: dimensionless. At the boundary the open fan is used.
    /// Zero where the sum vanishes, that is, where all faces have no area or a fan is folded flat
    /// onto itself.
    ///
    /// ```
    /// use cotan_geometry::icosphere;
    /// let shape = icosphere::<f64>(3);
    /// let normals = shape.surface().vertex_normals();
    /// for (v, normal) in normals.iter() {
    ///     assert!((normal - shape.positions()[v].coords).norm() < 0.05);
    /// }
    /// ```
    ///
    /// **Source**: Au et al. 2005, section 2: area-weighted average of the face normals.
    #[must_use]
    pub fn vertex_normals(&self) -> VertexMap<Vector3<T>> {
        vertex_normals(self)
    }

    /// The angle of the corner at the origin of each halfedge, within its face; zero for boundary
    /// halfedges.
    ///
    /// **Shapes**: one entry per halfedge. **Units**: radians. A face without area has angles of
    /// 0 and π, or only 0 where corners coincide.
    #[must_use]
    pub fn corner_angles(&self) -> HalfedgeMap<T> {
        corner_angles(self)
    }

    /// Smallest, largest and mean smallest corner angle.
    ///
    /// **Units**: radians.
    #[must_use]
    pub fn angle_statistics(&self) -> AngleStatistics<T> {
        angle_statistics(self)
    }

    /// The cotangent of the angle opposite each halfedge in its face; zero for boundary halfedges.
    ///
    /// The paper's weight of the edge of halfedge h is w = `cot[h] + cot[h.twin()]`.
    ///
    /// **Shapes**: one entry per halfedge. **Units**: dimensionless. For degenerate faces see
    /// [`cotangent`](crate::cotangent).
    #[must_use]
    pub fn opposite_cotangents(&self) -> HalfedgeMap<T> {
        opposite_cotangents(self)
    }

    /// The signed angle between the normals of the two faces at each edge, positive where the
    /// surface is convex: see [`dihedral_angle`](crate::dihedral_angle).
    ///
    /// **Shapes**: one entry per edge. **Units**: radians.
    #[must_use]
    pub fn dihedral_angles(&self) -> EdgeMap<T> {
        dihedral_angles(self)
    }

    /// The angle defect of each vertex: the integral of the Gaussian curvature over its dual cell.
    ///
    /// It is 2π (π at the boundary) minus the sum of the angles around the vertex; at the
    /// boundary this includes the geodesic curvature. The sum over all vertices is 2πχ, where χ
    /// is the Euler characteristic.
    ///
    /// **Shapes**: `n` vertices. **Units**: radians.
    #[must_use]
    pub fn angle_defects(&self) -> VertexMap<T> {
        angle_defects(self)
    }

    /// The integral of the mean curvature H = ½ (κ₁ + κ₂) over the dual cell of each vertex: ¼
    /// Σ_e θ_e |e| over the edges at the vertex, where θ is the [dihedral
    /// angle](crate::dihedral_angle).
    ///
    /// The integral over one edge is ½ θ |e|, and each of its ends takes half. The sum over all
    /// vertices converges to 4π for the unit sphere, and is π (a + b + c) for a box with these
    /// side lengths. Positive where the surface is convex (with outward normals), and independent
    /// of the triangulation of flat parts.
    ///
    /// **Shapes**: `n` vertices. **Units**: length. Boundary edges contribute nothing.
    ///
    /// **Source**: Steiner's formula; Cohen-Steiner and Morvan 2003.
    #[must_use]
    pub fn integrated_mean_curvatures(&self) -> VertexMap<T> {
        integrated_mean_curvatures(self)
    }

    /// The faces that have no area or a [`relative_height`](crate::relative_height) of at most
    /// `eps`, in ascending order.
    ///
    /// **Units**: `eps` is dimensionless. 0 finds exact zeros; 1e-6 finds slivers that are
    /// certainly unintended.
    ///
    /// ```
    /// let sphere = cotan_geometry::icosphere::<f64>(2);
    /// assert!(sphere.surface().degenerate_faces(0.1).is_empty());
    /// ```
    #[must_use]
    pub fn degenerate_faces(&self, eps: T) -> Vec<FaceId> {
        degenerate_faces(self, eps)
    }

    /// The faces that cross another face, in ascending order. Pairs that share a vertex touch by
    /// construction and are not examined.
    ///
    /// Faces that only touch do not cross, nor do faces without area. Coplanar faces that overlap
    /// do. The signs are exact for the given coordinates, so a crossing that is within the last
    /// digits may appear or disappear after a rigid motion, which rounds the vertices. A surface
    /// that passes through another exactly along edges of both only touches it.
    ///
    /// A tree of bounding boxes keeps the time near O(n log n). It grows to O(n²) only if most
    /// boxes overlap and nothing crosses. **Memory**: about 300 bytes per face.
    ///
    /// ```
    /// let sphere = cotan_geometry::icosphere::<f64>(3);
    /// assert!(sphere.surface().self_intersections().is_empty());
    /// ```
    #[must_use]
    pub fn self_intersections(&self) -> Vec<FaceId> {
        self_intersections(self)
    }
}
