//! An arbitrary computed or painted curvature field.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::VertexMap;

use super::{CurvatureEdit, CurvatureField, check_length};
use crate::error::Error;

/// H* = a given field of mean curvatures.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{DetailOptions, TargetCurvature, edit_detail, curvature_field};
///
/// // Ripples around a sphere of radius 1.
/// let shape = cotan::shapes::icosphere::<f64>(3);
/// let wanted = shape.positions().map(|p| 1.0 + 2.0 * (20.0 * p.z).sin());
/// let edit = TargetCurvature::new(&shape.surface(), &wanted);
/// let rippled =
///     edit_detail(&shape, &Handles::new(), &edit, &DetailOptions::default())?;
/// let now = curvature_field(&shape.surface().with_positions(&rippled));
/// let product: f64 = now.values().zip(wanted.values()).map(|(a, b)| (a - 1.0) * (b - 1.0)).sum();
/// assert!(product > 0.0);
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct TargetCurvature {
    field: VertexMap<f64>,
}

impl TargetCurvature {
    /// Creates an edit from the target mean curvature of each vertex, ½ (κ₁ + κ₂), positive where
    /// convex, in inverse units of `surface`, the mesh to be edited. See
    /// [`crate::smooth::curvature_field`].
    pub fn new<T: Scalar>(surface: &Surface<'_, T>, field: &VertexMap<f64>) -> Self {
        let size = surface.bounding_box().longest_side().as_f64();
        Self {
            field: field.map(|h| h * size),
        }
    }
}

impl CurvatureEdit for TargetCurvature {
    fn edit(&self, _field: &CurvatureField<'_>) -> VertexMap<f64> {
        self.field.clone()
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        check_length("the field of curvatures", self.field.len(), num_vertices)
    }
}
