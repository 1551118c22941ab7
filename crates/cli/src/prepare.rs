//! The mesh of a job: read, repaired if asked for, and built.

use std::time::Instant;

use cotan_io::{Change, Document, ProcessingMesh, Repair};

use crate::args::InputArgs;
use crate::console::Console;
use crate::error::{CliError, Cure, before_repair};
use crate::files;
use crate::handles_file::{Constraint, FileVertices, Goal, Place};
use crate::report::{Seconds, counted};

/// A mesh that can be worked on.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) document: Document,
    pub(crate) processing: ProcessingMesh,
    /// How the vertices of the file are found, if the mesh was repaired.
    pub(crate) file_vertices: Option<FileVertices>,
    /// What the repair did.
    pub(crate) changes: Vec<Change>,
}

pub(crate) fn prepare(
    input: &InputArgs,
    seconds: &mut Seconds,
    console: &Console,
) -> Result<Prepared, CliError> {
    let path = input.mesh.as_path();
    let in_file = |error| files::in_file(path, error);
    let clock = Instant::now();
    let mut document = files::load(path, console)?;
    seconds.load = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let weld = input.weld();
    let mut repaired = None;
    if input.repair {
        // Welded before the repair and not after it: what was parted would be joined again.
        let repair = Repair::default().weld_in_place(weld);
        let done = repair.apply(&document).map_err(in_file)?;
        let is_repair = |change: &&Change| !matches!(change, Change::MergedVertex { .. });
        if let Some(first) = done.changes.iter().find(is_repair) {
            let count = done.changes.iter().filter(is_repair).count();
            console.warn(format_args!(
                "{}: repaired by {}, from \"{first}\"; `cotan repair` lists them",
                path.display(),
                counted(count, "change")
            ));
            repaired = Some(done);
        }
    }
    let cure = match input.repair {
        true => Cure::Beyond,
        false => Cure::Offered,
    };
    let processing = match &repaired {
        None => document.surface_with(weld),
        Some(done) => {
            let surface = done.document.surface();
            surface.map_err(|error| before_repair(error, done))
        }
    };
    let processing = processing.map_err(|error| CliError::surface(path, error, cure, weld))?;
    let (mut file_vertices, mut changes) = (None, Vec::new());
    if let Some(mut done) = repaired {
        // Welding is about the surface here, and the file keeps its vertices.
        done.changes
            .retain(|change| !matches!(change, Change::MergedVertex { .. }));
        let num_vertices = document.positions().len();
        file_vertices = Some(FileVertices::new(num_vertices, done.vertex_sources));
        (document, changes) = (done.document, done.changes);
    }
    seconds.build = clock.elapsed().as_secs_f64();
    Ok(Prepared {
        document,
        processing,
        file_vertices,
        changes,
    })
}

/// Handles that hold still what no handle holds, told in a warning.
pub(crate) fn hold_loose(
    constraints: &[Constraint],
    processing: &ProcessingMesh,
    file_vertices: Option<&FileVertices>,
    console: &Console,
) -> Vec<Constraint> {
    let components = processing.mesh().components();
    let mut is_held = vec![false; components.count()];
    for v in constraints
        .iter()
        .filter_map(|c| processing.vertex(c.vertex))
    {
        is_held[components.of(v)] = true;
    }
    let loose: Vec<_> = processing
        .mesh()
        .vertices()
        .filter(|&v| !is_held[components.of(v)])
        .map(|v| Constraint {
            vertex: processing.document_vertex(v),
            goal: Goal::Stay,
            weight: None,
            place: Place::Loose,
        })
        .collect();
    if let Some(first) = loose.first() {
        let parts = is_held.iter().filter(|is_held| !**is_held).count();
        let verb = if parts == 1 { "has" } else { "have" };
        console.warn(format_args!(
            "{} without a handle ({} vertices, from vertex {}) {verb} been held still",
            counted(parts, "component"),
            loose.len(),
            file_vertices.map_or(first.vertex, |file| file.vertex(first.vertex))
        ));
    }
    loose
}
