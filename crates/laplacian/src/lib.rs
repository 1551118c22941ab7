//! Laplacian schemes and the operator assembled from them.
//!
//! **The Laplacian convention** of the whole workspace is the paper's (section 2.1, equations 1
//! and 6):
//!
//! ```text
//! ℓ_i = Σ_j w_ij (v_j − v_i)        w_ij = cot α_ij + cot β_ij   (no ½)
//! ```
//!
//! so that ℓ_i = 4 A_i κ_i n_i, where A_i is the sum of the areas of the triangles around i and
//! n_i the outward normal; κ_i is negative where the surface is convex. [`Operator::apply`]
//! evaluates ℓ. [`Operator::matrix`] is the *negative* of that operator, which is positive
//! semi-definite for the cotangent scheme.
//!
//! # The usual ½
//!
//! Other texts and libraries write the stiffness matrix K = ∫ ∇φ_i · ∇φ_j with ½ (cot α + cot β).
//! In their terms, with lumped masses M ([`lumped_masses`]):
//!
//! ```text
//! K = Operator::stiffness_matrix() = ½ Operator::matrix()        ℓ(u) = −2 K u = 2 div ∇u
//! pointwise Laplacian   Δu = −M⁻¹ K u = ½ M⁻¹ ℓ(u)
//! Poisson    −Δu = f          K u = M f             Operator::matrix() u = 2 M f
//! heat       (M + t K) u = M u₀                     (2 M / t + Operator::matrix()) u = 2 M u₀ / t
//! ```
//!
//! A [`LaplacianScheme`] only chooses weights: it never assembles and never iterates.
//!
//! Source: Au, Tai, Fu, Liu, "Mesh Editing with Curvature Flow Laplacian Operator", 2005.

mod differential;
mod exact;
mod fans;
mod graph;
mod intrinsic;
mod intrinsic_scheme;
mod masses;
mod operator;
mod reweighted;
mod rings;
mod scheme;
mod schemes;

pub use differential::{divergence, divergence_matrix, gradient, gradient_matrix, hat_gradients};
pub use fans::{FanSums, Fans};
pub use graph::{Graph, RowId};
pub use intrinsic::{IntrinsicTriangle, IntrinsicTriangulation, MOLLIFICATION};
pub use intrinsic_scheme::IntrinsicDelaunay;
pub use masses::{
    Lumping, apply_consistent_mass, consistent_mass_matrix, diagonal_matrix, lumped_masses,
};
pub use operator::{Operator, apply_weights};
pub use rings::OneRings;
pub use scheme::{Copies, LaplacianScheme, SchemeError, Symmetry};
pub use schemes::{ClampedCotangent, Cotangent, EdgeLength, Tutte, Uniform};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
