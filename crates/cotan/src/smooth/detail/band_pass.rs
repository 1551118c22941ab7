//! Coarse and fine scale apart.

use cotan_halfedge::VertexMap;

use super::{CurvatureEdit, CurvatureField};

/// H* = coarse H + f (middle) + g (fine): the field cut at two scales, each band with its own
/// factor.
///
/// fine = H − H after `fine_passes` half steps of the umbrella; coarse = H after `coarse_passes`;
/// middle is what lies between. A pass reaches one edge farther, n passes about √n edges. Both
/// factors 1 change nothing.
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
    /// Passes that separate the fine band.
    pub fine_passes: usize,
    /// Passes that separate the coarse part; at least `fine_passes`.
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
