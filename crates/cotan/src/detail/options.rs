//! The settings of the transfer of details.

use crate::named::setters;
use crate::smooth::{Boundary, Mask, Preserve};

/// The border between shape and detail: of a wave of this length a quarter is detail, of one half
/// as long 0.89, of one twice as long 0.003.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum Wavelength {
    /// A share of the square root of the surface's area, which makes shapes of different size
    /// comparable and does not depend on their pose.
    Share(f64),
    /// A length, in the units of the mesh.
    Length(f64),
}

impl Default for Wavelength {
    fn default() -> Self {
        Self::Share(0.3)
    }
}

/// The settings of [`super::BaseSurface`].
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[non_exhaustive]
pub struct BaseOptions {
    /// The border between shape and detail.
    pub wavelength: Wavelength,
    /// The memory limit of the factorization in bytes; see [`cotan_linear::SystemOptions`].
    pub max_memory: Option<u64>,
}

setters!(BaseOptions {
    wavelength: Wavelength,
    max_memory: impl Into<Option<u64>>,
});

/// The settings of [`super::Detail::apply`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct ApplyOptions {
    /// The factor of the heights. 0 changes nothing, −1 turns bumps into dents.
    pub scale: f64,
    /// The part of the target that may move; everything without one.
    pub mask: Option<Mask>,
    /// The treatment of the boundary. If it is fixed, details fade out towards it.
    pub boundary: Boundary,
    /// The quantity that is preserved exactly.
    pub preserve: Preserve,
    /// The maximum displacement of any vertex, in the units of the mesh.
    pub max_displacement: Option<f64>,
}

impl Default for ApplyOptions {
    fn default() -> Self {
        Self {
            scale: 1.0,
            mask: None,
            boundary: Boundary::default(),
            preserve: Preserve::default(),
            max_displacement: None,
        }
    }
}

setters!(ApplyOptions {
    scale: f64,
    mask: impl Into<Option<Mask>>,
    boundary: Boundary,
    preserve: Preserve,
    max_displacement: impl Into<Option<f64>>,
});
