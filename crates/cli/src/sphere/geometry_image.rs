//! The geometry image of a mesh: its positions as the colours of a square picture.

use cotan::geometry::Scalar;
use cotan::sphere::{BitDepth, SphereError};
use serde::Serialize;

use super::Mapped;
use crate::picture::{Depth, png};

/// What the colours of a geometry image stand for.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct GeometryImageFields {
    /// Pixels of a side.
    size: usize,
    /// Where the least and the largest number of red, green and blue are, in the unit of the file.
    min: [f64; 3],
    max: [f64; 3],
}

/// The positions over the unfolded octahedron, as a PNG of 16 bits a colour.
///
/// # Errors
/// [`SphereError::Setting`] for a size that does not do.
pub(crate) fn geometry_image<T: Scalar>(
    mapped: &Mapped<T>,
    size: usize,
) -> Result<(Vec<u8>, GeometryImageFields), SphereError> {
    let image = mapped.map.geometry_image(&mapped.positions, size)?;
    let encoded = image.encode(BitDepth::Sixteen);
    let corner = |p: nalgebra::Point3<T>| mapped.point_in_file(p).into();
    let fields = GeometryImageFields {
        size,
        min: corner(encoded.bounds.min),
        max: corner(encoded.bounds.max),
    };
    let pixels = [encoded.width, encoded.height];
    Ok((png(pixels, Depth::Sixteen, &encoded.bytes), fields))
}
