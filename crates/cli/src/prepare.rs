//! The mesh of a job: read, repaired if requested, and built.

use std::time::Instant;

use cotan_io::{Change, Document, Filling, IoError, ProcessingMesh, Repair, Weld};
use cotan_tool::Work;
use cotan_tool::handles_file::FileVertices;
use cotan_tool::numbers::before_repair;
use cotan_tool::repair::mend;

use crate::args::InputPath;
use crate::console::Console;
use crate::error::{CliError, Cure};
use crate::files;
use crate::memory;
use crate::report::{Seconds, counted};

/// The source of the mesh of a job.
#[derive(Clone, Debug)]
pub(crate) struct Source<'a> {
    pub(crate) path: &'a InputPath,
    /// The repairs to make first, if any, without welding.
    pub(crate) repair: Option<Repair>,
    /// The handling of holes in these repairs.
    pub(crate) filling: Filling,
    pub(crate) weld: Weld,
    /// The repair to suggest if no surface can be built.
    pub(crate) cure: Cure,
    pub(crate) surfaces: Surfaces,
}

/// The surfaces that a job can work on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Surfaces {
    /// Oriented manifolds.
    Manifold,
    /// Any list of faces, cut into pieces whose copies of a vertex move as one.
    Any,
}

/// A mesh that is ready for processing.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) document: Document,
    pub(crate) processing: ProcessingMesh,
    /// Maps vertices of the file, if the mesh was repaired.
    pub(crate) file_vertices: Option<FileVertices>,
    /// The face of the file for each face of the document, if the mesh was repaired; `None` for
    /// faces that fill holes.
    pub(crate) file_faces: Option<Vec<Option<usize>>>,
    /// The changes made by the repair.
    pub(crate) changes: Vec<Change>,
}

pub(crate) fn prepare(
    source: &Source<'_>,
    seconds: &mut Seconds,
    console: &Console,
) -> Result<Prepared, CliError> {
    let path = source.path;
    let in_file = |error| files::in_file(path, error);
    let clock = Instant::now();
    let mut document = files::load(path, console)?;
    let work = match source.repair {
        Some(_) => Work::Repair,
        None => Work::Build,
    };
    memory::check(work, path, &document)?;
    seconds.load = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let mut repaired = None;
    if let Some(repair) = &source.repair {
        // Weld before the repair: welding afterwards would join what the repair has split.
        let repair = repair.clone().weld_in_place(source.weld);
        let mended = mend(&repair, &document).map_err(in_file)?;
        if let Some(problem) = &mended.unfair {
            warn_unfair(path, problem, console);
        }
        let done = mended.repaired;
        if tell_repairs(source, &done.changes, console) == Repairs::Some {
            repaired = Some(done);
        }
    }
    let processing = match &repaired {
        None => surface(&document, source.surfaces, source.weld),
        Some(done) => {
            let surface = surface(&done.document, source.surfaces, Weld::AsFormat);
            surface.map_err(|error| before_repair(error, done))
        }
    };
    let processing =
        processing.map_err(|error| CliError::surface(path, error, source.cure, source.weld))?;
    let (mut file_vertices, mut file_faces, mut changes) = (None, None, Vec::new());
    if let Some(mut done) = repaired {
        // Welding concerns only the surface here; the file keeps its vertices.
        done.changes
            .retain(|change| !matches!(change, Change::MergedVertex { .. }));
        let num_vertices = document.positions().len();
        let sources = FileVertices::new(num_vertices, done.vertex_sources);
        file_vertices = Some(sources.without(&done.added_vertices));
        file_faces = Some(done.face_sources);
        (document, changes) = (done.document, done.changes);
    }
    seconds.build = clock.elapsed().as_secs_f64();
    Ok(Prepared {
        document,
        processing,
        file_vertices,
        file_faces,
        changes,
    })
}

fn surface(document: &Document, surfaces: Surfaces, weld: Weld) -> Result<ProcessingMesh, IoError> {
    match surfaces {
        Surfaces::Manifold => document.surface_with(weld),
        Surfaces::Any => document.surface_in_pieces(weld),
    }
}

/// Warns about patches that do not continue the surface smoothly.
pub(crate) fn warn_unfair(path: &InputPath, problem: &str, console: &Console) {
    console.warn(format_args!(
        "{}: the holes were filled, but not smoothly: {problem}",
        path.display()
    ));
}

/// Describes what welding would join, unless welding is off.
pub(crate) fn weldable(document: &Document, weld: Weld) -> Option<String> {
    if weld == Weld::Off {
        return None;
    }
    // Invalid tolerances were refused earlier.
    let found = document.weldable(weld).ok().flatten();
    found.map(|weldable| weldable.to_string())
}

/// Warns if parts of a mesh in several pieces will be fixed although welding would join them.
pub(crate) fn warn_weldable(source: &Source<'_>, prepared: &Prepared, console: &Console) {
    if prepared.processing.mesh().components().count() < 2 {
        return;
    }
    if let Some(weldable) = weldable(&prepared.document, source.weld) {
        console.warn(format_args!("{}: {weldable}", source.path.display()));
    }
}

/// The outcome of a repair: whether it changed anything.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Repairs {
    None,
    Some,
}

/// Warns about the changes of a repair, and about holes that it left open.
fn tell_repairs(source: &Source<'_>, changes: &[Change], console: &Console) -> Repairs {
    let path = source.path.display();
    for change in changes {
        if let Change::KeptHole { .. } = change {
            console.warn(format_args!("{path}: {change}"));
        }
    }
    let is_repair = |change: &&Change| {
        !matches!(
            change,
            Change::MergedVertex { .. } | Change::KeptHole { .. }
        )
    };
    let Some(first) = changes.iter().find(is_repair) else {
        return Repairs::None;
    };
    let count = changes.iter().filter(is_repair).count();
    let option = match source.filling {
        Filling::Off => "",
        Filling::Smooth { .. } => " --fill-holes smooth",
        _ => " --fill-holes",
    };
    console.warn(format_args!(
        "{path}: repaired by {}, from \"{first}\"; `cotan repair{option}` lists them",
        counted(count, "change")
    ));
    Repairs::Some
}
