//! The settings of a sphere map, and what is told of a run.

use cotan_flow::StopReason;

use super::error::SphereError;
use crate::options::{SchemeKind, named, setters};

named!(
    /// How a mesh is mapped to the sphere.
    SphereMethod, "method", {
        /// Constant curvature, with scale, place and rotation fixed in every step, repaired where
        /// triangles flip: never an unchecked map.
        #[default]
        Robust = "robust",
        /// The paper's own iteration (section 4.1), with the scale fixed, which it leaves open. It
        /// flips triangles on many meshes, and is refused then.
        Paper = "paper",
        /// Conformalized mean-curvature flow (Kazhdan, Solomon, Ben-Chen 2012), for comparison. It
        /// flips triangles on some meshes, and is refused then.
        Cmcf = "cmcf",
    }
);

named!(
    /// Whether a Möbius map centres the result.
    Centering, "centring", {
        /// The images of the vertices, weighted by the areas around them on the *source* mesh,
        /// average zero, where that can be rounded without a flip.
        #[default]
        SourceAreas = "on",
        /// The result stays where the iteration left it. The robust method is centred all the same
        /// while it iterates: without that it drifts.
        Off = "off",
    }
);

/// The settings of [`crate::spherical()`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct SphereOptions {
    /// Who chooses the weights of the iteration. Tutte's are taken in their symmetric form but for
    /// the paper's method.
    pub scheme: SchemeKind,
    /// How the mesh is mapped.
    pub method: SphereMethod,
    /// From 0, angles are kept (conformal), to 1, areas are kept (authalic). Above 0 the robust
    /// method is the hierarchy and not the iteration, whose settings then say nothing.
    pub authalic: f64,
    /// Whether a Möbius map centres the result.
    pub centering: Centering,
    /// Stop when no vertex moves by more than this on the unit sphere.
    pub tolerance: f64,
    /// The most iterations of a round.
    pub iteration_limit: usize,
    /// The most bytes that a factorization may take; see [`cotan_linear::SystemOptions`].
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
    /// The paper's own settings with one of its two schemes, cotangent or Tutte.
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

/// A stage that a map went through.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Stage {
    /// The iteration of the method that was asked for.
    Iteration,
    /// The iteration again, with the small weights around flipped triangles raised.
    SelectiveRepair,
    /// Patches around flipped triangles embedded anew.
    Untangling,
    /// The whole mesh embedded anew, vertex by vertex, coarse to fine.
    Hierarchy,
}

impl Stage {
    /// The stage in a few words.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Iteration => "iteration",
            Self::SelectiveRepair => "selective repair",
            Self::Untangling => "untangling",
            Self::Hierarchy => "hierarchical embedding",
        }
    }
}

/// How a map came about.
#[derive(Clone, PartialEq, Debug, Default)]
#[must_use = "the report says whether the iteration converged"]
#[non_exhaustive]
pub struct SphereReport {
    /// Iterations of all rounds; each costs one solve.
    pub iterations: usize,
    /// Why the last round stopped; `None` where nothing was iterated.
    pub stop: Option<StopReason>,
    /// The last step's longest move on the unit sphere; 0 where nothing was iterated.
    pub change: f64,
    /// How often a matrix was factorized.
    pub factorizations: usize,
    /// What was done, in order.
    pub stages: Vec<Stage>,
    /// Flipped triangles after the iteration and after each repair.
    pub flips: Vec<usize>,
}
