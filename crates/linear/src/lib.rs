//! Sparse least-squares systems with handles: prepared once, solved often.
//!
//! The paper's core system (equation 3) asks for the positions x that minimise
//!
//! ```text
//! |L x − ℓ|² + Σ_h k_h² |x_h − u_h|²  (+ μ · a membrane term, for energies that have one)
//! ```
//!
//! with L the operator of the original mesh, ℓ the wanted Laplacian coordinates and u_h the handle
//! targets. A [`PreparedSystem`] owns its factorization: the analysis and the numbers are done
//! once, each solve takes three right-hand sides and allocates nothing.
//!
//! It solves for the *correction* of a given shape and not for positions: the right-hand side is
//! the amount by which the shape misses each term. A shape that fulfils them all is then left
//! alone exactly, a mesh far from the origin loses no digit, and every solve refines the one
//! before.
//!
//! There are two direct ways to the solution, and [`Strategy::Auto`] takes the one that is
//! predicted to be the faster:
//!
//! - the **normal equations** LᵀL + μK + D of the free vertices ([`Strategy::Normal`]), for every
//!   operator and any number of handles;
//! - **columns** of the inverse, one per handle, from factors of the one-ring matrix
//!   ([`Strategy::Columns`]): factorized once for every set of handles.
//!
//! Handles can be exchanged ([`PreparedSystem::set_handles`]) and weights renewed
//! ([`PreparedSystem::refactor`]) without starting over.
//!
//! Equations that are met exactly and not in the sense of least squares are solved by
//! [`LinearSystem`]: harmonic fields, Poisson's equation, implicit steps of diffusion.
//!
//! The factorization is that of `cotan-sparse`, always in `f64`: the condition number of the
//! system is the square of the Laplacian's, and `f32` fails silently from some ten thousand
//! vertices on.
//!
//! | modules | content |
//! |---|---|
//! | `system`, `linear_system` | the public solvers |
//! | `handles`, `defect`, `problem` | handles, the right-hand side, the membrane |
//! | `weights`, `components` | symmetry of the weights; connected components |
//! | `strategy`, `cost`, `storage` | the choice of a method, its predicted cost, memory limits |
//! | `normal`, `stretched` | the normal equations, and rows of vertices of high valence |
//! | `columns`, `column_store`, `multipliers` | columns of the inverse |
//! | `pseudo_inverse`, `one_ring` | the inverse, by factors of one-ring matrices |
//! | `error` | the errors |

mod bilaplacian;
mod column_store;
mod columns;
mod components;
mod cost;
mod defect;
mod error;
mod handles;
mod linear_system;
mod multipliers;
mod normal;
mod one_ring;
mod plan;
mod problem;
mod pseudo_inverse;
mod storage;
mod strategy;
mod stretched;
mod system;
mod ties;
mod weights;

pub use bilaplacian::{Bilaplacian, BilaplacianSystem};
pub use cotan_sparse::{Precision, SparseError};
pub use defect::Defect;
pub use error::LinearError;
pub use handles::{Handle, Hold};
pub use linear_system::LinearSystem;
pub use problem::Membrane;
pub use strategy::{Choice, Method, Reason, Strategy, SystemOptions};
pub use system::PreparedSystem;
pub use ties::Tie;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
