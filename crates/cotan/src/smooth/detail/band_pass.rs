//! Separate factors for the coarse and the fine scale.

use cotan_halfedge::VertexMap;

use super::{CurvatureEdit, CurvatureField};

/// H* = coarse H + f (middle) + g (fine): the field is split at two scales, and each band has its
/// own factor.
///
/// fine = H − H after `fine_passes` half steps of the umbrella operator; coarse = H after
/// `coarse_passes`; middle is the band between them. Each pass reaches one edge farther; the
/// effective radius of n passes is about √n edges. With both factors 1, nothing changes.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{BandPass, DetailOptions, edit_detail};
///
/// // Fine roughness away, larger bumps half as strong again.
/// let shape = cotan::shapes::bumpy_plane::<f64>([4.0, 4.0], [24, 24], 0.1);
/// let edit = BandPass { fine: 0.0, middle: 1.5, ..BandPass::default() };
/// let edited =
///     edit_detail(&shape, &Handles::new(), &edit, &DetailOptions::default())?;
/// assert_eq!(edited.len(), shape.positions().len());
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct BandPass {
    /// g, the factor of the finest band.
    pub fine: f64,
    /// f, the factor of the middle band.
    pub middle: f64,
    /// The number of passes that separate the fine band.
    pub fine_passes: usize,
    /// The number of passes that separate the coarse part; at least `fine_passes`.
    pub coarse_passes: usize,
}

impl Default for BandPass {
    fn default() -> Self {
        Self {
            fine: 1.0,
            middle: 1.0,
            fine_passes: 4,
            coarse_passes: 40,
        }
    }
}

impl CurvatureEdit for BandPass {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        let without_fine = field.smoothed(self.fine_passes);
        let further = self.coarse_passes.saturating_sub(self.fine_passes);
        let coarse = without_fine.smoothed(further);
        let bands = field.values.values().zip(without_fine.values.values());
        bands
            .zip(coarse.values.values())
            .map(|((h, middle), coarse)| {
                h + (self.fine - 1.0) * (h - middle) + (self.middle - 1.0) * (middle - coarse)
            })
            .collect()
    }
}
