//! A checked map of a mesh onto the unit sphere.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar, scalar};
use cotan_halfedge::{FaceId, HalfedgeMesh};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::error::SphereError;
use super::predicate::flipped_faces;

/// A map of a closed genus-0 triangle mesh onto the unit sphere, checked triangle by triangle:
/// each vertex lies on the sphere within rounding, no triangle is flipped or degenerate by the
/// exact sign of its determinant, and the triangles cover the sphere once.
///
/// Points inside a face are mapped by central projection of the flat triangle between the images
/// of its corners.
#[derive(Clone, PartialEq, Debug)]
pub struct SphereMap<T: Scalar> {
    mesh: Arc<HalfedgeMesh>,
    positions: Positions<T>,
}

impl<T: Scalar> SphereMap<T> {
    /// Checks that `positions` map `mesh` one-to-one onto the unit sphere.
    ///
    /// **Shapes**: one position per vertex. The map owns its mesh: an `Arc` is shared, a
    /// reference is cloned.
    ///
    /// # Errors
    /// [`SphereError`] describing the problem: a mesh that is not a closed, connected triangle
    /// mesh of genus 0; a vertex off the sphere; flipped triangles; a sphere covered more than
    /// once.
    pub fn new(
        mesh: impl Into<Arc<HalfedgeMesh>>,
        positions: Positions<T>,
    ) -> Result<Self, SphereError> {
        let mesh = mesh.into();
        super::error::check_topology(&mesh)?;
        Self::on_sphere(mesh, positions)
    }

    /// Like [`Self::new`], for a mesh whose topology has been checked.
    pub(crate) fn on_sphere(
        mesh: Arc<HalfedgeMesh>,
        positions: Positions<T>,
    ) -> Result<Self, SphereError> {
        if positions.len() != mesh.num_vertices() {
            return Err(cotan_geometry::SurfaceError::LengthMismatch {
                positions: positions.len(),
                vertices: mesh.num_vertices(),
            }
            .into());
        }
        let off = |p: &nalgebra::Point3<T>| (p.coords.map(T::as_f64).norm() - 1.0).abs();
        let allowed = 4.0 * T::default_epsilon().as_f64();
        if let Some((vertex, p)) = positions.iter().find(|(_, p)| !(off(p) <= allowed)) {
            let distance = off(p);
            return Err(match distance.is_finite() {
                true => SphereError::OffSphere { vertex, distance },
                false => SphereError::Overflow { vertex },
            });
        }
        let flipped = flipped_faces(&mesh, &positions);
        if let Some(&first) = flipped.first() {
            return Err(SphereError::Flipped {
                count: flipped.len(),
                first,
            });
        }
        let map = Self { mesh, positions };
        // Upright triangles cover the sphere an integer number of times.
        let degree = map.degree();
        if degree.round() as i64 != 1 {
            return Err(SphereError::Degree {
                degree: degree.round() as i64,
            });
        }
        Ok(map)
    }

    /// Creates another map of the same mesh, checked.
    ///
    /// # Errors
    /// Same as [`Self::new`].
    pub fn with_positions(&self, positions: Positions<T>) -> Result<Self, SphereError> {
        Self::on_sphere(Arc::clone(&self.mesh), positions)
    }

    /// The connectivity, shared by all maps of one mesh.
    pub fn mesh(&self) -> &Arc<HalfedgeMesh> {
        &self.mesh
    }

    /// The positions of the vertices on the unit sphere.
    pub fn positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// Converts the map into its positions.
    pub fn into_positions(self) -> Positions<T> {
        self.positions
    }

    /// The number of times that the triangles cover the sphere: the sum of their solid angles
    /// over 4π. It is 1 up to rounding.
    pub fn degree(&self) -> f64 {
        let angle = |f| self.solid_angle(FaceId::new(f));
        let angles = parallel::filled(self.mesh.num_faces(), angle);
        angles.iter().sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    /// The solid angle of a face's image, in steradians.
    ///
    /// **Source**: Van Oosterom and Strackee 1983, computed from differences, because the
    /// determinant of the corners would suffer from cancellation in thin triangles.
    pub fn solid_angle(&self, face: FaceId) -> f64 {
        let corners = self.mesh.triangle(face).map(|v| self.positions[v].coords);
        let [a, b, c] = corners.map(|p| p.map(T::as_f64));
        solid_angle(&a, &b, &c)
    }

    /// The largest | |v − c| / r − 1 | with c = 0 and r = 1: the largest relative distance of a
    /// vertex from the sphere.
    pub fn sphericity_error(&self) -> T {
        self.positions
            .values()
            .map(|p| (p.coords.norm() - T::one()).abs())
            .fold(scalar(0.0), |a: T, b| a.max(b))
    }
}

/// Solid angle of the triangle a, b, c as seen from the origin; negative if it is clockwise.
pub(crate) fn solid_angle(a: &Vector3<f64>, b: &Vector3<f64>, c: &Vector3<f64>) -> f64 {
    let numerator = a.dot(&(b - a).cross(&(c - a)));
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * numerator.atan2(denominator)
}
