//! Exaggerated or faded details.

use cotan_halfedge::VertexMap;

use super::{CurvatureEdit, CurvatureField};

/// H* = H + (f − 1)(H − coarse H): details f times as strong, with an unchanged coarse shape.
///
/// The coarse part is the field after `passes` half steps of the umbrella operator. f = 1 changes
/// nothing, 0 removes the details, 2 doubles them. Above 2.5 the rebuilt surface may not
/// converge.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{DetailOptions, ScaledCurvature, edit_detail, mean_curvature_rms};
///
/// let shape = cotan::shapes::bumpy_plane::<f64>([4.0, 4.0], [32, 32], 0.1);
/// let curved = |x| mean_curvature_rms(&shape.surface().with_positions(x));
/// let faded = edit_detail(
///     shape.surface(),
///     &Handles::new(),
///     &ScaledCurvature::by(0.5),
///     &DetailOptions::default(),
/// )?;
/// assert!(curved(&faded) < curved(shape.positions()));
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ScaledCurvature {
    /// f.
    pub factor: f64,
    /// The number of smoothing passes that give the coarse part.
    pub passes: usize,
}

impl ScaledCurvature {
    /// Makes details `factor` times as strong.
    pub fn by(factor: f64) -> Self {
        Self { factor, passes: 20 }
    }
}

impl CurvatureEdit for ScaledCurvature {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        let coarse = field.smoothed(self.passes);
        let pairs = field.values.values().zip(coarse.values.values());
        pairs
            .map(|(h, coarse)| h + (self.factor - 1.0) * (h - coarse))
            .collect()
    }
}
