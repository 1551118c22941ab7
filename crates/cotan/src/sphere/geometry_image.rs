//! Geometry images: a shape, or an attribute, as a square grid of values over the unfolded
//! octahedron.
//!
//! Pixel (i, j) of an n × n grid represents the point (s, t) = (2i/(n−1) − 1, 2j/(n−1) − 1) of
//! the square onto which the octahedron |x| + |y| + |z| = 1 is unfolded: z = 1 − |s| − |t|, and
//! (x, y) = (s, t) where z ≥ 0 (the upper half, which is the inner diamond). The four lower faces
//! are folded out to the corners. The lower pole is at all four corners of the square, and each
//! side is an edge of the octahedron folded in the middle, so its pixels are mirror-symmetric
//! about the middle.
//!
//! **Source**: Praun and Hoppe 2003, section 3 (the octahedron and its boundary rules).

use cotan_geometry::{BoundingBox, Scalar};
use cotan_halfedge::VertexMap;
use cotan_parallel::Chunks;
use nalgebra::{Point3, Vector3};

use super::error::SphereError;
use super::interpolate::Attribute;
use super::locate::PointLocation;
use super::map::SphereMap;

/// A grid of values, row by row.
#[derive(Clone, PartialEq, Debug)]
pub struct GeometryImage<A> {
    /// The number of pixels per row, which is odd.
    pub width: usize,
    /// The number of rows, equal to `width`.
    pub height: usize,
    /// The value of pixel (i, j), column i of row j, at `j * width + i`.
    pub values: Vec<A>,
}

/// The bytes of an RGB image, and the range they represent.
#[derive(Clone, PartialEq, Debug)]
pub struct EncodedImage<T: Scalar> {
    /// The number of pixels per row.
    pub width: usize,
    /// The number of rows.
    pub height: usize,
    /// The number of bits per colour channel.
    pub depth: BitDepth,
    /// Red, green and blue of each pixel, row by row. With 16 bits, the high byte comes first, as
    /// in a PNG.
    pub bytes: Vec<u8>,
    /// The box spanned by the colours: for each axis 0 is `min` and the largest value is `max`.
    pub bounds: BoundingBox<T>,
}

/// Bits per colour channel.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum BitDepth {
    /// 0 … 255.
    Eight,
    /// 0 … 65535.
    Sixteen,
}

impl<T: Scalar> SphereMap<T> {
    /// Computes the geometry image of an attribute, such as the positions of the source mesh.
    ///
    /// **Shapes**: one value per vertex as input, `size`² values as output.
    ///
    /// # Errors
    /// [`SphereError::Setting`] if `size` is not an odd number in 3 … 4097 (odd, so that the
    /// vertices of the octahedron are pixels and the borders match); [`SphereError::Mismatch`] if
    /// there is not one value per vertex.
    pub fn geometry_image<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        size: usize,
    ) -> Result<GeometryImage<A>, SphereError> {
        if !(3..=MAX_SIZE).contains(&size) || size.is_multiple_of(2) {
            return Err(SphereError::Setting {
                setting: "size of the geometry image",
                range: "odd and 3 to 4097",
                value: size as f64,
            });
        }
        self.check_attribute(attribute)?;
        Ok(self.point_location().tabulate(attribute, size))
    }
}

impl<T: Scalar> PointLocation<'_, T> {
    /// The geometry image of an attribute with one value per vertex; `size` is odd.
    pub(crate) fn tabulate<A: Attribute<T>>(
        &self,
        attribute: &VertexMap<A>,
        size: usize,
    ) -> GeometryImage<A> {
        let value = |pixel: usize| {
            let direction = octahedral_direction(pixel % size, pixel / size, size);
            self.map().blend(attribute, &self.locate_unit(&direction))
        };
        GeometryImage {
            width: size,
            height: size,
            values: Chunks::of(256).filled(size * size, value),
        }
    }
}

impl<T: Scalar> GeometryImage<Point3<T>> {
    /// Encodes the positions as colours: each coordinate relative to the extent of the image's
    /// bounding box, rounded to the nearest value, and 0 along an axis without extent.
    ///
    /// Non-finite coordinates become 0.
    #[must_use]
    pub fn encode(&self, depth: BitDepth) -> EncodedImage<T> {
        let origin = BoundingBox {
            min: Point3::origin(),
            max: Point3::origin(),
        };
        let bounds = BoundingBox::of(&self.values).unwrap_or(origin);
        let (low, extents) = (bounds.min, bounds.extents());
        let mut bytes = Vec::with_capacity(6 * self.values.len());
        for p in &self.values {
            for k in 0..3 {
                let share = (p[k] - low[k]).as_f64() / extents[k].as_f64();
                // Casts saturate for NaN and values out of range.
                match depth {
                    BitDepth::Eight => bytes.push((share * 255.0).round() as u8),
                    BitDepth::Sixteen => {
                        bytes.extend(((share * 65535.0).round() as u16).to_be_bytes());
                    }
                }
            }
        }
        EncodedImage {
            width: self.width,
            height: self.height,
            depth,
            bytes,
            bounds,
        }
    }
}

