//! The edit shared by `deform`, `reconstruct` and `demo`: document and handles in, document out.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::Instant;

use cotan::flow::{Flow, Report as FlowReport, StepReport};
use cotan::geometry::{Positions, Scalar, Surface};
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::{DeformOptions, PartReport, Quality, Session, ShapeErrors};
use cotan_io::{Document, ProcessingMesh, Weld};
use cotan_tool::handles_file::{Constraint, FileVertices, to_handles};
use cotan_tool::numbers::in_file_numbers;
use nalgebra::Point3;

use crate::args::{InputPath, Precision};
use crate::console::{Console, Progress};
use crate::error::{CliError, Cure};
use crate::report::{HistoryEntry, Seconds};

/// The parameters of an edit.
#[derive(Debug)]
pub(crate) struct Edit<'a> {
    /// The mesh file, for messages.
    pub(crate) path: &'a Path,
    pub(crate) constraints: &'a [Constraint],
    pub(crate) options: &'a DeformOptions,
    /// Weight of the handles that have none of their own; `None` holds them exactly.
    pub(crate) soft: Option<f64>,
    pub(crate) precision: Precision,
    pub(crate) history: History,
    /// Maps vertices of the file, if the mesh was repaired.
    pub(crate) file_vertices: Option<&'a FileVertices>,
}

/// The policy for measuring errors after every iteration.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum History {
    Skip,
    Keep,
}

/// The result of an edit.
#[derive(Debug)]
pub(crate) struct Edited {
    /// The positions that were written to the document, in the order of the processing mesh.
    pub(crate) positions: Positions<f64>,
    pub(crate) flow: FlowReport,
    pub(crate) quality: Quality,
    pub(crate) history: Option<Vec<HistoryEntry>>,
    /// The roles of the parts; empty for a model of one part.
    pub(crate) parts: Vec<PartReport>,
}

impl Edit<'_> {
    /// Moves the handles and writes the new positions to the document.
    ///
    /// # Errors
    /// [`CliError::Mesh`] for a mesh that cannot be edited with these handles.
    pub(crate) fn run(
        &self,
        document: &mut Document,
        processing: &ProcessingMesh,
        seconds: &mut Seconds,
        progress: &Progress,
    ) -> Result<Edited, CliError> {
        match self.precision {
            Precision::F64 => self.run_as::<f64>(document, processing, seconds, progress),
            Precision::F32 => self.run_as::<f32>(document, processing, seconds, progress),
        }
    }

    fn run_as<T: Scalar>(
        &self,
        document: &mut Document,
        processing: &ProcessingMesh,
        seconds: &mut Seconds,
        progress: &Progress,
    ) -> Result<Edited, CliError> {
        let refuse = |error: cotan::Error| self.refuse(error, processing);
        let mesh = processing.mesh();
        let original = Surface::new(mesh, processing.positions()).map_err(|e| refuse(e.into()))?;

        progress.phase("factorize");
        let clock = Instant::now();
        let origin = self.origin(&original);
        let mut handles = to_handles::<T>(self.constraints, processing, origin);
        if let Some(weight) = self.soft {
            handles = handles.all_held(Hold::Soft(weight));
        }
        let positions = processing
            .positions()
            .map(|p| Point3::from((p - origin).map(T::of_f64)));
        let mut session = Session::new(
            Surface::assume_checked(mesh, &positions),
            &handles,
            self.options,
        )
        .map_err(refuse)?;
        seconds.factor = clock.elapsed().as_secs_f64();
        tracing::info!("system solved by {}", session.flow().system().choice());

        progress.phase("iterate");
        let clock = Instant::now();
        let mut recorder = Recorder::new(self.history, original, session.flow_vertices());
        let flow = session.run_observed(|flow, step| {
            progress.step(step.iteration, step.change);
            recorder.record(flow, step)
        });
        let (history, measuring) = recorder.finish().map_err(refuse)?;
        let flow = flow.map_err(refuse)?;
        seconds.iterate = clock.elapsed().as_secs_f64() - measuring;

        let in_file = |e| crate::files::in_file(self.path, e);
        document
            .set_positions(
                processing,
                &moved(&positions, &session.positions(), processing, origin),
            )
            .map_err(in_file)?;
        let parts = session.parts();
        // Free the session: the measures need memory of their own.
        drop(session);
        let positions = positions_of(document, processing);
        let quality =
            Quality::measure(&original, &original.with_positions(&positions)).map_err(refuse)?;
        Ok(Edited {
            positions,
            flow,
            quality,
            history,
            parts,
        })
    }

    /// The point used as the origin.
    ///
    /// In single precision it is the centre of the mesh, so that a mesh far from the origin keeps
    /// its digits.
    fn origin(&self, original: &Surface<'_, f64>) -> Point3<f64> {
        match self.precision {
            Precision::F64 => Point3::origin(),
            Precision::F32 => original.bounding_box().center(),
        }
    }

    fn refuse(&self, error: cotan::Error, processing: &ProcessingMesh) -> CliError {
        CliError::Mesh {
            path: PathBuf::from(self.path),
            source: in_file_numbers(error, processing, self.file_vertices),
        }
    }
}

