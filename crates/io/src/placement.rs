//! Invertible affine transforms that place a mesh in a scene.

use nalgebra::{Matrix3, Matrix4, Point3, Vector3};

/// A transform from mesh coordinates to scene coordinates, and its inverse.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Placement {
    linear: Matrix3<f64>,
    offset: Vector3<f64>,
    inverse: Matrix3<f64>,
    is_identity: bool,
    /// `true` for a reflection, which reverses the orientation of faces.
    pub(crate) is_mirrored: bool,
}

/// An additional instance of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Instance<'a> {
    /// Index of the document part that is the mesh.
    pub(crate) part: usize,
    /// The placement in the document.
    pub(crate) from: &'a Placement,
    /// The placement of this instance.
    pub(crate) to: &'a Placement,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            linear: Matrix3::identity(),
            offset: Vector3::zeros(),
            inverse: Matrix3::identity(),
            is_identity: true,
            is_mirrored: false,
        }
    }
}

impl Placement {
    /// Returns `None` if the transform is not invertible.
    pub(crate) fn new(matrix: &Matrix4<f64>) -> Option<Self> {
        let linear: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
        let offset: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
        let bottom = matrix.row(3);
        let is_affine =
            bottom[0] == 0.0 && bottom[1] == 0.0 && bottom[2] == 0.0 && bottom[3] == 1.0;
        let inverse = linear.try_inverse()?;
        let finite = linear.iter().chain(&offset).chain(&inverse);
        // Use the condition number: the determinant depends on the scale and could hide a
        // singular matrix.
        let condition = linear.norm() * inverse.norm();
        if !is_affine || !finite.copied().all(f64::is_finite) || !(condition < 1e12) {
            return None;
        }
        Some(Self {
            is_identity: linear == Matrix3::identity() && offset == Vector3::zeros(),
            is_mirrored: linear.determinant() < 0.0,
            linear,
            offset,
            inverse,
        })
    }

    #[inline]
    pub(crate) fn to_scene(&self, p: Point3<f64>) -> Point3<f64> {
        if self.is_identity {
            p
        } else {
            self.linear * p + self.offset
        }
    }

    pub(crate) fn to_mesh(&self, p: Point3<f64>) -> Point3<f64> {
        if self.is_identity {
            p
        } else {
            self.inverse * (p - self.offset)
        }
    }

    /// Transforms a normal with the surface, preserving its length.
    pub(crate) fn normal_to_scene(&self, n: Vector3<f64>) -> Vector3<f64> {
        if self.is_identity {
            n
        } else {
            with_length(self.inverse.tr_mul(&n), n.norm())
        }
    }

    /// The inverse of `normal_to_scene`.
    pub(crate) fn normal_to_mesh(&self, n: Vector3<f64>) -> Vector3<f64> {
        if self.is_identity {
            n
        } else {
            with_length(self.linear.tr_mul(&n), n.norm())
        }
    }
}

fn with_length(n: Vector3<f64>, length: f64) -> Vector3<f64> {
    n.try_normalize(0.0).unwrap_or_default() * length
}
