//! `cotan merge`: parts of two meshes become one, without a seam.

pub(crate) mod args;
mod report;

use cotan::geometry::{Mesh, Surface};
use cotan::halfedge::{FaceMap, VertexId, VertexMap};
use cotan::merge::{Input, MergeError, MergeOptions, Merged, Placement, faces_within, merge};
use cotan::smooth::curvature_field;
use cotan_io::Repair;
use cotan_tool::Work;
use cotan_tool::merged::{MergeSource, merged_document};

use crate::args::{InputPath, OutputPath, Selection};
use crate::console::Console;
use crate::error::CliError;
use crate::part;
use crate::picture::{ColorScale, HeatMap, Panel, Quantity, Views};
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::sphere;

use args::{MergeArgs, Place};
use report::MergeReport;

pub(crate) fn run(args: &MergeArgs, console: &Console) -> Result<(), CliError> {
    pipeline::execute(&MergeJob { args }, console)
}

struct MergeJob<'a> {
    args: &'a MergeArgs,
}

impl Job for MergeJob<'_> {
    type Meshes = [Prepared; 2];
    type Report = MergeReport;
    /// The merged mesh.
    type Rest = Mesh<f64>;

    fn plan(&self) -> Plan<'_, [Source; 2]> {
        let args = self.args;
        let source = |path| Source::new(path, args.repair.then(Repair::default), args.weld);
        Plan {
            sources: [source(&args.first), source(&args.second)],
            output: &args.output,
            embed: args.embed,
            threads: args.threads,
            report: args.report.as_ref(),
            iterations: None,
        }
    }

    fn run(
        &self,
        meshes: &mut [Prepared; 2],
        context: &Context<'_>,
    ) -> Result<Finished<MergeReport, Mesh<f64>>, CliError> {
        let args = self.args;
        let mut memory = u64::MAX;
        for mesh in meshes.iter() {
            memory = memory.min(mesh.check_memory(Work::Deform)?);
        }
        let selections = [
            (args.keep_a.as_ref(), args.keep_a_file.as_ref()),
            (args.keep_b.as_ref(), args.keep_b_file.as_ref()),
        ];
        let keep = [
            kept_faces(&meshes[0], selections[0])?,
            kept_faces(&meshes[1], selections[1])?,
        ];
        let options = self.options(meshes, memory)?;
        context.progress.phase("merge");
        let [a, b] = [0, 1].map(|k| meshes[k].processing.surface());
        let merged = merge(a, &keep[0], b, &keep[1], &options);
        let merged = merged.map_err(|error| refuse(meshes, error))?;
        let inputs = [0, 1].map(|k| MergeSource {
            document: &meshes[k].document,
            processing: &meshes[k].processing,
        });
        let assembled = merged_document(inputs, &merged)?;
        for loss in &assembled.losses {
            context.console.warn(format_args!("{loss}"));
        }
        let report = MergeReport::new(&merged, assembled.losses);
        warn(&merged, context.console);
        Ok(Finished {
            mesh: Output::New(assembled.document),
            report,
            rest: merged.mesh,
        })
    }

    fn picture(
        &self,
        meshes: &[Prepared; 2],
        finished: &Finished<MergeReport, Mesh<f64>>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.args.picture.as_ref()?;
        let surfaces = [
            meshes[0].processing.surface(),
            meshes[1].processing.surface(),
            finished.rest.surface(),
        ];
        Some((path, picture(surfaces)))
    }
}

impl MergeJob<'_> {
    fn options(&self, meshes: &[Prepared; 2], memory: u64) -> Result<MergeOptions, CliError> {
        let args = self.args;
        let mut options = MergeOptions::default().band(args.band).max_memory(memory);
        if args.place == Place::Fit {
            options = options.placement(Placement::Fit);
        }
        if let Some(path) = &args.landmarks {
            options = options.landmarks(sphere::pairs(path, meshes)?);
        }
        if let Some(pairs) = &args.loops {
            options = options.loops(pairs.0.clone());
        }
        if args.no_blend {
            options = options.iterations(0_usize);
        }
        Ok(options)
    }
}

/// The faces that a selection keeps: of the polygons of the file, those that it contains whole.
fn kept_faces(
    mesh: &Prepared,
    (selection, file): (Option<&Selection>, Option<&InputPath>),
) -> Result<FaceMap<bool>, CliError> {
    let surface = mesh.processing.surface();
    let vertices = part::region(selection, file, mesh)?.unwrap_or_default();
    let mut is_selected = VertexMap::filled(surface.mesh().num_vertices(), false);
    for v in vertices {
        is_selected[v] = true;
    }
    let mut keep = faces_within(&surface, &is_selected);
    let mut is_whole = vec![true; mesh.document.faces().len()];
    for (f, keep) in keep.iter() {
        is_whole[mesh.processing.document_face(f)] &= *keep;
    }
    for (f, keep) in keep.iter_mut() {
        *keep = is_whole[mesh.processing.document_face(f)];
    }
    Ok(keep)
}

/// The error with the name of the file at fault and its own indices.
fn refuse(meshes: &[Prepared; 2], error: MergeError) -> CliError {
    let which = match &error {
        MergeError::InsideOut { input, .. }
        | MergeError::KeepLength { input, .. }
        | MergeError::NothingKept { input }
        | MergeError::NothingCut { input }
        | MergeError::CutMeetsRim { input, .. }
        | MergeError::LandmarkOutOfRange { input, .. } => *input,
        _ => Input::A,
    };
    let mesh = match which {
        Input::A => &meshes[0],
        Input::B => &meshes[1],
    };
    let in_file = |v| VertexId::new(mesh.processing.document_vertex(v));
    let error = match error {
        MergeError::InsideOut { input, vertex } => MergeError::InsideOut {
            input,
            vertex: in_file(vertex),
        },
        MergeError::CutMeetsRim { input, vertex } => MergeError::CutMeetsRim {
            input,
            vertex: in_file(vertex),
        },
        MergeError::Blend(error) => return mesh.refuse(error),
        other => other,
    };
    CliError::File {
        path: mesh.path().to_owned(),
        source: error.into(),
    }
}

fn warn(merged: &Merged<f64>, console: &Console) {
    let [now, before] = merged.report.self_intersections;
    if now > before {
        console.warn(format_args!(
            "{} faces intersect others, {before} did before; check the placement of the two \
             parts, or cut elsewhere",
            now
        ));
    }
    let dropped: usize = merged.report.dropped.iter().sum();
    if dropped > 0 {
        console.warn(format_args!(
            "{dropped} selected faces were dropped: they touch the kept part only at a corner, or lie \
             apart from it"
        ));
    }
}

/// Both meshes and the result, coloured by mean curvature.
fn picture(surfaces: [Surface<'_, f64>; 3]) -> Vec<u8> {
    let curvatures = surfaces.map(|surface| curvature_field(&surface));
    let all = curvatures.iter().flat_map(|field| field.values().copied());
    let scale = ColorScale::signed("mean curvature, in one over the unit of the mesh", all);
    let captions = ["A", "B", "merged"];
    let panels: Vec<Panel<'_>> = (0..3)
        .map(|k| Panel {
            mesh: surfaces[k].mesh(),
            positions: surfaces[k].positions(),
            quantity: Quantity::Vertices(&curvatures[k]),
            caption: captions[k],
        })
        .collect();
    let map = HeatMap {
        panels: &panels,
        scale: &scale,
        views: Views::OneDirection,
    };
    map.png()
}
