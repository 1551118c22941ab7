//! The geometry image of a mesh: its positions as the colours of a square picture.

use cotan::geometry::Scalar;
use cotan::sphere::{BitDepth, SphereError};

use crate::picture::{Depth, png};
use crate::sphere::{GeometryImageFields, Mapped};

/// The positions over the unfolded octahedron, as a PNG with 16 bits per channel.
///
/// # Errors
/// [`SphereError::Setting`] for an invalid size.
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
