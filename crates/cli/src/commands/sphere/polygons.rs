//! Polygons on a sphere that every reader of the file cuts without a flip.
//!
//! A map is checked on the triangles that the polygons had in the original mesh. The file with
//! the vertices on the sphere does not record these: a reader cuts each polygon again, usually as
//! a fan from its first corner, ours according to its shape. If one of the new triangles is
//! flipped, the polygon is written as the triangles that were checked.

use std::borrow::Cow;

use cotan::geometry::Scalar;
use cotan::sphere::is_upright;
use cotan_io::{Document, Format, IoError, Limits, ProcessingMesh, Weld, read};
use nalgebra::Point3;

/// A document that every reader cuts without a flip.
#[derive(Debug)]
pub(crate) struct Upright {
    pub(crate) document: Document,
    /// Number of polygons that became triangles.
    pub(crate) written_as_triangles: usize,
}

/// Replaces polygons with a flipped triangle, in a file of this format, by the triangles of
/// `processing`.
///
/// The vertices of `document` are on the sphere.
///
/// # Errors
/// [`IoError`] if required parts of the file cannot be read.
pub(crate) fn upright(
    document: Document,
    format: Format,
    processing: &ProcessingMesh,
) -> Result<Upright, IoError> {
    // A polygon dropped by welding has no triangles to replace it.
    let mut is_mapped = vec![false; document.faces().len()];
    for f in processing.mesh().faces() {
        is_mapped[processing.document_face(f)] = true;
    }
    let mut cut: Vec<usize> = Vec::new();
    let mut now = document.clone();
    let mut sources: Vec<usize> = (0..document.faces().len()).collect();
    for round in 0..=MAX_ROUNDS {
        let faces = now.faces().iter().zip(&sources).enumerate();
        let polygons =
            faces.filter(|(_, (polygon, source))| polygon.len() > 3 && is_mapped[**source]);
        let polygons: Vec<usize> = polygons.map(|(face, _)| face).collect();
        if polygons.is_empty() {
            break;
        }
        let flipped = match round {
            MAX_ROUNDS => polygons,
            _ => Written::new(&now, format)?.flipped_polygons(&polygons),
        };
        if flipped.is_empty() {
            break;
        }
        cut.extend(flipped.iter().map(|&face| sources[face]));
        let done = document.with_faces_cut(processing, &cut)?;
        (now, sources) = (done.document, done.face_sources);
    }
    Ok(Upright {
        document: now,
        written_as_triangles: cut.len(),
    })
}

/// Replacing a polygon may change how its neighbours are cut, so the check is repeated.
///
/// This ends quickly; beyond this number all polygons become triangles.
const MAX_ROUNDS: usize = 8;

/// A document as stored in a file.
struct Written<'a> {
    /// The document that a reader gets.
    document: Cow<'a, Document>,
    numbers: Numbers,
}

/// The number type of the file, relative to that of the document that represents it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Numbers {
    Same,
    Single,
}

impl<'a> Written<'a> {
    fn new(document: &'a Document, format: Format) -> Result<Self, IoError> {
        Ok(match format {
            // With as many digits as needed.
            Format::Obj | Format::Off => Self {
                document: Cow::Borrowed(document),
                numbers: Numbers::Same,
            },
            // In the type given by its header.
            Format::Ply => Self {
                document: Cow::Owned(reread(document, format)?),
                numbers: Numbers::Same,
            },
            // Cut into triangles when written.
            _ => Self {
                document: Cow::Borrowed(document),
                numbers: Numbers::Single,
            },
        })
    }

    fn at(&self, vertex: usize) -> Point3<f64> {
        let p = self.document.positions()[vertex];
        match self.numbers {
            Numbers::Same => p,
            Numbers::Single => p.map(|x| f32::of_f64(x).as_f64()),
        }
    }

    fn is_upright(&self, [a, b, c]: [usize; 3]) -> bool {
        is_upright(&self.at(a), &self.at(b), &self.at(c))
    }

    /// The polygons among these that have a flipped triangle, cut as a fan or as our reader does.
    fn flipped_polygons(&self, polygons: &[usize]) -> Vec<usize> {
        let weld = [Weld::AsFormat, Weld::Exact];
        let surface = weld
            .iter()
            .find_map(|&weld| self.document.surface_with(weld).ok());
        let Some(surface) = surface else {
            // If in doubt, report all polygons.
            return polygons.to_vec();
        };
        let mut is_flipped = vec![false; self.document.faces().len()];
        let mesh = surface.mesh();
        for f in mesh.faces() {
            let corners = mesh.triangle(f).map(|v| surface.document_vertex(v));
            is_flipped[surface.document_face(f)] |= !self.is_upright(corners);
        }
        let is_fan_flipped = |face: usize| {
            let polygon = self.document.faces().get(face).unwrap_or(&[]);
            let fan = polygon.get(1..).unwrap_or(&[]).windows(2);
            let mut triangles = fan.map(|pair| [polygon[0], pair[0], pair[1]]);
            triangles.any(|t| !self.is_upright(t.map(|v| v as usize)))
        };
        let flipped = polygons.iter().copied();
        flipped
            .filter(|&face| is_flipped[face] || is_fan_flipped(face))
            .collect()
    }
}

/// The document as a reader of its file gets it.
fn reread(document: &Document, format: Format) -> Result<Document, IoError> {
    read(document.write(format)?, Some(format), &Limits::NONE)
}
