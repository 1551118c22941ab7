//! `cotan smooth` and `cotan detail`: filtering and editing of curvature.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use cotan::geometry::{Positions, Surface, folded_faces};
use cotan::halfedge::VertexMap;
use cotan::smooth::{
    DetailOptions, Displacement, NormalError, ScaledCurvature, SmoothOptions, TargetCurvature,
    TransferredCurvature, edit_detail_observed, mean_curvature_rms, smooth,
};
use cotan::{Handles, smooth::Smoothed};
use cotan_io::{Document, ProcessingMesh};
use cotan_tool::numbers::in_file_numbers;
use serde::Serialize;

use crate::args::{DetailArgs, InputPath, KeepArgs, MeshArgs, SmoothArgs};
use crate::commands::compare::check_same_faces;
use crate::commands::repair::forgotten;
use crate::console::Console;
use crate::edit::positions_of;
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::picture::curvature_picture;
use crate::prepare::{self, Prepared};
use crate::report::{Seconds, Table, counted, number, write_json};
use crate::text::Text;
use crate::threads;

/// The machine-readable report of smoothing.
#[derive(Clone, Debug, Default, Serialize)]
struct SmoothReport {
    vertices: usize,
    faces: usize,
    method: &'static str,
    /// The reason for the method, if it was chosen automatically.
    #[serde(skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
    iterations: usize,
    anchor: Option<f64>,
    /// Estimated standard deviation along the normals, in mean edge lengths.
    noise: Option<f64>,
    /// `null` for an open mesh.
    volume_before: Option<f64>,
    volume_after: Option<f64>,
    area_before: f64,
    area_after: f64,
    rms_displacement: f64,
    max_displacement: f64,
    mean_curvature_rms: Pair,
    flipped_faces: usize,
    /// Vertices left in place because faces around them would have flipped.
    kept_vertices: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    normal_error_degrees: Option<Pair>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rms_distance_to_truth: Option<Pair>,
    seconds: SmoothSeconds,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
struct Pair {
    before: f64,
    after: f64,
}

#[derive(Clone, Copy, Debug, Default, Serialize)]
struct SmoothSeconds {
    load: f64,
    build: f64,
    smooth: f64,
    total: f64,
}

pub(crate) fn run_smooth(args: &SmoothArgs, console: &Console) -> Result<(), CliError> {
    let work = Work::Smooth(args.options());
    run(&args.mesh, &args.keep, &work, console)
}

pub(crate) fn run_detail(args: &DetailArgs, console: &Console) -> Result<(), CliError> {
    let work = Work::Detail(args, args.options());
    run(&args.mesh, &args.keep, &work, console)
}

/// The work to do.
enum Work<'a> {
    Smooth(SmoothOptions),
    Detail(&'a DetailArgs, DetailOptions),
}

fn run(
    mesh: &MeshArgs,
    keep: &KeepArgs,
    work: &Work<'_>,
    console: &Console,
) -> Result<(), CliError> {
    let job = || job(mesh, keep, work, console);
    let report = threads::with_threads(keep.threads, job)??;
    if let Some(reason) = &report.reason {
        console.note(&Text::of(format_args!(
            "method {}: {reason}",
            report.method
        )));
    }
    console.note(&report.table());
    Ok(())
}

/// Reads, smooths, writes and measures.
fn job(
    mesh: &MeshArgs,
    keep: &KeepArgs,
    work: &Work<'_>,
    console: &Console,
) -> Result<SmoothReport, CliError> {
    let clock = Instant::now();
    let format = files::mesh_format(&mesh.output)?;
    let mut seconds = Seconds::default();
    let input = mesh.input();
    let source = input.source();
    let prepared = prepare::prepare(&source, &mut seconds, console)?;
    prepare::warn_weldable(&source, &prepared, console);
    let Prepared {
        mut document,
        processing,
        file_vertices,
        changes,
        ..
    } = prepared;
    let refuse = |error: cotan::Error| CliError::Mesh {
        path: mesh.mesh.to_path_buf(),
        source: in_file_numbers(error, &processing, file_vertices.as_ref()),
    };
    let smoothing = Instant::now();
    let mut report = work.run(&mesh.mesh, &document, &processing, console, &refuse)?;
    let smooth_seconds = smoothing.elapsed().as_secs_f64();
    let truth = keep.truth.as_ref();
    let truth = truth
        .map(|path| other_positions(&mesh.mesh, &document, &processing, path, console))
        .transpose()?;
    document
        .set_positions(&processing, &report.positions)
        .map_err(|e| files::in_file(&mesh.mesh, e))?;
    files::save(&document, &mesh.output, mesh.embed, console)?;
    for forgotten in forgotten(format, &changes) {
        console.warn(format_args!("{}: {forgotten}", mesh.output.display()));
    }
    let written = positions_of(&document, &processing);
    let surface =
        Surface::new(processing.mesh(), processing.positions()).map_err(|e| refuse(e.into()))?;
    let report = &mut report.report;
    report
        .measure(&surface, &written, truth.as_ref())
        .map_err(refuse)?;
    report.seconds = SmoothSeconds {
        load: seconds.load,
        build: seconds.build,
        smooth: smooth_seconds,
        total: clock.elapsed().as_secs_f64(),
    };
    if report.flipped_faces > 0 {
        console.warn(format_args!(
            "{} flipped against the neighbours",
            counted(report.flipped_faces, "face")
        ));
    }
    if let Some(path) = &keep.report {
        write_json(path, report)?;
    }
    if let Some(path) = &keep.picture {
        let picture = curvature_picture(processing.mesh(), processing.positions(), &written);
        files::write(path, &picture)?;
    }
    Ok(report.clone())
}

/// The new positions, and the report filled in so far.
struct Outcome {
    positions: Positions<f64>,
    report: SmoothReport,
}

impl Work<'_> {
    fn run(
        &self,
        path: &Path,
        document: &Document,
        processing: &ProcessingMesh,
        console: &Console,
        refuse: &impl Fn(cotan::Error) -> CliError,
    ) -> Result<Outcome, CliError> {
        let (mesh, positions) = (processing.mesh(), processing.positions());
        let max_memory = Some(memory::check(cotan_tool::Work::Smooth, path, document)?);
        match self {
            Self::Smooth(options) => {
                let options = options.max_memory(max_memory);
                let smoothed = smooth(
                    Surface::assume_checked(mesh, positions),
                    &Handles::new(),
                    &options,
                )
                .map_err(refuse)?;
                Ok(Outcome::from(smoothed))
            }
            Self::Detail(args, options) => {
                let surface = Surface::new(mesh, positions).map_err(|e| refuse(e.into()))?;
                let edit: Box<dyn cotan::smooth::CurvatureEdit> = match (&args.from, &args.field) {
                    (Some(other), _) => {
                        let x = other_positions(path, document, processing, other, console)?;
                        Box::new(TransferredCurvature::from(&surface.with_positions(&x)))
                    }
                    (_, Some(name)) => {
                        let field = field(path, document, processing, name)?;
                        Box::new(TargetCurvature::new(&surface, &field))
                    }
                    _ => Box::new(ScaledCurvature::by(args.scale.unwrap_or(1.0))),
                };
                let options = options.max_memory(max_memory);
                let observer = |_| ControlFlow::Continue(());
                let edited = edit_detail_observed(
                    Surface::assume_checked(mesh, positions),
                    &Handles::new(),
                    &edit,
                    &options,
                    &observer,
                )
                .map_err(refuse)?;
                let report = SmoothReport {
                    method: "detail",
                    iterations: options.iterations,
                    anchor: Some(options.anchor),
                    kept_vertices: edited.kept_vertices,
                    ..SmoothReport::default()
                };
                Ok(Outcome {
                    positions: edited.positions,
                    report,
                })
            }
        }
    }
}

