//! The settings of a sphere map, and the report of a run.

use cotan_flow::StopReason;

use super::error::SphereError;
use crate::named::{named, setters};
use crate::options::SchemeKind;

named!(
    /// The method of mapping a mesh to the sphere.
    SphereMethod, "method", {
        /// Constant curvature, with scale, position and rotation fixed in each step, and repairs
        /// where triangles flip. Never returns an unchecked map.
        #[default]
        Robust = "robust",
        /// The iteration of the paper (section 4.1), with a fixed scale, which the paper leaves
        /// open. It flips triangles on many meshes, which results in an error.
        Paper = "paper",
        /// Conformalized mean-curvature flow (Kazhdan, Solomon, Ben-Chen 2012), for comparison.
        /// It flips triangles on some meshes, which results in an error.
        Cmcf = "cmcf",
    }
);

named!(
    /// Centring of the result by a Möbius map.
    Centering, "centring", {
        /// The images of the vertices, weighted by the areas around them on the *source* mesh,
        /// have mean zero, unless rounding would flip a triangle.
        #[default]
        SourceAreas = "on",
        /// The result is not centred. The robust method still centres it while it iterates,
        /// because it would drift otherwise.
        Off = "off",
    }
);

/// The settings of [`crate::spherical()`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct SphereOptions {
    /// The weights of the iteration. Tutte's weights are used in their symmetric form, except in
    /// the paper's method.
    pub scheme: SchemeKind,
    /// The mapping method.
    pub method: SphereMethod,
    /// 0 preserves angles (conformal), 1 preserves areas (authalic). Above 0 the robust method
    /// uses the hierarchy instead of the iteration, whose settings are then ignored.
    pub authalic: f64,
    /// Centring of the result.
    pub centering: Centering,
    /// The iteration stops when no vertex moves by more than this on the unit sphere.
    pub tolerance: f64,
    /// The maximum number of iterations per round.
    pub iteration_limit: usize,
    /// The memory limit of a factorization in bytes; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(SphereOptions {
    scheme: SchemeKind,
    method: SphereMethod,
    authalic: f64,
    centering: Centering,
    tolerance: f64,
    iteration_limit: usize,
    max_memory: impl Into<Option<u64>>,
});

impl Default for SphereOptions {
    fn default() -> Self {
        Self {
            scheme: SchemeKind::Cotangent,
            method: SphereMethod::Robust,
            authalic: 0.0,
            centering: Centering::SourceAreas,
            tolerance: 1e-4,
            iteration_limit: 100,
            max_memory: None,
        }
    }
}

impl SphereOptions {
    /// The settings of the paper with one of its two schemes, cotangent or Tutte.
    pub fn paper(scheme: SchemeKind) -> Self {
        Self {
            scheme,
            method: SphereMethod::Paper,
            centering: Centering::Off,
            iteration_limit: 300,
            ..Self::default()
        }
    }

    pub(crate) fn check(&self) -> Result<(), SphereError> {
        let refuse = |setting, range, value| {
            Err(SphereError::Setting {
                setting,
                range,
                value,
            })
        };
        if !(0.0..=1.0).contains(&self.authalic) {
            return refuse("authalic share", "between 0 and 1", self.authalic);
        }
        if !(self.tolerance >= 0.0) {
            return refuse("tolerance", "at least 0", self.tolerance);
        }
        Ok(())
    }
}

/// A stage of the computation of a map.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Stage {
    /// The iteration of the requested method.
    Iteration,
    /// The iteration again, with raised weights around flipped triangles.
    SelectiveRepair,
    /// A new embedding of the patches around flipped triangles.
    Untangling,
    /// A new embedding of the whole mesh, vertex by vertex, from coarse to fine.
    Hierarchy,
}

impl Stage {
    /// A short description of the stage.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Iteration => "iteration",
            Self::SelectiveRepair => "selective repair",
            Self::Untangling => "untangling",
            Self::Hierarchy => "hierarchical embedding",
        }
    }
}

/// The report of the computation of a map.
#[derive(Clone, PartialEq, Debug, Default)]
#[must_use = "the report says whether the iteration converged"]
#[non_exhaustive]
pub struct SphereReport {
    /// The iterations of all rounds; each costs one solve.
    pub iterations: usize,
    /// The reason why the last round stopped; `None` if there were no iterations.
    pub stop: Option<StopReason>,
    /// The largest displacement on the unit sphere in the last step; 0 if there were no
    /// iterations.
    pub change: f64,
    /// The number of factorizations.
    pub factorizations: usize,
    /// The stages in order.
    pub stages: Vec<Stage>,
    /// The numbers of flipped triangles after the iteration and after each repair.
    pub flips: Vec<usize>,
}
