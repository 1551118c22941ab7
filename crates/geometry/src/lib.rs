//! (being written)

mod scalar;
mod surface;

pub use scalar::{Scalar, scalar};
pub use surface::{Positions, Surface, SurfaceError};