impl From<Smoothed<f64>> for Outcome {
    fn from(smoothed: Smoothed<f64>) -> Self {
        Self {
            report: SmoothReport {
                method: smoothed.method.name(),
                reason: smoothed.reason,
                iterations: smoothed.iterations,
                anchor: smoothed.anchor,
                kept_vertices: smoothed.kept_vertices,
                noise: smoothed.noise.map(|n| n.noise),
                ..SmoothReport::default()
            },
            positions: smoothed.positions,
        }
    }
}

impl SmoothReport {
    /// Measures `after` against the original surface, and both against the truth.
    fn measure(
        &mut self,
        surface: &Surface<'_, f64>,
        after: &Positions<f64>,
        truth: Option<&Positions<f64>>,
    ) -> Result<(), cotan::Error> {
        let smoothed = surface.with_positions(after);
        let is_closed = surface.mesh().is_closed();
        let moves = Displacement::measure(surface, &smoothed);
        self.vertices = surface.mesh().num_vertices();
        self.faces = surface.mesh().num_faces();
        self.volume_before = is_closed.then(|| surface.volume());
        self.volume_after = is_closed.then(|| smoothed.volume());
        self.area_before = surface.area();
        self.area_after = smoothed.area();
        self.rms_displacement = moves.rms;
        self.max_displacement = moves.max;
        self.mean_curvature_rms = Pair {
            before: mean_curvature_rms(surface),
            after: mean_curvature_rms(&smoothed),
        };
        self.flipped_faces = folded_faces(surface, after)?.len();
        if let Some(truth) = truth {
            let truth = surface.with_positions(truth);
            let compare = |measure: &dyn Fn(&Surface<'_, f64>) -> f64| Pair {
                before: measure(surface),
                after: measure(&smoothed),
            };
            self.normal_error_degrees = Some(compare(&|s| NormalError::measure(&truth, s).mean));
            self.rms_distance_to_truth = Some(compare(&|s| Displacement::measure(&truth, s).rms));
        }
        Ok(())
    }

