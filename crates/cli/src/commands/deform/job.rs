//! The job of `deform`, `reconstruct` and `demo`: reads handles, edits the mesh, reports.

use cotan::flow::{StopReason, predicted_point_handle_bytes};
use cotan::smooth::Mask;
use cotan::{DeformOptions, Parts};
use cotan_tool::Work;
use cotan_tool::handles_file::{self, Constraint, HandlesFile, PartSettings};
use cotan_tool::part_names::PartNames;

use super::args::{InputArgs, RunArgs};
use super::edit::{Edit, Edited, History, Region};
use super::report::{DeformReport, Setting};
use crate::args::values::Length;
use crate::args::{OutputPath, RegionArgs};
use crate::console::Console;
use crate::error::CliError;
use crate::memory;
use crate::part;
use crate::parts;
use crate::paths;
use crate::picture::{BeforeAfter, marks};
use crate::pipeline::{Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::report::counted;

/// An edit with the handles of a file.
pub(crate) struct DeformJob<'a> {
    pub(crate) input: &'a InputArgs,
    pub(crate) run: &'a RunArgs,
    pub(crate) options: DeformOptions,
    pub(crate) soft: Option<f64>,
    pub(crate) region: Option<&'a RegionArgs>,
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

/// The results of an edit in addition to its report.
pub(crate) struct Rest {
    edited: Edited,
    /// The handles, including those that hold parts without any.
    constraints: Vec<Constraint>,
}

impl Job for DeformJob<'_> {
    type Meshes = Prepared;
    type Report = DeformReport;
    type Rest = Rest;

    fn plan(&self) -> Plan<'_, Source> {
        Plan {
            sources: self.input.source(),
            output: &self.input.output,
            embed: self.input.embed,
            threads: self.run.threads,
            report: self.run.report.as_ref(),
            iterations: Some(self.options.iteration_limit),
        }
    }

    fn check(&self) -> Result<(), CliError> {
        match self.handles().default_matrix() {
            Some(matrix) => paths::check_read("the matrix of --handles", &matrix),
            None => Ok(()),
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<DeformReport, Rest>, CliError> {
        let mut options = self.options.clone();
        let left = mesh.check_memory(Work::Deform)?;
        let file_vertices = mesh.file_vertices.as_ref();
        let read = self.handles();
        let mut constraints = read.read(&mesh.document, &mesh.processing, file_vertices)?;
        let num_handles = constraints.len();
        let names = PartNames::new(&mesh.document, &mesh.processing);
        let names = names.map_err(|error| mesh.in_file(error))?;
        let region = self.region(mesh)?;
        if let Loose::Follow(settings) = &self.loose {
            let settings = read.read_parts()?.overridden_by(settings.clone());
            let applied = settings.apply(options, &names);
            options = applied.map_err(|source| CliError::Part {
                path: self.input.mesh.to_path_buf(),
                source,
            })?;
            // Outside of a region nothing moves.
            if options.parts == Parts::Still || region.is_some() {
                constraints.extend(held_still(&constraints, mesh, context.console));
            } else if mesh.processing.mesh().components().count() > 1 {
                // Parts follow each other as parts, although welding would join them.
                mesh.warn_weldable(context.console);
            }
        }
        let held = constraints.iter();
        let vertices = held.filter_map(|c| mesh.processing.vertex(c.vertex));
        let by_points = predicted_point_handle_bytes(mesh.processing.mesh(), vertices);
        options.system.max_memory = Some(left.saturating_sub(by_points));
        let edit = Edit {
            constraints: &constraints,
            options: &options,
            soft: self.soft,
            region,
            precision: self.run.precision,
            history: if self.run.history {
                History::Keep
            } else {
                History::Skip
            },
        };
        let edited = edit.run(mesh, &context.progress)?;
        let parts = parts::fields(&edited.parts, &names);
        if let Some(warning) = parts::stranded(&edited.parts, &names, &options) {
            context.console.warn(&warning);
        }
        let setting = Setting {
            faces: mesh.processing.mesh().num_faces(),
            handles: num_handles,
            options: &self.options,
            precision: self.run.precision,
            parts,
        };
        Ok(Finished {
            mesh: Output::InPlace,
            report: DeformReport::new(&edited, setting),
            rest: Rest {
                edited,
                constraints,
            },
        })
    }

    fn after_save(
        &self,
        mesh: &Prepared,
        finished: &mut Finished<DeformReport, Rest>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        self.warn(&finished.rest.edited, context.console);
        self.note_instances(mesh, context.console);
        if let Some(warning) = parts::warning(&finished.report.parts) {
            context.console.warn(&warning);
        }
        Ok(())
    }

    fn picture(
        &self,
        mesh: &Prepared,
        finished: &Finished<DeformReport, Rest>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.run.picture.as_ref()?;
        let pair = BeforeAfter {
            mesh: mesh.processing.mesh(),
            before: mesh.processing.positions(),
            after: &finished.rest.edited.positions,
            marks: &marks(&finished.rest.constraints, &mesh.processing),
        };
        Some((path, pair.png()))
    }
}

impl DeformJob<'_> {
    /// The region of `--region`, if there is one.
    fn region(&self, mesh: &Prepared) -> Result<Option<Region>, CliError> {
        let Some(args) = self.region else {
            return Ok(None);
        };
        let (selection, file) = (args.region.as_ref(), args.region_file.as_ref());
        let Some(vertices) = part::region(selection, file, mesh)? else {
            return Ok(None);
        };
        let surface = mesh.processing.surface();
        let falloff = args.falloff.unwrap_or(Length::Absolute(0.0));
        let falloff = falloff.on(surface.bounding_box().longest_side());
        let mask = Mask::inside(&surface, &vertices, falloff);
        Ok(Some(Region {
            mask: mask.map_err(|error| mesh.refuse(error))?,
            vertices,
        }))
    }

    fn handles(&self) -> HandlesFile<'_> {
        HandlesFile {
            path: &self.input.handles,
            def: self.input.def.as_deref(),
            max_bytes: memory::limits().max_bytes,
        }
    }

    /// Says which of the meshes that have moved are shown several times.
    fn note_instances(&self, mesh: &Prepared, console: &Console) {
        let parts = mesh.document.parts().iter().enumerate();
        let shared = parts.filter(|&(part, _)| mesh.document.num_instances(part) > 1);
        let moved = shared.filter(|(_, part)| {
            let faces = part.faces.clone();
            let corners = faces.filter_map(|face| mesh.document.faces().get(face));
            corners
                .flatten()
                .any(|&v| mesh.document.has_moved(v as usize))
        });
        let moved: Vec<String> = moved
            .map(|(part, named)| match named.name.as_str() {
                "" => format!("mesh {part}"),
                name => format!("mesh {part} ({name})"),
            })
            .collect();
        if moved.is_empty() {
            return;
        }
        let more = match moved.len().saturating_sub(MAX_NAMES) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        console.warn(format_args!(
            "{}: moved wherever it is shown: {}{more}; with --make-unique every node has a mesh \
             of its own",
            self.input.output.display(),
            moved[..moved.len().min(MAX_NAMES)].join(", ")
        ));
    }

    /// Warns about a flow that did not converge and a shape with defects.
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
                "stopped after {iterations} before the tolerance was met: no step makes progress \
                 beyond rounding errors"
            )),
            _ => {}
        }
        if let Some(lost) = flow.lost_turn {
            console.warn(format_args!(
                "a turn of more than 180° was lost: a part of the shape turned back by {:.0}°; \
                 this shape holds about {:.0}° between its handles; turn them less, or use \
                 --hold-winding",
                lost.back.to_degrees(),
                lost.held.to_degrees()
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

/// The longest list of meshes in a note.
const MAX_NAMES: usize = 5;

/// Handles that fix everything without a handle, with a warning about them.
fn held_still(constraints: &[Constraint], mesh: &Prepared, console: &Console) -> Vec<Constraint> {
    let file_vertices = mesh.file_vertices.as_ref();
    let Some(loose) = handles_file::Loose::of(constraints, &mesh.processing, file_vertices) else {
        return Vec::new();
    };
    console.warn(&loose);
    if !loose.constraints.is_empty() {
        mesh.warn_weldable(console);
    }
    loose.constraints
}
