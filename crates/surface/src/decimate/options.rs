//! The settings of decimation.

use cotan_geometry::{Scalar, Surface};

use super::attributes::DecimateAttributes;
use crate::features::Features;
use crate::tessellation_error::TessellationError;

/// The point at which decimation stops.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum DecimateTarget {
    /// At this number of faces or the next lower one that a collapse gives.
    Faces(usize),
    /// As soon as every further collapse would move a vertex by more than this root mean square
    /// distance from the planes of the triangles merged into it, in the unit of the positions.
    Error(f64),
}

/// The settings of [`super::decimate`].
#[derive(Clone, PartialEq, Debug)]
#[non_exhaustive]
pub struct DecimateOptions {
    /// The point at which to stop.
    pub target: DecimateTarget,
    /// Lines that are kept besides the boundary. Creases need none: their quadrics hold them.
    pub features: Features,
    /// Attributes whose change counts as a cost.
    pub attributes: DecimateAttributes,
}

impl DecimateOptions {
    /// Decimates to a number of faces.
    pub fn to_faces(faces: usize) -> Self {
        Self::to(DecimateTarget::Faces(faces))
    }

    /// Decimates up to an error bound, in the unit of the positions.
    pub fn to_error(error: f64) -> Self {
        Self::to(DecimateTarget::Error(error))
    }

    fn to(target: DecimateTarget) -> Self {
        Self {
            target,
            features: Features::none(),
            attributes: DecimateAttributes::new(),
        }
    }

    /// Sets the lines that are kept.
    #[must_use]
    pub fn features(mut self, features: Features) -> Self {
        self.features = features;
        self
    }

    /// Sets the attributes whose change counts.
    #[must_use]
    pub fn attributes(mut self, attributes: DecimateAttributes) -> Self {
        self.attributes = attributes;
        self
    }
}

/// The two bounds of a run, of which one is always met.
pub(super) struct Stop {
    pub(super) faces: usize,
    /// In the scaled unit.
    pub(super) error: f64,
}

impl DecimateTarget {
    pub(super) fn stop<T: Scalar>(
        self,
        surface: &Surface<'_, T>,
        scale: f64,
    ) -> Result<Stop, TessellationError> {
        match self {
            Self::Faces(faces) => Ok(Stop {
                faces: faces.min(surface.mesh().num_faces()),
                error: f64::INFINITY,
            }),
            Self::Error(error) if error >= 0.0 => Ok(Stop {
                faces: 0,
                error: error * scale,
            }),
            Self::Error(value) => Err(TessellationError::Option {
                option: "the error bound",
                expected: "a number of at least 0",
                value,
            }),
        }
    }
}