    fn table(&self) -> Text {
        let mut table = Table::default();
        table.row(
            "vertices, faces",
            format!("{}, {}", self.vertices, self.faces),
        );
        table.row("method", self.method);
        table.row("iterations", self.iterations);
        if let Some(noise) = self.noise {
            table.row("noise", format!("{} mean edge lengths", number(noise)));
        }
        let pair = |pair: &Pair| format!("{} -> {}", number(pair.before), number(pair.after));
        if let (Some(before), Some(after)) = (self.volume_before, self.volume_after) {
            let change = 100.0 * (after / before - 1.0);
            let volumes = pair(&Pair { before, after });
            let sign = if change > 0.0 { "+" } else { "" };
            table.row("volume", format!("{volumes} ({sign}{} %)", number(change)));
        }
        let area = Pair {
            before: self.area_before,
            after: self.area_after,
        };
        table.row("area", pair(&area));
        table.row("mean curvature, rms", pair(&self.mean_curvature_rms));
        table.row("move, rms", number(self.rms_displacement));
        table.row("longest move", number(self.max_displacement));
        if let Some(error) = &self.normal_error_degrees {
            table.row("normal error, degrees", pair(error));
        }
        if let Some(distance) = &self.rms_distance_to_truth {
            table.row("distance to truth, rms", pair(distance));
        }
        table.row("seconds", number(self.seconds.total));
        table.text
    }
}

/// The positions of another file with the same faces, in the order of the processing mesh.
fn other_positions(
    path: &Path,
    document: &Document,
    processing: &ProcessingMesh,
    other_path: &InputPath,
    console: &Console,
) -> Result<Positions<f64>, CliError> {
    let other = files::load(other_path, console)?;
    check_same_faces([path, other_path], [document, &other])?;
    Ok(positions_of(&other, processing))
}

/// A field of the file with one number per vertex.
fn field(
    path: &Path,
    document: &Document,
    processing: &ProcessingMesh,
    name: &str,
) -> Result<VertexMap<f64>, CliError> {
    let attributes = document.attributes().map_err(|e| files::in_file(path, e))?;
    let missing = || {
        let names: Vec<&str> = attributes
            .vertices
            .iter()
            .filter(|p| p.components == 1)
            .map(|p| p.name.as_str())
            .collect();
        CliError::NoField {
            path: path.to_owned(),
            name: name.to_owned(),
            known: if names.is_empty() {
                "none".to_owned()
            } else {
                names.join(", ")
            },
        }
    };
    let property = attributes.vertex(name).ok_or_else(missing)?;
    if property.components != 1 {
        return Err(missing());
    }
    let mesh = processing.mesh();
    mesh.vertices()
        .map(|v| {
            let value = property.values.get(processing.document_vertex(v));
            value.filter(|x| x.is_finite()).ok_or_else(missing)
        })
        .collect()
}
