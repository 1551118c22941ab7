//! Safe reading and writing of mesh files: bytes to a [`Document`] to a half-edge mesh, and back.
//!
//! A [`Document`] is the user's file and is kept in full: vertex order, polygons, texture
//! coordinates, materials, nodes, images, comments, down to the original bytes. Processing
//! operates on a welded, triangulated [`ProcessingMesh`] built from it. Positions are written
//! back, and normals rotate with the surface. OBJ, PLY and STL (text and binary), OFF, glTF and
//! GLB are supported for reading and writing, optionally compressed with gzip.
//!
//! [`Document::attributes`] decodes the remaining data of a file. [`Document::inspect`] lists the
//! defects of its mesh, and [`Repair`] fixes those that can be fixed without guessing a shape.
//!
//! No input causes a panic or an allocation larger than a small multiple of the input size.
//! Rejected input is reported with the line or byte, the element, and a remedy. This crate never
//! opens a path that is named inside a file.
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
//!
//! # Modules
//!
//! Bytes become a `Reading` (the parsed geometry and the source file), and that becomes a
//! `Document`; this order is the direction of dependencies. Modules import only modules above
//! them or in their own row, and never in a circle; only the files of a folder, which are one
//! concept, use each other freely.
//!
//! | modules | content |
//! |---|---|
//! | `error`, `cure`, `format`, `printable` | errors, warnings, the formats' names |
//! | `limits`, `room`, `number` | bounds on memory; numbers |
//! | `text`, `coordinate` | lines, words, coordinates |
//! | `regular`, `replace`, `unfinished` | files: opened and replaced |
//! | `resolve`, `gzip` | files: found by their names, compressed |
//! | `faces`, `attributes` | the contents of a mesh file |
//! | `material`, `placement`, `parsed` | materials, nodes, the result of a reader |
//! | `remap`, `assembly` | elements of a new mesh, each with the old one it comes from |
//! | `topology`, `weld`, `triangulate`, `ears`, `optimal` | geometry of polygons |
//! | `recut`, `cuts`, `precision`, `normals` | their triangles, rounding, normals |
//! | `companions`, `source` | `SourceFile`: a file as it was read; `Reading` |
//! | `instances`, `contents` | the contents of a new file |
//! | `obj`, `ply`, `off`, `stl`, `gltf` | the formats: reader, source file, writer of new files |
//! | `detect`, `formats` | recognizing a format; the only place that knows all of them |
//! | `processing`, `document` | the surface to work on; the only place that builds a `Document` |
//! | `defects`, `weldable`, `repair`, `cut_faces` | inspection and repair of a document |
//! | `file`, `staging` | loading and saving |

mod assembly;
mod attributes;
mod companions;
mod contents;
mod coordinate;
mod cure;
mod cut_faces;
mod cuts;
mod defects;
mod detect;
mod document;
mod ears;
mod error;
mod faces;
mod file;
mod format;
mod formats;
mod gltf;
mod gzip;
mod instances;
mod limits;
mod material;
mod normals;
mod number;
mod obj;
mod off;
mod optimal;
mod parsed;
mod placement;
mod ply;
mod precision;
mod printable;
mod processing;
mod recut;
mod regular;
mod remap;
mod repair;
mod replace;
mod resolve;
mod room;
mod source;
mod staging;
mod stl;
mod text;
mod topology;
mod triangulate;
mod unfinished;
mod weld;
mod weldable;

pub use assembly::{Assembled, Assembly, DataSource};
pub use attributes::{
    Attributes, COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
pub use companions::{Companion, Companions, Saved, WriteOptions, Written};
pub use cure::Cure;
pub use cut_faces::CutDocument;
pub use defects::{Component, Defect, DefectKind, Inspection};
pub use document::{Derivation, Derived, Document};
pub use error::{Element, IoError, Place, Warning};
pub use faces::FaceList;
pub use file::{load, load_with, read, read_with, save, save_with};
pub use format::Format;
pub use limits::Limits;
pub use material::{Alpha, Image, ImageKind, Material, Materials};
pub use parsed::{Node, Part};
pub use printable::{Printable, printable, printable_json};
pub use processing::{Numbering, ProcessingMesh};
pub use regular::{open_regular, read_regular};
pub use repair::{Change, Filling, Repair, Repaired};
pub use replace::{check_replaceable, link_target, num_names, replace_file};
pub use resolve::{Folder, NoFiles, Resolve};
pub use unfinished::{Access, Unfinished, remove_unfinished};
pub use weld::Weld;
pub use weldable::Weldable;

/// Runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
