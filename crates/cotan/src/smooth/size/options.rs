//! The settings of smoothing by size as plain values.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_linear::Strategy;

use crate::error::Error;
use crate::named::setters;
use crate::smooth::anchored::Boundary;
use crate::smooth::options::NewFolds;
use crate::smooth::preserve::Preserve;
use crate::smooth::run::refuse;

/// s, the width of a bump: half of its wavelength. Narrower bumps are removed.
#[derive(Clone, PartialEq, Debug)]
pub enum BumpSize {
    /// A share of the longest side of the bounding box: 0.02 is 2 %.
    Share(f64),
    /// A length, in the units of the mesh.
    Length(f64),
    /// A length for each vertex. It should vary little within a distance of itself.
    PerVertex(VertexMap<f64>),
}

impl BumpSize {
    /// The default: 2 % of the longest side.
    pub const DEFAULT: Self = Self::Share(0.02);

    /// The size of each of `n` vertices in box units.
    pub(super) fn in_box<T: Scalar>(&self, n: usize, longest: T) -> Result<Vec<f64>, Error> {
        let longest = longest.as_f64();
        let check = |size: f64| match size.is_finite() && size >= 0.0 {
            true => Ok(size),
            false => Err(refuse("size", "a finite number of at least 0", size)),
        };
        match self {
            Self::Share(share) => Ok(vec![check(*share)?; n]),
            Self::Length(length) => Ok(vec![check(*length)? / longest; n]),
            Self::PerVertex(lengths) if lengths.len() == n => {
                lengths.values().map(|l| Ok(check(*l)? / longest)).collect()
            }
            Self::PerVertex(lengths) => Err(Error::FieldLength {
                what: "the field of sizes",
                len: lengths.len(),
                num_vertices: n,
            }),
        }
    }
}

impl Default for BumpSize {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The settings of [`super::SmoothBySize`].
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[non_exhaustive]
pub struct BySizeOptions {
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
    /// The strategy of the linear system; see [`cotan_linear::BilaplacianSystem`].
    pub strategy: Strategy,
}

setters!(BySizeOptions {
    boundary: Boundary,
    folds: NewFolds,
    preserve: Preserve,
    max_displacement: impl Into<Option<f64>>,
    max_memory: impl Into<Option<u64>>,
    strategy: Strategy,
});
