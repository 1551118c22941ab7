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
//! A [`LaplacianScheme`] only chooses weights: it never assembles and never iterates.
//!
//! Source: Au, Tai, Fu, Liu, "Mesh Editing with Curvature Flow Laplacian Operator", 2005.

mod exact;
mod fans;
mod graph;
mod operator;
mod rings;
mod scheme;
mod schemes;

pub use fans::{FanSums, Fans};
pub use graph::{Graph, RowId};
pub use operator::{Operator, apply_weights};
pub use rings::OneRings;
pub use scheme::{Copies, LaplacianScheme, SchemeError, Symmetry};
pub use schemes::{ClampedCotangent, Cotangent, EdgeLength, Tutte, Uniform};

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
