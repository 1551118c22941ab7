//! Mesh files, safely: bytes to a [`Document`] to a half-edge mesh, and back.
//!
//! A [`Document`] is the user's file and stays whole: vertex order, polygons, texture
//! coordinates, colours, further properties, comments. Processing sees a triangulated
//! [`ProcessingMesh`] built from it, and only positions are written back. OBJ, PLY (text and
//! binary of both byte orders) and OFF are read and written.
//!
//! No input panics or allocates more than a small multiple of its own size; what is refused is
//! refused with the line or byte, the element, and what to do. This crate opens no path that a
//! file names.
//!
//! ```
//! use cotan_io::{Format, Limits, read};
//!
//! let file = "# one corner of a box\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0.5 0.5\nf 1/1 2/1 3/1\n";
//! let mut document = read(file, None, &Limits::default())?;
//! let processing = document.surface()?;
//! let raised = processing.positions().map(|p| p + nalgebra::Vector3::z());
//! document.set_positions(&processing, &raised)?;
//! let text = String::from_utf8(document.write(Format::Obj)?).unwrap();
//! assert!(text.starts_with("# one corner of a box\nv 0 0 1\nv 1 0 1\n"));
//! assert!(text.ends_with("vt 0.5 0.5\nf 1/1 2/1 3/1\n"));
//! # Ok::<(), cotan_io::IoError>(())
//! ```

mod attributes;
mod coordinate;
mod cuts;
mod defects;
mod document;
mod error;
mod faces;
mod file;
mod format;
mod gltf;
mod gzip;
mod limits;
mod normals;
mod number;
mod obj;
mod off;
mod ply;
mod processing;
mod remap;
mod repair;
mod resolve;
mod source;
mod stl;
mod text;
mod topology;
mod triangulate;
mod weld;
mod writer;

pub use attributes::{
    Attributes, COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
pub use defects::{Component, Defect, DefectKind, Inspection};
pub use document::{Document, Part};
pub use error::{Element, IoError, Place, Warning};
pub use faces::FaceList;
pub use file::{load, load_with, read, read_with, save};
pub use format::Format;
pub use limits::Limits;
pub use processing::ProcessingMesh;
pub use repair::{Change, Repair, Repaired};
pub use resolve::{Folder, NoFiles, Resolve};
pub use weld::Weld;
