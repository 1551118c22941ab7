//! `cotan deform`: moves handles and lets the surface follow.

use std::time::Instant;

use cotan::{DeformOptions, Parts};
use cotan::flow::StopReason;
use cotan_io::ProcessingMesh;
use cotan_tool::Work;
use cotan_tool::handles_file::{self, Constraint, FileVertices, HandlesFile, PartSettings};
use cotan_tool::part_names::PartNames;

use crate::args::{DeformArgs, InputArgs, RunArgs};
use crate::commands::repair::forgotten;
use crate::console::Console;
use crate::edit::{Edit, Edited, History};
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::parts;
use crate::paths;
use crate::picture::{BeforeAfter, marks};
use crate::prepare::{self, Prepared};
use crate::report::{Report, Seconds, Setting, counted};
use crate::threads;

pub(crate) fn run(args: &DeformArgs, console: &Console) -> Result<(), CliError> {
    let job = Job {
        input: &args.input,
        run: &args.run,
        options: args.options(),
        soft: args.soft,
        at_limit: AtLimit::Warn,
        loose: Loose::Follow(args.parts.settings()?),
    };
    let report = threads::with_threads(args.run.threads, || job.run(console))??;
    console.note(&report.table());
    Ok(())
}

/// The work that `deform` and `reconstruct` share: read the files, edit, write the files.
pub(crate) struct Job<'a> {
    pub(crate) input: &'a InputArgs,
    pub(crate) run: &'a RunArgs,
    pub(crate) options: DeformOptions,
    pub(crate) soft: Option<f64>,
    pub(crate) at_limit: AtLimit,
    pub(crate) loose: Loose,
}

/// The treatment of parts of the mesh that have no handle.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Loose {
    /// The parts follow the others, as far as these settings and the handles file say so.
    Follow(PartSettings),
    /// The job is refused.
    Refuse,
}

/// The meaning of reaching the iteration limit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum AtLimit {
    /// The shape has not converged, which deserves a warning.
    Warn,
    /// The number of iterations was requested.
    Expected,
}

impl Job<'_> {
    /// Reads, edits and writes, and prints warnings.
    pub(crate) fn run(&self, console: &Console) -> Result<Report, CliError> {
        let clock = Instant::now();
        let format = files::mesh_format(&self.input.output)?;
        let handles = HandlesFile {
            path: &self.input.handles,
            def: self.input.def.as_deref(),
            max_bytes: memory::limits().max_bytes,
        };
        if let Some(matrix) = handles.matrix_beside() {
            paths::check_read("the matrix of --handles", &matrix)?;
        }
        let progress = console.progress(self.options.iteration_limit);
        progress.phase("load");
        let mut seconds = Seconds::default();
        let source = self.input.source();
        let prepared = prepare::prepare(&source, &mut seconds, console)?;
        let Prepared {
            mut document,
            processing,
            file_vertices,
            changes,
            ..
        } = prepared;
        let mut options = self.options.clone();
        let left = memory::check(Work::Deform, &self.input.mesh, &document)?;
        options.system.max_memory = Some(left);
        let constraints = handles.read(&document, &processing, file_vertices.as_ref())?;
        let names = PartNames::new(&document, &processing)
            .map_err(|error| files::in_file(&self.input.mesh, error))?;
        let mut held = Vec::new();
        if let Loose::Follow(settings) = &self.loose {
            let settings = handles.read_parts()?.overridden_by(settings.clone());
            options = settings.apply(options, &names).map_err(|source| CliError::Part {
                path: self.input.mesh.to_path_buf(),
                source,
            })?;
            if options.parts == Parts::Still {
                held = held_still(&constraints, &processing, file_vertices.as_ref(), console);
            }
        }
        if !held.is_empty()
            && let Some(weldable) = prepare::weldable(&document, source.weld)
        {
            console.warn(format_args!("{}: {weldable}", source.path.display()));
        }
        let all = [constraints.as_slice(), &held].concat();
        let edit = Edit {
            path: &self.input.mesh,
            constraints: &all,
            options: &options,
            soft: self.soft,
            precision: self.run.precision,
            history: if self.run.history {
                History::Keep
            } else {
                History::Skip
            },
            file_vertices: file_vertices.as_ref(),
        };
        let edited = edit.run(&mut document, &processing, &mut seconds, &progress)?;
        drop(progress);

        files::save(&document, &self.input.output, self.input.embed, console)?;
        for forgotten in forgotten(format, &changes) {
            console.warn(format_args!("{}: {forgotten}", self.input.output.display()));
        }
        let parts = parts::fields(&edited.parts, &names);
        self.warn(&edited, console);
        if let Some(warning) = parts::warning(&parts) {
            console.warn(&warning);
        }
        seconds.total = clock.elapsed().as_secs_f64();
        let setting = Setting {
            faces: processing.mesh().num_faces(),
            handles: constraints.len(),
            options: &self.options,
            precision: self.run.precision,
            seconds,
            parts: &parts,
        };
        let report = Report::new(&edited, setting);
        if let Some(path) = &self.run.report {
            report.write(path)?;
        }
        if let Some(path) = &self.run.picture {
            let pair = BeforeAfter {
                mesh: processing.mesh(),
                before: processing.positions(),
                after: &edited.positions,
                marks: &marks(&all, &processing),
            };
            files::write(path, &pair.png())?;
        }
        Ok(report)
    }

    fn warn(&self, edited: &Edited, console: &Console) {
        let flow = &edited.flow;
        let (change, iterations) = (flow.change, counted(flow.iterations, "iteration"));
        match flow.stop {
            StopReason::IterationLimit if self.at_limit == AtLimit::Warn => {
                console.warn(format_args!(
                    "not converged after {iterations} (the last moved a vertex by \
                     {change:.1e} of the diagonal); raise --iterations, or try another \
                     --orientation"
                ));
            }
            StopReason::Diverged => console.warn(format_args!(
                "diverged after {iterations}; the last finite shape was \
                 written; try another --orientation or --scheme clamped"
            )),
            StopReason::Stalled => console.warn(format_args!(
                "stopped after {iterations} before the tolerance was met: within rounding, no step \
                 leads further"
            )),
            _ => {}
        }
        if let Some(angle) = flow.lost_turn {
            console.warn(format_args!(
                "a turn of more than half a turn was lost: a part of the shape came to lie {:.0}° \
                 from where it was wound to; a body holds about 85° to 110° of twist for each of \
                 its diameters between the handles",
                angle.to_degrees()
            ));
        }
        let flipped = edited.quality.flipped_faces;
        if flipped > 0 {
            console.warn(format_args!(
                "{} flipped against the neighbours",
                counted(flipped, "face")
            ));
        }
    }
}

/// Adds handles that fix everything without a handle, and warns about them.
fn held_still(
    constraints: &[Constraint],
    processing: &ProcessingMesh,
    file_vertices: Option<&FileVertices>,
    console: &Console,
) -> Vec<Constraint> {
    match handles_file::Loose::of(constraints, processing, file_vertices) {
        Some(loose) => {
            console.warn(&loose);
            loose.constraints
        }
        None => Vec::new(),
    }
}
