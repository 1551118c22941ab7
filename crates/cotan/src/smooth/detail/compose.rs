//! Combinations of edits.

use cotan_halfedge::VertexMap;

use super::{CurvatureEdit, CurvatureField, check_length};
use crate::error::Error;

/// Both changes at once: H* = a(H) + b(H) − H.
#[derive(Clone, PartialEq, Debug)]
pub struct Sum<A, B>(
    /// One edit.
    pub A,
    /// The other.
    pub B,
);

/// Blends two edits: H* = (1 − m) a(H) + m b(H), with a mask m of one value in 0 … 1 per vertex.
///
/// ```
/// use cotan::prelude::*;
/// use cotan::smooth::{Blend, DetailOptions, ScaledCurvature, edit_detail};
///
/// // Details fade out towards one side.
/// let shape = cotan::shapes::bumpy_plane::<f64>([4.0, 4.0], [24, 24], 0.1);
/// let edit = Blend {
///     mask: shape.positions().map(|p| (0.5 + 0.25 * p.x).clamp(0.0, 1.0)),
///     off: ScaledCurvature::by(1.0),
///     on: ScaledCurvature::by(0.0),
/// };
/// edit_detail(&shape, &Handles::new(), &edit, &DetailOptions::default())?;
/// # Ok::<(), cotan::Error>(())
/// ```
#[derive(Clone, PartialEq, Debug)]
pub struct Blend<A, B> {
    /// The mask m.
    pub mask: VertexMap<f64>,
    /// The edit where m = 0.
    pub off: A,
    /// The edit where m = 1.
    pub on: B,
}

/// Applies one edit after the other: H* = b(a(H)).
#[derive(Clone, PartialEq, Debug)]
pub struct Sequence<A, B>(
    /// The first edit.
    pub A,
    /// The edit that is applied to the result of the first.
    pub B,
);

impl<A: CurvatureEdit, B: CurvatureEdit> CurvatureEdit for Sum<A, B> {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        let (a, b) = (self.0.edit(field), self.1.edit(field));
        let pairs = a.values().zip(b.values()).zip(field.values.values());
        pairs.map(|((a, b), h)| a + (b - h)).collect()
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        self.0.check(num_vertices)?;
        self.1.check(num_vertices)
    }
}

impl<A: CurvatureEdit, B: CurvatureEdit> CurvatureEdit for Blend<A, B> {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        let (off, on) = (self.off.edit(field), self.on.edit(field));
        let pairs = off.values().zip(on.values()).zip(self.mask.values());
        pairs.map(|((a, b), m)| a + m * (b - a)).collect()
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        check_length("the mask", self.mask.len(), num_vertices)?;
        self.off.check(num_vertices)?;
        self.on.check(num_vertices)
    }
}

impl<A: CurvatureEdit, B: CurvatureEdit> CurvatureEdit for Sequence<A, B> {
    fn edit(&self, field: &CurvatureField<'_>) -> VertexMap<f64> {
        self.1.edit(&field.with_values(self.0.edit(field)))
    }

    fn check(&self, num_vertices: usize) -> Result<(), Error> {
        self.0.check(num_vertices)?;
        self.1.check(num_vertices)
    }
}