/// The edited positions in the coordinates of the mesh.
///
/// A vertex that has not moved keeps its exact position.
fn moved<T: Scalar>(
    before: &Positions<T>,
    after: &Positions<T>,
    processing: &ProcessingMesh,
    origin: Point3<f64>,
) -> Positions<f64> {
    let original = processing.positions().values();
    original
        .zip(before.values().zip(after.values()))
        .map(|(original, (before, after))| {
            if before == after {
                *original
            } else {
                origin + after.coords.map(Scalar::as_f64)
            }
        })
        .collect()
}

/// Measures the errors after every iteration, if requested.
struct Recorder<'a> {
    original: Surface<'a, f64>,
    /// The vertices of the flow, in its order.
    vertices: Vec<VertexId>,
    /// The measurements so far, or the error that stopped them.
    entries: Result<Option<Vec<HistoryEntry>>, cotan::Error>,
    /// Time spent on measurements, in seconds.
    seconds: f64,
}

impl<'a> Recorder<'a> {
    fn new(history: History, original: Surface<'a, f64>, vertices: Vec<VertexId>) -> Self {
        let entries = match history {
            History::Skip => None,
            History::Keep => Some(Vec::new()),
        };
        Self {
            original,
            vertices,
            entries: Ok(entries),
            seconds: 0.0,
        }
    }

    fn record<T: Scalar>(&mut self, flow: &Flow<T>, step: &StepReport) -> ControlFlow<()> {
        let Ok(Some(entries)) = &mut self.entries else {
            return ControlFlow::Continue(());
        };
        let clock = Instant::now();
        // Parts that follow are where they were until the run has ended.
        let mut now = self.original.positions().clone();
        for (v, p) in self.vertices.iter().zip(flow.positions().values()) {
            now[*v] = p.map(Scalar::as_f64);
        }
        let errors = ShapeErrors::measure(&self.original, &self.original.with_positions(&now));
        self.seconds += clock.elapsed().as_secs_f64();
        match errors {
            Ok(errors) => entries.push(HistoryEntry::new(step, &errors)),
            Err(error) => {
                self.entries = Err(error);
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }

    /// Returns the history and the seconds spent on it.
    fn finish(self) -> Result<(Option<Vec<HistoryEntry>>, f64), cotan::Error> {
        Ok((self.entries?, self.seconds))
    }
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

/// Reads a mesh file and builds its half-edge mesh.
pub(crate) fn load(
    path: &InputPath,
    seconds: &mut Seconds,
    console: &Console,
) -> Result<(Document, ProcessingMesh), CliError> {
    let clock = Instant::now();
    let document = crate::files::load(path, console)?;
    crate::memory::check(cotan_tool::Work::Build, path, &document)?;
    seconds.load = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let processing = document
        .surface()
        .map_err(|error| CliError::surface(path, error, Cure::Command, Weld::AsFormat))?;
    seconds.build = clock.elapsed().as_secs_f64();
    Ok((document, processing))
}
