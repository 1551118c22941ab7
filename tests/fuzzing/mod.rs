//! The bodies of the fuzz targets.
//!
//! They are here, and not in `fuzz/`, so that the ordinary tests also run them, on the corpus and
//! on all findings. A body panics when an invariant is violated.

mod differential;
mod draw;
mod files;
mod halfedge;
mod materials;
mod merge;
mod pipeline;
mod project;
mod seeds;
mod sphere;
mod surface;

pub use differential::obj_differential;
pub use files::{document_roundtrip, read_as};
pub use halfedge::{halfedge_build, halfedge_edits};
pub use materials::materials;
pub use merge::merge_cuts;
pub use pipeline::pipeline;
pub use project::project;
pub use seeds::seeds;
pub use sphere::sphere;
pub use surface::surface_chain;

use cotan_io::Format;

/// A fuzz target. It panics if something is wrong.
pub type Target = fn(&[u8]);

/// All targets by name.
pub const TARGETS: [(&str, Target); 15] = [
    ("obj", |data| read_as(data, Format::Obj)),
    ("ply", |data| read_as(data, Format::Ply)),
    ("gltf", |data| read_as(data, Format::Gltf)),
    ("stl", |data| read_as(data, Format::Stl)),
    ("off", |data| read_as(data, Format::Off)),
    ("document_roundtrip", document_roundtrip),
    ("halfedge_build", halfedge_build),
    ("halfedge_edits", halfedge_edits),
    ("obj_differential", obj_differential),
    ("materials", materials),
    ("merge", merge_cuts),
    ("pipeline", pipeline),
    ("project", project),
    ("sphere", sphere),
    ("surface_chain", surface_chain),
];

/// Runs the body of a target.
///
/// # Panics
/// If there is no such target, or if it finds something.
pub fn run(target: &str, data: &[u8]) {
    let found = TARGETS.iter().find(|(name, _)| *name == target);
    let (_, body) = found.unwrap_or_else(|| panic!("there is no fuzz target {target}"));
    body(data);
}
