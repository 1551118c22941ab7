//! The mesh of a job: read, repaired if requested, and built.

use std::path::Path;
use std::time::Instant;

use cotan::geometry::{Positions, Scalar};
use cotan_io::{Change, Document, Filling, IoError, ProcessingMesh, Repair, Weld};
use cotan_tool::Work;
use cotan_tool::files::in_file;
use cotan_tool::handles_file::FileVertices;
use cotan_tool::numbers::{before_repair, in_file_numbers};
use cotan_tool::repair::mend;

use crate::args::{InputPath, MeshArgs};
use crate::console::Console;
use crate::error::{CliError, Cure};
use crate::files;
use crate::memory;
use crate::report::{Seconds, counted};

/// The source of the mesh of a job.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    pub(crate) path: InputPath,
    /// The repairs to make first, if any, without welding.
    repair: Option<Repair>,
    /// The handling of holes in these repairs.
    pub(crate) filling: Filling,
    pub(crate) weld: Weld,
    /// The repair to suggest if no surface can be built.
    cure: Cure,
    surfaces: Surfaces,
    instances: Instances,
}

/// The treatment of meshes that several nodes of a glTF show.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum Instances {
    /// An edit moves them everywhere.
    #[default]
    Shared,
    /// Every node gets a mesh of its own.
    Unique,
}

/// The surfaces that a job can work on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Surfaces {
    /// Oriented manifolds.
    Manifold,
    /// Any list of faces, cut into pieces whose copies of a vertex move as one.
    Any,
}

impl Source {
    /// A mesh file, the repairs of `--repair` if given, and the value of `--weld`.
    pub(crate) fn new(path: &InputPath, repair: Option<Repair>, weld: Option<Weld>) -> Self {
        Self {
            path: path.clone(),
            cure: match repair {
                Some(_) => Cure::Beyond,
                None => Cure::Offered,
            },
            repair,
            filling: Filling::Off,
            weld: weld.unwrap_or_default(),
            surfaces: Surfaces::Manifold,
            instances: Instances::Shared,
        }
    }

    /// States the treatment of instances. Default: shared.
    pub(crate) fn instances(self, instances: Instances) -> Self {
        Self { instances, ..self }
    }

    /// States the surfaces that the job can work on. Default: manifold ones.
    pub(crate) fn surfaces(self, surfaces: Surfaces) -> Self {
        Self { surfaces, ..self }
    }

    /// Also fills holes.
    pub(crate) fn fill_holes(mut self, filling: Filling) -> Self {
        self.filling = filling;
        if filling != Filling::Off {
            #[expect(
                clippy::unwrap_or_default,
                reason = "a new repair does nothing, the default one does"
            )]
            let before = self.repair.unwrap_or_else(Repair::new);
            self.repair = Some(before.fill_holes(filling));
        }
        self
    }
}

impl From<&MeshArgs> for Source {
    fn from(args: &MeshArgs) -> Self {
        Self::new(&args.mesh, args.repair.then(Repair::default), args.weld)
    }
}

/// A mesh that is ready for processing.
#[derive(Debug)]
pub(crate) struct Prepared {
    pub(crate) source: Source,
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

impl Prepared {
    /// The file of the mesh.
    pub(crate) fn path(&self) -> &Path {
        &self.source.path
    }

    /// Moves the vertices of the document. Returns the positions that it stores.
    ///
    /// # Errors
    /// [`CliError::Io`] if the file cannot represent them.
    pub(crate) fn set_positions<T: Scalar>(
        &mut self,
        positions: &Positions<T>,
    ) -> Result<Positions<f64>, CliError> {
        let moved = self.document.set_positions(&self.processing, positions);
        moved.map_err(|error| self.in_file(error))?;
        Ok(positions_of(&self.document, &self.processing))
    }

