//! Project files: everything that a person works on, in one file.
//!
//! A project is a tar archive, packed with gzip, of two to four files:
//!
//! ```text
//! project.json     version, name and format of the mesh, handles, masks, selection, settings
//! mesh             the mesh as it was opened, in its format, with what it refers to; the one
//!                  before the repair, if it was opened repaired
//! rest, shape      the rest shape and the shape, if they differ from the mesh: f64 x, y, z per
//!                  vertex of the mesh, little-endian
//! ```
//!
//! Vertices are those of the mesh file, so that a project stays valid if the internal order of
//! vertices changes.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use cotan::halfedge::VertexId;
use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::GzEncoder;

use cotan_io::{
    Companions, Document, Format, IoError, Limits, ProcessingMesh, WriteOptions, read, read_regular,
};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::open::Place;
use super::save::{check_place, write_error};
use super::{Expect, Fingerprint, OpenedMesh, SaveError};
use crate::model::Model;
use crate::scene::{Props, Scene};
use crate::shape::Shape;

/// The reason why a project was not opened, as one sentence that names the file.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ProjectError {
    /// The file cannot be read.
    #[error("{}: cannot read the project: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        #[source]
        source: std::io::Error,
    },
    /// The mesh in the project cannot be read.
    #[error("{}: the mesh in the project: {source}", path.display())]
    Mesh {
        /// The file.
        path: PathBuf,
        /// The error of the reader.
        #[source]
        source: IoError,
    },
    /// The file is not a project, or it is damaged.
    #[error("{}: this project cannot be used: {problem}", path.display())]
    Corrupt {
        /// The file.
        path: PathBuf,
        /// The defect.
        problem: String,
    },
}

/// Returns `true` if a path ends like that of a project.
pub fn is_project(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| e.eq_ignore_ascii_case("cotan"))
}

/// The entry `project.json`.
#[derive(Serialize, Deserialize)]
struct Contents {
    cotan_project: u32,
    /// The name of the mesh file that it began with, for people.
    name: String,
    /// The extension of the format of the entry `mesh`.
    format: String,
    /// True if the mesh was opened repaired. The entry `mesh` is the one before the repair.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    is_repaired: bool,
    is_settled: bool,
    props: Props,
}

const VERSION: u32 = 1;

/// Saves a model with its handles, masks, selection and settings.
///
/// The file is written next to the old one and replaces it in one step.
///
/// # Errors
/// [`SaveError`]. An existing file stays intact.
pub fn save_project(model: &Model, path: &Path, expect: Expect) -> Result<Fingerprint, SaveError> {
    check_place(path, expect)?;
    let of_document = |source| SaveError::Document {
        path: path.to_owned(),
        source,
    };
    let bytes = project_bytes(model).map_err(of_document)?;
    cotan_io::replace_file(path, &bytes).map_err(|source| write_error(path, source))?;
    Fingerprint::of(path).map_err(|source| write_error(path, source))
}

/// The bytes of a project: the same model gives the same bytes.
///
/// # Errors
/// The error of the writer of the mesh.
pub fn project_bytes(model: &Model) -> Result<Vec<u8>, IoError> {
    let opened = model.file();
    let (document, processing) = (&opened.document, &opened.processing);
    let original = opened.before_repair.as_deref().unwrap_or(document);
    let format = match original.format().unwrap_or(Format::Ply) {
        // Text cannot hold buffers.
        Format::Gltf => Format::Glb,
        other => other,
    };
    let options = WriteOptions::default().companions(Companions::Embedded);
    let mesh = original.write_with(format, &options)?;
    let scene = model.scene();
    let to_document = |v: VertexId| VertexId::new(processing.document_vertex(v));
    let contents = Contents {
        cotan_project: VERSION,
        name: opened.name.clone(),
        format: format.extension().to_owned(),
        is_repaired: opened.before_repair.is_some(),
        is_settled: scene.is_settled,
        props: scene.props.renumbered(&|v| Some(to_document(v))),
    };
    let write = || -> std::io::Result<Vec<u8>> {
        let packed = GzEncoder::new(Vec::new(), Compression::fast());
        let mut archive = tar::Builder::new(packed);
        add(
            &mut archive,
            "project.json",
            &serde_json::to_vec_pretty(&contents)?,
        )?;
        add(&mut archive, "mesh", &mesh.bytes)?;
        for (name, shape) in [("rest", &scene.rest), ("shape", &scene.shape)] {
            if shape != model.original() {
                add(
                    &mut archive,
                    name,
                    &in_document(shape, document, processing),
                )?;
            }
        }
        archive.into_inner()?.finish()
    };
    write().map_err(IoError::Write)
}

/// Adds a file to an archive, without a time or an owner: the same model gives the same bytes.
fn add(archive: &mut tar::Builder<impl Write>, name: &str, bytes: &[u8]) -> std::io::Result<()> {
    let mut header = tar::Header::new_ustar();
    header.set_size(bytes.len() as u64);
    header.set_mode(0o644);
    header.set_mtime(0);
    archive.append_data(&mut header, name, bytes)
}

/// The positions of all vertices of a document, those of the surface as in a shape.
fn in_document(shape: &Shape, document: &Document, processing: &ProcessingMesh) -> Vec<u8> {
    let mut places = document.positions().to_vec();
    for (v, p) in shape.iter() {
        places[processing.document_vertex(v)] = *p;
    }
    Shape::new(places.into_iter().collect()).to_bytes()
}

