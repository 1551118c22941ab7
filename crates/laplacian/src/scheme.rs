//! The trait that chooses weights.

use std::sync::Arc;

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, VertexId, VertexMap};
use nalgebra::Vector3;
use thiserror::Error;

use crate::fans::{FanSums, Fans};
use crate::operator::apply_weights;

/// Whether w_ij = w_ji for every edge, which decides what factorization can serve.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Symmetry {
    /// w_ij = w_ji for every edge.
    Symmetric,
    /// The two directions of an edge may differ (row-normalised schemes).
    General,
}

/// Why weights could not be chosen.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum SchemeError {
    /// A weight that is NaN or infinite.
    #[error("the {scheme} weight of the edge from vertex {} to vertex {} is not a finite number; look for vertices that coincide", vertices[0], vertices[1])]
    NonFiniteWeight {
        /// Name of the scheme.
        scheme: String,
        /// Origin and target of the halfedge.
        vertices: [VertexId; 2],
    },
    /// A scheme that this surface cannot be weighted by, in the scheme's own words.
    #[error("the {scheme} scheme cannot weight this mesh: {reason}")]
    Unsuitable {
        /// Name of the scheme.
        scheme: String,
        /// What is wrong and what to do.
        reason: String,
    },
}

/// Chooses the weights w_ij of ℓ_i = Σ_j w_ij (v_j − v_i): what of a shape counts as its
/// *parameterization* (paper, section 3.1).
///
/// The trait is dyn-compatible and forwarded through `&S`, `&mut S`, `Box<S>` and `Arc<S>`.
///
/// ```
/// use cotan_geometry::{Scalar, Surface, scalar};
/// use cotan_halfedge::HalfedgeMap;
/// use cotan_laplacian::{LaplacianScheme, SchemeError, Symmetry};
///
/// /// Weighs an edge by its inverse squared length.
/// struct InverseSquare;
///
/// impl<T: Scalar> LaplacianScheme<T> for InverseSquare {
///     fn weights(
///         &self,
///         surface: &Surface<'_, T>,
///         out: &mut HalfedgeMap<T>,
///     ) -> Result<(), SchemeError> {
///         for h in surface.mesh().halfedges() {
///             out[h] = scalar::<T>(1.0) / surface.halfedge_vector(h).norm_squared();
///         }
///         Ok(())
///     }
///
///     fn symmetry(&self) -> Symmetry {
///         Symmetry::Symmetric
///     }
/// }
/// ```
pub trait LaplacianScheme<T: Scalar>: Send + Sync {
    /// Writes the weight w_ij of every halfedge i→j.
    ///
    /// **Shapes**: `out` has one entry a halfedge; all of them are overwritten.
    ///
    /// # Errors
    /// [`SchemeError`] if the surface cannot be weighted. Weights that are not finite need not be
    /// reported here: [`crate::Operator::assemble`] finds them.
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError>;

    /// Whether w_ij = w_ji for every edge.
    fn symmetry(&self) -> Symmetry;

    /// Measures a surface with its own weights: ℓ_i = Σ_j w_ij (v_j − v_i), and the sums of areas
    /// around every vertex. `weights` is room that may be used.
    ///
    /// Provided: it asks for the weights and applies them. A scheme whose sums can be taken
    /// without writing the weights down, as those of [`crate::Cotangent`] can, may do so.
    ///
    /// **Shapes**: `laplacian` has one entry per vertex; all entries are overwritten.
    ///
    /// # Errors
    /// As [`Self::weights`].
    fn measure(
        &self,
        surface: &Surface<'_, T>,
        fans: &Fans,
        weights: &mut HalfedgeMap<T>,
        laplacian: &mut VertexMap<Vector3<T>>,
        sums: &mut FanSums<T>,
    ) -> Result<(), SchemeError> {
        let num_halfedges = surface.mesh().num_halfedges();
        if weights.len() != num_halfedges {
            *weights = HalfedgeMap::filled(num_halfedges, T::zero());
        }
        self.weights(surface, weights)?;
        apply_weights(fans.rings(), weights, surface.positions(), laplacian);
        fans.areas(surface.positions(), sums);
        Ok(())
    }

    /// A name for messages.
    fn name(&self) -> &str {
        "custom"
    }
}

macro_rules! forward {
    ($pointer:ty) => {
        impl<T: Scalar, S: LaplacianScheme<T> + ?Sized> LaplacianScheme<T> for $pointer {
            fn weights(
                &self,
                surface: &Surface<'_, T>,
                out: &mut HalfedgeMap<T>,
            ) -> Result<(), SchemeError> {
                (**self).weights(surface, out)
            }

            fn symmetry(&self) -> Symmetry {
                (**self).symmetry()
            }

            fn measure(
                &self,
                surface: &Surface<'_, T>,
                fans: &Fans,
                weights: &mut HalfedgeMap<T>,
                laplacian: &mut VertexMap<Vector3<T>>,
                sums: &mut FanSums<T>,
            ) -> Result<(), SchemeError> {
                (**self).measure(surface, fans, weights, laplacian, sums)
            }

            fn name(&self) -> &str {
                (**self).name()
            }
        }
    };
}

forward!(&S);
forward!(&mut S);
forward!(Box<S>);
forward!(Arc<S>);
