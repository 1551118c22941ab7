//! Placement of the unused vertices of a document on the sphere.

use std::collections::BTreeMap;

use cotan::geometry::{Scalar, Surface};
use cotan::halfedge::VertexId;
use cotan_io::{Document, IoError, ProcessingMesh};
use nalgebra::{Point3, Vector3};

use crate::sphere::Mapped;

/// Moves the vertices that no face uses to the unit sphere, and returns their number.
///
/// A vertex at exactly the position of a mapped vertex moves with it. Any other moves in its
/// direction from the centre of the mesh's bounding box; one at the centre moves to +z.
///
/// `source` is the document before anything moved.
pub(crate) fn place_unused<T: Scalar>(
    document: &mut Document,
    source: &[Point3<f64>],
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
) -> Result<usize, IoError> {
    let is_unused = |v: &usize| processing.vertex(*v).is_none();
    let unused: Vec<usize> = (0..source.len()).filter(is_unused).collect();
    if unused.is_empty() {
        return Ok(0);
    }
    let mesh = processing.mesh();
    let mut at_place: BTreeMap<[u64; 3], VertexId> = BTreeMap::new();
    for (v, p) in processing.positions().iter() {
        at_place.entry(place(p)).or_insert(v);
    }
    let surface = Surface::assume_checked(mesh, processing.positions());
    let centre = surface.bounding_box().center();
    for &vertex in &unused {
        let image = match at_place.get(&place(&source[vertex])) {
            Some(&twin) => mapped.map.positions()[twin],
            None => direction(&(source[vertex] - centre)).map(T::of_f64).into(),
        };
        document.set_position(vertex, image.map(T::as_f64))?;
    }
    Ok(unused.len())
}

/// Moves every vertex that is welded to a mapped one exactly to it.
///
/// With a welding tolerance, an edit would have kept their distance, and one of them would be off
/// the sphere.
pub(crate) fn join_welded(
    document: &mut Document,
    processing: &ProcessingMesh,
) -> Result<(), IoError> {
    for vertex in 0..document.positions().len() {
        if let Some(v) = processing.vertex(vertex) {
            let image = document.positions()[processing.document_vertex(v)];
            document.set_position(vertex, image)?;
        }
    }
    Ok(())
}

/// The maximum of | |v| − 1 | over all vertices of a document.
pub(crate) fn sphericity_error(document: &Document) -> f64 {
    let off = |p: &Point3<f64>| (p.coords.norm() - 1.0).abs();
    document.positions().iter().map(off).fold(0.0, f64::max)
}

/// The bits of a position, with both zeros made equal.
fn place(p: &Point3<f64>) -> [u64; 3] {
    [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())
}

/// Normalizes a vector, scaled first so that no square overflows or underflows.
fn direction(v: &Vector3<f64>) -> Vector3<f64> {
    let size = v.amax();
    // A difference of huge numbers may overflow.
    let scaled = match size.is_infinite() {
        true => v.map(|x| if x.is_infinite() { x.signum() } else { 0.0 }),
        false => v / size.max(f64::MIN_POSITIVE),
    };
    scaled.try_normalize(0.0).unwrap_or_else(Vector3::z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_of_any_length_have_length_one() {
        let all = [1.0, 1e300, 1e-300, 5e-324, f64::INFINITY];
        for size in all {
            let unit = direction(&Vector3::new(size, -size, 0.0));
            assert!((unit.norm() - 1.0).abs() < 1e-15, "{size:e}");
            assert!(unit.x > 0.7 && unit.y < -0.7);
        }
        assert_eq!(direction(&Vector3::zeros()), Vector3::z());
    }
}
