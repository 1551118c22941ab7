//! The trait for Laplacian weights.
//!
//! A scheme may apply its operator without assembling it, by default through [`Operator`], which
//! in turn is assembled from a scheme: the two modules are one concept.

use std::sync::Arc;

use cotan_geometry::{Scalar, Surface};
use cotan_halfedge::{HalfedgeMap, VertexId, VertexMap};
use nalgebra::Vector3;
use thiserror::Error;

use crate::fans::{FanSums, Fans};
use crate::operator::{Operator, apply_weights};
use crate::rings::OneRings;

/// Symmetry of the weights, which decides which factorizations can be used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Symmetry {
    /// w_ij = w_ji for every edge.
    Symmetric,
    /// The two directions of an edge may have different weights (row-normalized schemes).
    General,
}

/// The combination of the weights of one edge where a mesh was cut into pieces and several edges
/// of the pieces join the same two rows ([`cotan_halfedge::HalfedgeMesh::row_of`]).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Copies {
    /// The weights are sums over the faces at an edge and are added up, as cotangents are.
    Sum,
    /// The weights do not depend on the faces and are averaged.
    Mean,
    /// The scheme cannot weight such a mesh.
    Refused,
}

/// Reasons why weights could not be computed.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[non_exhaustive]
pub enum SchemeError {
    /// A weight is NaN or infinite.
    #[error("the {scheme} weight of the edge from vertex {} to vertex {} is not a finite number; look for vertices that coincide", vertices[0], vertices[1])]
    NonFiniteWeight {
        /// The name of the scheme.
        scheme: String,
        /// Origin and target of the halfedge.
        vertices: [VertexId; 2],
    },
    /// The mesh has copies of vertices, and the scheme has no weights for them.
    #[error(
        "the {scheme} scheme cannot weight a mesh with non-manifold edges, bow-ties or one-sided parts; repair the mesh, or use the cotangent scheme"
    )]
    Copies {
        /// The name of the scheme.
        scheme: String,
    },
    /// The scheme cannot handle this surface, for a reason that the scheme gives.
    #[error("the {scheme} scheme cannot weight this mesh: {reason}")]
    Unsuitable {
        /// The name of the scheme.
        scheme: String,
        /// The problem and its remedy.
        reason: String,
    },
}

/// A choice of the weights w_ij in ℓ_i = Σ_j w_ij (v_j − v_i), which defines the part of a shape
/// that counts as its *parameterization* (paper, section 3.1).
///
/// The trait is dyn-compatible and implemented for `&S`, `&mut S`, `Box<S>` and `Arc<S>`.
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
    /// Computes the weight w_ij of each halfedge i→j.
    ///
    /// **Shapes**: `out` has one entry per halfedge; all of them are overwritten.
    ///
    /// # Errors
    /// [`SchemeError`] if no weights can be computed for the surface. Non-finite weights need not
    /// be reported here: [`crate::Operator::assemble`] detects them.
    fn weights(
        &self,
        surface: &Surface<'_, T>,
        out: &mut HalfedgeMap<T>,
    ) -> Result<(), SchemeError>;

    /// States whether w_ij = w_ji for every edge.
    fn symmetry(&self) -> Symmetry;

    /// States how the weights of an edge combine where the mesh was cut into pieces. The weights
    /// of each piece are computed as if it were alone.
    fn copies(&self) -> Copies {
        Copies::Refused
    }

    /// Measures a surface with the weights that it has itself: ℓ_i = Σ_j w_ij (v_j − v_i) and the
    /// area sums around each vertex. `weights` is scratch space.
    ///
    /// The default implementation computes the weights and applies them. Override it for a scheme
    /// whose sums can be computed without storing the weights, such as [`crate::Cotangent`].
    ///
    /// **Shapes**: `laplacian` has one entry per row, which is a vertex unless vertices have
    /// copies; all entries are overwritten.
    ///
    /// # Errors
    /// Same as [`Self::weights`].
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
        apply_weights(fans.rings(), self, weights, surface.positions(), laplacian)?;
        fans.areas(surface.positions(), sums);
        Ok(())
    }

    /// Assembles the operator: by default on the one-rings of the mesh, which are given, with
    /// [`Self::weights`].
    ///
    /// Override it for a scheme whose operator has another graph, such as
    /// [`crate::IntrinsicDelaunay`]. A row is a vertex in any case.
    ///
    /// # Errors
    /// As [`Self::weights`], and [`SchemeError::NonFiniteWeight`].
    fn operator(
        &self,
        rings: &OneRings,
        surface: &Surface<'_, T>,
    ) -> Result<Operator<T>, SchemeError> {
        Operator::assemble_on(rings, self, surface)
    }

    /// The name used in messages.
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

            fn copies(&self) -> Copies {
                (**self).copies()
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

            fn operator(
                &self,
                rings: &OneRings,
                surface: &Surface<'_, T>,
            ) -> Result<Operator<T>, SchemeError> {
                (**self).operator(rings, surface)
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
