//! The edit shared by `deform`, `reconstruct` and `demo`: moves the handles of a prepared mesh.

use std::ops::ControlFlow;
use std::time::Instant;

use cotan::flow::{Flow, Report as FlowReport, StepReport};
use cotan::geometry::{Positions, Scalar, Surface};
use cotan::halfedge::VertexId;
use cotan::linear::Hold;
use cotan::smooth::Mask;
use cotan::{DeformOptions, PartReport, Quality, Session, ShapeErrors};
use cotan_io::ProcessingMesh;
use cotan_tool::handles_file::{Constraint, to_handles};
use nalgebra::Point3;
use serde::Serialize;

use crate::args::Precision;
use crate::console::Progress;
use crate::error::CliError;
use crate::prepare::Prepared;

/// The parameters of an edit.
#[derive(Debug)]
pub(crate) struct Edit<'a> {
    pub(crate) constraints: &'a [Constraint],
    pub(crate) options: &'a DeformOptions,
    /// Weight of the handles that have none of their own; `None` holds them exactly.
    pub(crate) soft: Option<f64>,
    /// `None` for the whole mesh.
    pub(crate) region: Option<Region>,
    pub(crate) precision: Precision,
    pub(crate) history: History,
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
    /// The positions that the document stores, in the order of the processing mesh.
    pub(crate) positions: Positions<f64>,
    pub(crate) flow: FlowReport,
    pub(crate) quality: Quality,
    pub(crate) history: Option<Vec<HistoryEntry>>,
    /// The roles of the parts; empty for a model of one part.
    pub(crate) parts: Vec<PartReport>,
    pub(crate) seconds: EditSeconds,
}

/// Durations of the phases of an edit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EditSeconds {
    /// Weights, assembly and factorization.
    pub(crate) factor: f64,
    /// All iterations, without the measurements of the history.
    pub(crate) iterate: f64,
}

/// One iteration.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub(crate) struct HistoryEntry {
    pub(crate) iteration: usize,
    pub(crate) change: f64,
    pub(crate) parameterization_error: f64,
    pub(crate) geometry_error: f64,
}

impl HistoryEntry {
    pub(crate) fn new(step: &StepReport, errors: &ShapeErrors) -> Self {
        Self {
            iteration: step.iteration,
            change: step.change,
            parameterization_error: errors.parameterization,
            geometry_error: errors.geometry,
        }
    }
}

/// The only vertices that an edit moves, and the share of the motion of each.
#[derive(Debug)]
pub(crate) struct Region {
    pub(crate) vertices: Vec<VertexId>,
    pub(crate) mask: Mask,
}

impl Edit<'_> {
    /// Moves the handles and sets the positions of the document.
    ///
    /// # Errors
    /// [`CliError::Mesh`] for a mesh that cannot be edited with these handles.
    pub(crate) fn run(&self, mesh: &mut Prepared, progress: &Progress) -> Result<Edited, CliError> {
        match self.precision {
            Precision::F64 => self.run_as::<f64>(mesh, progress),
            Precision::F32 => self.run_as::<f32>(mesh, progress),
        }
    }

    fn run_as<T: Scalar>(
        &self,
        mesh: &mut Prepared,
        progress: &Progress,
    ) -> Result<Edited, CliError> {
        let processing = &mesh.processing;
        let original = Surface::new(processing.mesh(), processing.positions())
            .map_err(|e| mesh.refuse(e.into()))?;

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
        let surface = Surface::assume_checked(processing.mesh(), &positions);
        let session = match &self.region {
            None => Session::new(surface, &handles, self.options),
            Some(region) => {
                let flow = self.options.flow(surface);
                Session::from_flow(flow.region(region.vertices.iter().copied()), &handles)
            }
        };
        let mut session = session.map_err(|e| mesh.refuse(e))?;
        let factor = clock.elapsed().as_secs_f64();
        tracing::info!("system solved by {}", session.flow().system().choice());

        progress.phase("iterate");
        let clock = Instant::now();
        let mut recorder = Recorder::new(self.history, original, session.flow_vertices());
        let flow = session.run_observed(|flow, step| {
            progress.step(step.iteration, step.change);
            recorder.record(flow, step)
        });
        let (history, measuring) = recorder.finish().map_err(|e| mesh.refuse(e))?;
        let flow = flow.map_err(|e| mesh.refuse(e))?;
        let iterate = clock.elapsed().as_secs_f64() - measuring;

        let parts = session.parts();
        let mut moved = moved(&positions, &session.positions(), processing, origin);
        if let Some(region) = &self.region {
            moved = region.mask.blend(processing.positions(), &moved);
        }
        // Free the session: the measures need memory of their own.
        drop(session);
        let positions = mesh.set_positions(&moved)?;
        let original = Surface::assume_checked(mesh.processing.mesh(), mesh.processing.positions());
        let quality = Quality::measure(&original, &original.with_positions(&positions))
            .map_err(|e| mesh.refuse(e))?;
        Ok(Edited {
            positions,
            flow,
            quality,
            history,
            parts,
            seconds: EditSeconds { factor, iterate },
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
        let mut now = self.original.mesh().to_rows(self.original.positions());
        for (v, p) in self.vertices.iter().zip(flow.positions().values()) {
            now[*v] = p.map(Scalar::as_f64);
        }
        let now = self.original.mesh().to_vertices(now);
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
