//! Smoothing without shrinking.
//!
//! The geometry of a mesh is described by a scalar field, the mean curvature, which can be
//! filtered and put back. This is the second use of the generic [`cotan_flow::Flow`], next to
//! deformation. All methods except the two for comparison share the *anchored* system
//!
//! ```text
//! (LᵀL + μ² I) x = Lᵀ ℓ + μ² x⁰
//! ```
//!
//! factorized once: each vertex is held weakly at its original position, and ℓ is rebuilt from
//! the current surface in each step. The methods differ in the source of ℓ: the mean curvature of
//! the vertices ([`SmoothedCurvature`]), the dihedral angles of the edges
//! ([`FeaturePreserving`]), or the normals of the faces ([`FilteredNormals`]).
//!
//! Source: paper, section 4.2. With only one pinned vertex, as in the paper, the gain or loss of
//! volume is unbounded, so every vertex is anchored here.

mod anchored;
mod curvature;
mod decide;
mod detail;
mod exact;
mod feature;
mod filtered_normals;
mod implicit;
mod interior;
mod mask;
mod measure;
mod methods;
mod mollified;
mod noise;
mod normal_filter;
mod options;
mod parallel;
mod preserve;
mod run;
mod size;
mod taubin;
mod unfold;

pub use anchored::Boundary;
pub use curvature::{AlongCurvature, Direction, Order, SmoothedCurvature};
pub use decide::Decision;
pub(crate) use detail::wanted_field;
pub use detail::{
    BandPass, Blend, CurvatureEdit, CurvatureField, CurvatureUpdater, DetailOptions, Detailed,
    ScaledCurvature, Sequence, Sum, TargetCurvature, TransferredCurvature, edit_detail,
    edit_detail_masked, edit_detail_observed,
};
pub use feature::FeaturePreserving;
pub use filtered_normals::FilteredNormals;
pub use implicit::ImplicitFlow;
pub use interior::{InteriorCotangent, InteriorRows, InteriorUmbrella};
pub use mask::Mask;
pub(crate) use measure::mollified_curvature_field;
pub use measure::{Displacement, NormalError, curvature_field, mean_curvature_rms};
pub use mollified::MollifiedCotangent;
pub use noise::{GaussianNoise, NoiseEstimate, with_normal_noise};
pub use normal_filter::NormalFilter;
pub use options::{NewFolds, SmoothMethod, SmoothOptions, Smoother};
pub(crate) use preserve::Correction;
pub use preserve::Preserve;
pub use run::{Smoothed, smooth, smooth_masked, smooth_observed};
pub(crate) use run::{check_bound, refuse};
pub use size::{BumpSize, BySizeOptions, SmoothBySize, SmoothedBySize, smooth_by_size};
pub(crate) use size::{RestSurface, boundary as rows_without_curvature};
pub use taubin::Taubin;
