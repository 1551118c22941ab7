//! The settings of smoothing as plain, named values.

use super::anchored::Boundary;
use super::preserve::Preserve;
use crate::named::{named, setters};
use crate::options::SchemeKind;

named!(
    /// The selection of a smoothing method.
    SmoothMethod, "smoothing method", {
        /// [`Smoother::Curvature`] or [`Smoother::Feature`], depending on the mesh
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
    /// The selected method, or `None` if it depends on the mesh.
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
    /// The smoothing methods.
    Smoother, "smoother", {
        /// [`super::SmoothedCurvature`] of second order with umbrella weights, from a lightly
        /// smoothed start, with an anchor chosen by the noise of the mesh.
        #[default]
        Curvature = "curvature",
        /// [`super::SmoothedCurvature`] of the paper with cotangent weights, each vertex anchored
        /// with μ = 1, five steps.
        Anchored = "anchored",
        /// The method of the paper's section 4.2 as written, with corrected signs and a corrected
        /// factor 4: one vertex of each component is pinned. Its gain or loss of volume is
        /// unbounded.
        Paper = "paper",
        /// [`super::FilteredNormals`], which preserves creases. For CAD parts.
        Feature = "feature",
        /// [`super::FeaturePreserving`], which filters dihedral angles.
        FeatureEdges = "feature-edges",
        /// [`super::Taubin`].
        Taubin = "taubin",
        /// [`super::ImplicitFlow`] (Desbrun).
        Implicit = "implicit",
    }
);

impl Smoother {
    /// Returns true if the method uses [`SmoothOptions::scheme`]. The others have weights of their
    /// own.
    pub fn uses_scheme(self) -> bool {
        matches!(self, Self::Anchored | Self::Paper | Self::Implicit)
    }

    /// The default number of iterations.
    pub fn default_iterations(self) -> usize {
        match self {
            Self::Anchored => 5,
            Self::Curvature | Self::FeatureEdges | Self::Taubin | Self::Paper => 10,
            Self::Feature => 20,
            Self::Implicit => 1,
        }
    }
}

/// The treatment of faces that would point against their neighbours but did not in the original.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum NewFolds {
    /// The vertices of these faces are kept in place. The methods for comparison (Taubin,
    /// implicit, the paper's) ignore this setting and allow new folds.
    #[default]
    Prevent,
    /// New folds are allowed: the plain method.
    Allow,
}

/// The settings of [`super::smooth`].
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct SmoothOptions {
    /// The method.
    pub method: SmoothMethod,
    /// The weights of the methods that use a scheme ([`Smoother::uses_scheme`]). Tutte's weights are
    /// used in their symmetric form.
    pub scheme: SchemeKind,
    /// The number of iterations, or `None` for the default of the method. 0 changes nothing.
    pub iterations: Option<usize>,
    /// s, above 0 and at most 1: the size of a curvature step. For `implicit`, the time step is
    /// s/2 squared mean edge lengths. Other methods ignore it.
    pub step: f64,
    /// μ > 0: the firmness with which each vertex is held in place, relative to the operator,
    /// whose diagonal is about 7. Smaller values smooth more. `None` chooses a value for the
    /// method and the noise.
    pub anchor: Option<f64>,
    /// The treatment of the boundary.
    pub boundary: Boundary,
    /// The treatment of faces that would flip.
    pub folds: NewFolds,
    /// The quantity that is preserved exactly.
    pub preserve: Preserve,
    /// The maximum displacement of any vertex except handles, in the units of the mesh.
    pub max_displacement: Option<f64>,
    /// The memory limit of the factorization in bytes; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(SmoothOptions {
    method: SmoothMethod,
    scheme: SchemeKind,
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
            scheme: SchemeKind::default(),
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