/// Opens a project.
///
/// # Errors
/// [`ProjectError`] for a file that cannot be read, is no project, or is damaged.
pub fn open_project(path: &Path) -> Result<Model, ProjectError> {
    let failed = |source| ProjectError::Read {
        path: path.to_owned(),
        source,
    };
    let fingerprint = Fingerprint::of(path).map_err(failed)?;
    let limits = Limits::default();
    let bytes = read_regular(path, limits.max_bytes).map_err(failed)?;
    read_project(path, &bytes, fingerprint, &limits)
}

/// Reads a project that [`project_bytes`] has written. `path` and `fingerprint` are those of its
/// file.
///
/// # Errors
/// [`ProjectError`] for bytes that are no project, or damaged.
pub fn read_project(
    path: &Path,
    bytes: &[u8],
    fingerprint: Fingerprint,
    limits: &Limits,
) -> Result<Model, ProjectError> {
    // Libraries repeat what they do not understand.
    let corrupt = |problem: String| ProjectError::Corrupt {
        path: path.to_owned(),
        problem: cotan_io::printable(&problem).into_owned(),
    };
    let mut files = unpacked(bytes, limits).map_err(&corrupt)?;
    let mut needed = |name: &str| {
        let file = files.remove(name);
        file.ok_or_else(|| corrupt(format!("there is no file \"{name}\" in it")))
    };
    let contents = needed("project.json")?;
    let mesh = needed("mesh")?;
    let contents: Contents =
        serde_json::from_slice(&contents).map_err(|e| corrupt(e.to_string()))?;
    if contents.cotan_project != VERSION {
        let version = contents.cotan_project;
        let problem = format!("it is of version {version}, not {VERSION}: use a newer editor");
        return Err(corrupt(problem));
    }
    let hint = Format::from_path(Path::new(&format!("mesh.{}", contents.format)));
    let of_mesh = |source| ProjectError::Mesh {
        path: path.to_owned(),
        source,
    };
    let document = read(mesh, hint, limits).map_err(of_mesh)?;
    let place = Place {
        path: path.to_owned(),
        name: contents.name,
        fingerprint,
    };
    let opened = match contents.is_repaired {
        true => OpenedMesh::repaired(place, document),
        false => OpenedMesh::as_it_is(place, document),
    };
    let opened = opened.map_err(of_mesh)?;
    let processing = Arc::clone(&opened.processing);
    let mut shape = |name: &str| -> Result<Option<Shape>, ProjectError> {
        let Some(bytes) = files.remove(name) else {
            return Ok(None);
        };
        let read = on_surface(&bytes, &processing);
        let shape = read.ok_or_else(|| corrupt(format!("its file \"{name}\" does not fit")))?;
        Ok(Some(shape))
    };
    let original = Shape::new(processing.positions().clone());
    let rest = shape("rest")?.unwrap_or_else(|| original.clone());
    let now = shape("shape")?.unwrap_or(original);
    // One shape, if the two are equal.
    let now = match now == rest {
        true => rest.clone(),
        false => now,
    };
    let props = contents.props.renumbered(&|v| processing.vertex(v.index()));
    let props = props.with_copies(processing.mesh());
    if let Some(problem) = props.problem(processing.mesh().num_vertices()) {
        return Err(corrupt(problem));
    }
    Ok(Model::with_scene(
        opened,
        Scene {
            rest,
            shape: now,
            is_settled: contents.is_settled,
            props: Arc::new(props),
        },
    ))
}

/// The files of an archive by their names, in all no larger than the limit.
fn unpacked(bytes: &[u8], limits: &Limits) -> Result<BTreeMap<String, Vec<u8>>, String> {
    let told = |error: std::io::Error| format!("it cannot be unpacked: {error}");
    // A small archive may hold much.
    let most = limits.max_bytes;
    let mut archive = tar::Archive::new(GzDecoder::new(bytes).take(most));
    let mut files = BTreeMap::new();
    for entry in archive.entries().map_err(told)? {
        let mut entry = entry.map_err(told)?;
        let name = String::from_utf8_lossy(&entry.path_bytes()).into_owned();
        if !NAMES.contains(&name.as_str()) || !entry.header().entry_type().is_file() {
            return Err(format!(
                "there is a file \"{}\" in it",
                cotan_io::printable(&name)
            ));
        }
        let promised = entry.size();
        let mut file = Vec::new();
        entry.read_to_end(&mut file).map_err(told)?;
        if file.len() as u64 != promised {
            return Err(format!(
                "its file \"{name}\" is cut short, or larger than the limit"
            ));
        }
        files.insert(name, file);
    }
    // The checksum stands behind the last file.
    let mut rest = archive.into_inner();
    std::io::copy(&mut rest, &mut std::io::sink()).map_err(told)?;
    Ok(files)
}

const NAMES: [&str; 4] = ["project.json", "mesh", "rest", "shape"];

/// A shape of the surface from the positions of all vertices of its document.
fn on_surface(bytes: &[u8], processing: &ProcessingMesh) -> Option<Shape> {
    let places = Shape::from_bytes(bytes)?;
    if places.len() != processing.num_document_vertices() {
        return None;
    }
    let at = |v| {
        places
            .get(VertexId::new(processing.document_vertex(v)))
            .copied()
    };
    let points: Option<Vec<Point3<f64>>> = processing.mesh().vertices().map(at).collect();
    let is_finite = |p: &Point3<f64>| p.iter().all(|x| x.is_finite());
    let points = points.filter(|points| points.iter().all(is_finite))?;
    Some(Shape::new(points.into_iter().collect()))
}