/// The unit direction of pixel (i, j) of a `size` × `size` geometry image; `size` is odd.
///
/// Folding uses integers, so mirrored pixels of a side have exactly the same direction.
pub(crate) fn octahedral_direction(i: usize, j: usize, size: usize) -> Vector3<f64> {
    let m = (size / 2) as i64;
    let (s, t) = (i as i64 - m, j as i64 - m);
    let z = m - s.abs() - t.abs();
    let sign = |x: i64| if x < 0 { -1 } else { 1 };
    let (x, y) = match z < 0 {
        true => (sign(s) * (m - t.abs()), sign(t) * (m - s.abs())),
        false => (s, t),
    };
    Vector3::new(x as f64, y as f64, z as f64).normalize()
}

/// The pixel of a `size` × `size` geometry image nearest to a direction.
pub(crate) fn nearest_pixel(d: &Vector3<f64>, size: usize) -> usize {
    let on_octahedron = d / d.lp_norm(1);
    let (x, y) = (on_octahedron.x, on_octahedron.y);
    let (s, t) = match on_octahedron.z < 0.0 {
        true => ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)),
        false => (x, y),
    };
    let m = (size / 2) as f64;
    let index = |s: f64| ((s * m + m).round() as usize).min(size - 1);
    index(t) * size + index(s)
}

/// Gives 16.8 million pixels.
const MAX_SIZE: usize = 4097;

#[cfg(test)]
mod tests {
    use cotan_geometry::icosphere;
    use cotan_geometry::testing::directions;
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn sides_match_their_mirror_images_and_corners_are_one_point() {
        for n in [3, 5, 9, 33] {
            let at = |i, j| octahedral_direction(i, j, n);
            for k in 0..n {
                assert_eq!(at(k, 0), at(n - 1 - k, 0));
                assert_eq!(at(k, n - 1), at(n - 1 - k, n - 1));
                assert_eq!(at(0, k), at(0, n - 1 - k));
                assert_eq!(at(n - 1, k), at(n - 1, n - 1 - k));
            }
            assert_eq!(at(n / 2, n / 2), Vector3::z());
            assert_eq!(at(0, 0), -Vector3::z());
            assert_eq!(at(n - 1, n / 2), Vector3::x());
            assert_eq!(at(n / 2, 0), -Vector3::y());
        }
    }

    proptest! {
        #[test]
        fn a_pixel_is_the_nearest_to_its_direction(i in 0..33_usize, j in 0..33_usize, d in directions()) {
            let own = octahedral_direction(i, j, 33);
            let again = nearest_pixel(&own, 33);
            // On a side it may be the mirror image.
            prop_assert!((octahedral_direction(again % 33, again / 33, 33) - own).norm() < 1e-14);
            let near = nearest_pixel(&d, 33);
            let step = (octahedral_direction(near % 33, near / 33, 33) - d).norm();
            prop_assert!(step < 0.15, "{}", step);
        }
    }

    #[test]
    fn the_image_of_a_sphere_holds_its_directions() {
        let shape = icosphere::<f64>(5);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        let image = map.geometry_image(shape.positions(), 17).unwrap();
        assert_eq!(
            (image.width, image.height, image.values.len()),
            (17, 17, 289)
        );
        for (pixel, p) in image.values.iter().enumerate() {
            let d = octahedral_direction(pixel % 17, pixel / 17, 17);
            assert!((p.coords.normalize() - d).norm() < 1e-14);
            assert!(p.coords.norm() > 0.999);
        }
    }

    #[test]
    fn colours_span_the_box() {
        let image = GeometryImage {
            width: 3,
            height: 1,
            values: vec![
                Point3::new(-1.0_f32, 0.0, 5.0),
                Point3::new(0.0, 1.0, 5.0),
                Point3::new(1.0, 4.0, 5.0),
            ],
        };
        let eight = image.encode(BitDepth::Eight);
        assert_eq!(eight.bytes, [0, 0, 0, 128, 64, 0, 255, 255, 0]);
        let sixteen = image.encode(BitDepth::Sixteen);
        assert_eq!(sixteen.bytes[6..10], [0x80, 0x00, 0x40, 0x00]);
        assert_eq!(sixteen.bounds.max, Point3::new(1.0, 4.0, 5.0));
    }

    #[test]
    fn even_and_tiny_sizes_are_refused() {
        let shape = icosphere::<f64>(1);
        let map = SphereMap::new(shape.connectivity(), shape.positions().clone()).unwrap();
        for size in [0, 1, 2, 64, 4099] {
            let refused = map.geometry_image(shape.positions(), size);
            assert!(matches!(refused, Err(SphereError::Setting { .. })));
        }
    }
}
