//! The facets of a mesh made of another's, with the source of each corner and normal.
//!
//! Both forms are copied rather than written anew, which would lose the title and the bytes after
//! the last facet of a binary file, and the solids and digits of a text.

use nalgebra::{Point3, Vector3};

use crate::attributes::NONE;
use crate::error::IoError;
use crate::remap::Remap;
use crate::source::Mesh;

/// A facet of the new mesh.
pub(super) struct Facet {
    /// The old facet whose normal and attributes it has; `None` if it closes a hole.
    pub(super) source: Option<u32>,
    /// The source facet or, for one that closes a hole, an adjacent old facet.
    pub(super) neighbour: u32,
    /// `true` if its corners have the opposite order to those of its source.
    pub(super) is_turned: bool,
    pub(super) corners: [Corner; 3],
}

/// A corner of the new mesh.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    /// The old vertex.
    pub(super) vertex: u32,
    /// The old corner, counted through all faces, with this vertex; `None` if the source of the
    /// new corner had another vertex.
    pub(super) old: Option<u32>,
}

impl Facet {
    /// Builds face `face` of the new mesh; `mesh` is the old one, of triangles.
    pub(super) fn new(remap: &Remap, mesh: Mesh<'_>, face: usize) -> Result<Self, IoError> {
        let polygon = remap.faces.get(face).unwrap_or(&[]);
        let &[a, b, c] = polygon else {
            return Err(IoError::Unsupported {
                feature: format!("a face of {} corners in an STL", polygon.len()),
                remedy: "cut it into triangles, or convert the file to another format first",
            });
        };
        let source = remap.face_sources.get(face).copied();
        let source = source.filter(|&source| source != NONE);
        let start = remap.faces.corner_range(face).start;
        let old_corners = mesh.faces.corners();
        let mut from = [0u32; 3];
        let corners = [(0, a), (1, b), (2, c)].map(|(k, v)| {
            let vertex = remap.vertices.get(v as usize).copied().unwrap_or(0);
            let old = remap.corner_sources.get(start + k).copied().unwrap_or(0);
            from[k] = old;
            let old = (old_corners.get(old as usize) == Some(&vertex)).then_some(old);
            Corner { vertex, old }
        });
        let is_turned = source.is_some() && (from[1] % 3 + 3 - from[0] % 3) % 3 == 2;
        Ok(Self {
            source,
            neighbour: source.unwrap_or(from[0] / 3),
            is_turned,
            corners,
        })
    }

    /// The positions of its corners in the old mesh.
    pub(super) fn positions(&self, mesh: Mesh<'_>) -> [Point3<f64>; 3] {
        self.corners
            .map(|corner| mesh.positions[corner.vertex as usize])
    }
}

/// The unit normal of a triangle, or zero.
pub(super) fn normal([a, b, c]: &[Point3<f64>; 3]) -> [f64; 3] {
    // Edges scaled to unit size neither overflow nor underflow in the product.
    let (u, v) = (b - a, c - a);
    let scale = u.amax().max(v.amax());
    if !(scale > 0.0 && scale.is_finite()) {
        return [0.0; 3];
    }
    let normal: Vector3<f64> = (u / scale).cross(&(v / scale));
    // Adding zero makes a negative zero positive.
    let unit = normal.try_normalize(0.0).unwrap_or_default();
    unit.map(|x| x + 0.0).into()
}
