//! The settings of smoothing, as plain values with names.

use super::anchored::Boundary;
use super::preserve::Preserve;
use crate::options::{named, setters};

named!(
    /// The choice of a method of smoothing.
    SmoothMethod, "smoothing method", {
        /// By [`Smoother::Curvature`] or [`Smoother::Feature`], whichever suits the mesh
        /// ([`super::Decision`]).
        #[default]
        Auto = "auto",
        /// [`Smoother::Curvature`].
        Curvature = "curvature",
        /// [`Smoother::Anchored`].
        Anchored = "anchored",
        /// [`Smoother::Paper`].
        Paper = "paper",
        /// [`Smoother::Feature`].
        Feature = "feature",
        /// [`Smoother::FeatureEdges`].
        FeatureEdges = "feature-edges",
        /// [`Smoother::Taubin`].
        Taubin = "taubin",
        /// [`Smoother::Implicit`].
        Implicit = "implicit",
    }
);

impl SmoothMethod {
    /// The method that this names; `None` if the mesh is to decide.
    pub fn smoother(self) -> Option<Smoother> {
        Some(match self {
            Self::Auto => return None,
            Self::Curvature => Smoother::Curvature,
            Self::Anchored => Smoother::Anchored,
            Self::Paper => Smoother::Paper,
            Self::Feature => Smoother::Feature,
            Self::FeatureEdges => Smoother::FeatureEdges,
            Self::Taubin => Smoother::Taubin,
            Self::Implicit => Smoother::Implicit,
        })
    }
}

named!(
    /// The methods of smoothing, measured side by side in `docs/decisions`.
    Smoother, "smoother", {
        /// [`super::SmoothedCurvature`] of second order on umbrella weights, from a lightly
        /// smoothed start, anchored as firmly as the noise of the mesh allows.
        #[default]
        Curvature = "curvature",
        /// [`super::SmoothedCurvature`] of the paper on cotangent weights, every vertex anchored
        /// with μ = 1, five steps.
        Anchored = "anchored",
        /// The paper's section 4.2 to the letter, signs and the factor 4 put right: one vertex of
        /// every component pinned. It loses or gains volume without bound.
        Paper = "paper",
        /// [`super::FilteredNormals`]: keeps creases, for parts from CAD.
        Feature = "feature",
        /// [`super::FeaturePreserving`]: dihedral angles filtered.
        FeatureEdges = "feature-edges",
        /// [`super::Taubin`].
        Taubin = "taubin",
        /// [`super::ImplicitFlow`] (Desbrun).
        Implicit = "implicit",
    }
);

impl Smoother {
    /// Iterations where none are asked for.
    pub fn default_iterations(self) -> usize {
        match self {
            Self::Anchored => 5,
            Self::Curvature | Self::FeatureEdges | Self::Taubin | Self::Paper => 10,
            Self::Feature => 20,
            Self::Implicit => 1,
        }
    }
}

/// What becomes of faces that would point against their neighbours and did not before.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum NewFolds {
    /// The vertices around them stay where they were. The methods for comparison (Taubin, implicit,
    /// the paper's) allow them all the same.
    #[default]
    Prevent,
    /// They stay: the method as it is.
    Allow,
}

/// The settings of [`super::smooth`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct SmoothOptions {
    /// The method.
    pub method: SmoothMethod,
    /// How often; `None` for what the method needs. 0 changes nothing.
    pub iterations: Option<usize>,
    /// s, above 0 and at most 1: how much of a step of the curvature is taken; for `implicit` the
    /// time of a step is s/2 squared mean edge lengths. Other methods have no use for it.
    pub step: f64,
    /// μ > 0: how firmly every vertex is held where it was, beside the operator, whose diagonal is
    /// about 7. Smaller smooths more. `None` for what suits the method and the noise.
    pub anchor: Option<f64>,
    /// What happens to the boundary.
    pub boundary: Boundary,
    /// What becomes of faces that would turn over.
    pub folds: NewFolds,
    /// What is kept exactly.
    pub preserve: Preserve,
    /// No vertex moves farther than this, in the units of the mesh; handles excepted.
    pub max_displacement: Option<f64>,
    /// The most bytes that the factorization may take; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(SmoothOptions {
    method: SmoothMethod,
    iterations: impl Into<Option<usize>>,
    step: f64,
    anchor: impl Into<Option<f64>>,
    boundary: Boundary,
    folds: NewFolds,
    preserve: Preserve,
    max_displacement: impl Into<Option<f64>>,
    max_memory: impl Into<Option<u64>>,
});

impl Default for SmoothOptions {
    fn default() -> Self {
        Self {
            method: SmoothMethod::default(),
            iterations: None,
            step: 1.0,
            anchor: None,
            boundary: Boundary::default(),
            folds: NewFolds::default(),
            preserve: Preserve::default(),
            max_displacement: None,
            max_memory: None,
        }
    }
}