    /// Refuses work on this mesh that would exceed the memory limit. Returns the number of bytes
    /// left for factors.
    pub(crate) fn check_memory(&self, work: Work) -> Result<u64, CliError> {
        memory::check(work, self.path(), &self.document)
    }

    /// The error of an algorithm, with the name and the indices of the file.
    pub(crate) fn refuse(&self, error: cotan::Error) -> CliError {
        CliError::Mesh {
            path: self.path().to_owned(),
            source: in_file_numbers(error, &self.processing, self.file_vertices.as_ref()),
        }
    }

    /// An error of the document, with the name of the file.
    pub(crate) fn in_file(&self, error: IoError) -> CliError {
        in_file(self.path(), error).into()
    }

    /// Describes what welding would join, unless welding is off.
    pub(crate) fn weldable(&self) -> Option<String> {
        if self.source.weld == Weld::Off {
            return None;
        }
        // Invalid tolerances were refused earlier.
        let found = self.document.weldable(self.source.weld).ok().flatten();
        found.map(|weldable| weldable.to_string())
    }

    /// Warns about vertices that welding would join.
    pub(crate) fn warn_weldable(&self, console: &Console) {
        if let Some(weldable) = self.weldable() {
            console.warn(format_args!("{}: {weldable}", self.path().display()));
        }
    }
}

/// Reads a mesh, repairs it, and builds its half-edge mesh. Adds to the durations.
///
/// # Errors
/// [`CliError`] for a file that cannot be read, does not fit in memory, or has no surface.
pub(crate) fn prepare(
    source: Source,
    seconds: &mut Seconds,
    console: &Console,
) -> Result<Prepared, CliError> {
    let path = &source.path;
    let in_file = |error| files::in_file(path, error);
    let clock = Instant::now();
    let mut document = match source.instances {
        Instances::Shared => files::load(path, console)?,
        Instances::Unique => {
            let unique = files::read(path)?.with_unique_meshes();
            let unique = unique.map_err(|error| files::in_file(path, error))?;
            files::warn(path, &unique, console);
            unique
        }
    };
    let work = match source.repair {
        Some(_) => Work::Repair,
        None => Work::Build,
    };
    memory::check(work, path, &document)?;
    seconds.load += clock.elapsed().as_secs_f64();
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
        if warn_repairs(&source, &done.changes, console) == Repairs::Some {
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
    seconds.build += clock.elapsed().as_secs_f64();
    Ok(Prepared {
        source,
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

/// Reads a mesh that a command only measures, and builds its half-edge mesh.
///
/// # Errors
/// The same as [`prepare`].
pub(crate) fn load(
    path: &InputPath,
    console: &Console,
) -> Result<(Document, ProcessingMesh), CliError> {
    let document = files::load(path, console)?;
    memory::check(Work::Build, path, &document)?;
    let processing = document
        .surface_in_pieces(Weld::AsFormat)
        .map_err(|error| CliError::surface(path, error, Cure::Command, Weld::AsFormat))?;
    Ok((document, processing))
}

/// The document's positions, in the order of the processing mesh.
pub(crate) fn positions_of(document: &Document, processing: &ProcessingMesh) -> Positions<f64> {
    let positions = document.positions();
    processing
        .mesh()
        .vertices()
        .map(|v| positions[processing.document_vertex(v)])
        .collect()
}

/// Warns about patches that do not continue the surface smoothly.
pub(crate) fn warn_unfair(path: &InputPath, problem: &str, console: &Console) {
    console.warn(format_args!(
        "{}: the holes were filled, but not smoothly: {problem}",
        path.display()
    ));
}

/// The outcome of a repair: whether it changed anything.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Repairs {
    None,
    Some,
}

/// Warns about the changes of a repair, and about holes that it left open.
fn warn_repairs(source: &Source, changes: &[Change], console: &Console) -> Repairs {
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
        "{path}: repaired by {}, the first of which is \"{first}\"; `cotan repair{option}` lists them",
        counted(count, "change")
    ));
    Repairs::Some
}
