//! A new PLY file.

use ply_rs::ply::{
    Addable, DefaultElement, ElementDef, Encoding, Header, PropertyDef, PropertyType, ScalarType,
};
use ply_rs::writer::Writer;

use crate::attributes::Attributes;
use crate::error::IoError;
use crate::writer::Contents;

/// What a new PLY file cannot hold, in words.
pub(crate) fn losses(_attributes: &Attributes) -> Vec<String> {
    Vec::new()
}

/// Positions and faces as a binary little-endian PLY file with `double` coordinates.
pub(crate) fn write_new(contents: &Contents<'_>) -> Result<Vec<u8>, IoError> {
    let (positions, faces) = (&contents.positions, &contents.faces);
    // Most readers expect a length of one byte; only larger polygons force a longer one.
    let is_short = faces
        .iter()
        .all(|polygon| polygon.len() <= usize::from(u8::MAX));
    let length = if is_short {
        ScalarType::UChar
    } else {
        ScalarType::UInt
    };
    let mut out = Vec::with_capacity(256 + 24 * positions.len() + 5 * faces.num_corners());
    Writer::<DefaultElement>::new()
        .write_header(&mut out, &header(positions.len(), faces.len(), length))
        .map_err(IoError::Write)?;
    for x in positions.iter().flat_map(|p| p.iter()) {
        out.extend_from_slice(&x.to_le_bytes());
    }
    for polygon in faces.iter() {
        let degree = (polygon.len() as u32).to_le_bytes();
        out.extend_from_slice(&degree[..if is_short { 1 } else { 4 }]);
        for v in polygon {
            out.extend_from_slice(&v.to_le_bytes());
        }
    }
    Ok(out)
}

fn header(num_vertices: usize, num_faces: usize, length: ScalarType) -> Header {
    let mut vertex = ElementDef::new("vertex".to_owned());
    vertex.count = num_vertices;
    for axis in ["x", "y", "z"] {
        let double = PropertyType::Scalar(ScalarType::Double);
        vertex
            .properties
            .add(PropertyDef::new(axis.to_owned(), double));
    }
    let mut face = ElementDef::new("face".to_owned());
    face.count = num_faces;
    // `int` rather than `uint`, which some readers lack; vertices are below 2^31.
    let corners = PropertyType::List(length, ScalarType::Int);
    face.properties
        .add(PropertyDef::new("vertex_indices".to_owned(), corners));
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.elements.add(vertex);
    header.elements.add(face);
    header
}
