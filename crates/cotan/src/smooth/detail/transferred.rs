//! Details transferred from another mesh.

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{VertexId, VertexMap};

use super::{CurvatureEdit, CurvatureField, check_length};
use crate::error::Error;
use crate::smooth::measure::mollified_curvature_field;

/// H* = coarse H + (H' − coarse H'): the coarse shape of this mesh with the details of another.
///
/// The other mesh has the same connectivity, or is sampled through a vertex map. Its field H' is
/// in its own box units, so details keep their size relative to the shape.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{DetailOptions, TransferredCurvature, edit_detail, with_normal_noise};
///
/// let smooth = cotan::shapes::icosphere::<f64>(3);
/// let rough = with_normal_noise(&smooth.surface(), 0.01, 1);
/// let edit = TransferredCurvature::from(&smooth.surface().with_positions(&rough));
/// let edited =
///     edit_detail(&smooth, &Handles::new(), &edit, &DetailOptions::default())?;
/// assert!(edited.values().any(|p| (p.coords.norm() - 1.0).abs() > 0.005));
/// # Ok::<(), cotan::Error>(())
/// ```
///
/// **Source**: paper, section 4 (detail mixing).
#[derive(Clone, PartialEq, Debug)]
pub struct TransferredCurvature {
    fine: VertexMap<f64>,
}

impl TransferredCurvature {
    /// The details of `other`, which has the same connectivity.
    pub fn from<T: Scalar>(other: &Surface<'_, T>) -> Self {
        let size = other.bounding_box().longest_side().as_f64();
        let values = mollified_curvature_field(other).map(|h| h * size);
        Self { fine: values }
    }

    /// The details of `other`, whose vertex `map[v]` corresponds to vertex v of the mesh to be
    /// edited.
    ///
    /// # Errors
    /// [`Error::HandleOutOfRange`] for a vertex that `other` does not have.
    pub fn through<T: Scalar>(
        other: &Surface<'_, T>,
        map: &VertexMap<VertexId>,
    ) -> Result<Self, Error> {
        let whole = Self::from(other);
        if let Some(&vertex) = map.values().find(|v| v.index() >= whole.fine.len()) {
            return Err(Error::HandleOutOfRange {
                group: 0,
                vertex,
                num_vertices: whole.fine.len(),
            });
        }
        Ok(Self {
            fine: map.map(|v| whole.fine[*v]),
        })
    }
}

impl CurvatureEdit for TransferredCurvature {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        /// The same as in [`super::ScaledCurvature`].
        const PASSES: usize = 20;
        let difference = field.values.values().zip(self.fine.values());
        let difference = field.with_values(difference.map(|(h, other)| other - h).collect());
        let coarse = difference.smoothed(PASSES);
        let terms = field.values.values().zip(difference.values.values());
        terms
            .zip(coarse.values.values())
            .map(|((h, difference), coarse)| h + (difference - coarse))
            .collect()
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        check_length(
            "the mesh that details are taken from",
            self.fine.len(),
            num_vertices,
        )
    }
}
