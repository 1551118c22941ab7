//! `cotan geodesic`: distances along a mesh.

pub(crate) mod args;
mod report;

use cotan::geometry::{Surface, SurfacePoint, SurfaceTree};
use cotan::halfedge::VertexMap;
use cotan::surface::{DistanceError, GeodesicDistances, HeatOptions};
use cotan_io::{Property, Values};
use cotan_tool::Work;
use nalgebra::Point3;

use crate::args::OutputPath;
use crate::console::Console;
use crate::error::CliError;
use crate::picture::distance_picture;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};

use args::GeodesicArgs;
use report::GeodesicReport;

pub(crate) fn run(args: &GeodesicArgs, console: &Console) -> Result<(), CliError> {
    pipeline::execute(&GeodesicJob { args }, console)
}

struct GeodesicJob<'a> {
    args: &'a GeodesicArgs,
}

impl Job for GeodesicJob<'_> {
    type Meshes = Prepared;
    type Report = GeodesicReport;
    /// The distances, for the picture.
    type Rest = VertexMap<f64>;

    fn plan(&self) -> Plan<'_, Source> {
        Plan {
            sources: (&self.args.mesh).into(),
            output: &self.args.mesh.output,
            embed: self.args.mesh.embed,
            threads: self.args.threads,
            report: self.args.report.as_ref(),
            iterations: None,
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<GeodesicReport, VertexMap<f64>>, CliError> {
        let memory = mesh.check_memory(Work::Distances)?;
        let (halfedge, positions) = (mesh.processing.mesh(), mesh.processing.positions());
        let surface =
            Surface::new(halfedge, positions).map_err(|error| mesh.refuse(error.into()))?;
        let sources = self.sources(mesh, &surface)?;
        context.progress.phase("factorize");
        let options = HeatOptions::default()
            .time(self.args.time)
            .max_memory(memory / 2);
        let refuse = |source: DistanceError| CliError::Distances {
            path: mesh.path().to_owned(),
            source,
        };
        let prepared = GeodesicDistances::with_options(surface, &options).map_err(refuse)?;
        context.progress.phase("solve");
        let distances = prepared.from_points(&sources).map_err(refuse)?;
        let flips = prepared.num_flips();
        let report = GeodesicReport::new(mesh, sources.len(), flips, &distances);

        let mut attributes = mesh
            .document
            .attributes()
            .map_err(|error| mesh.in_file(error))?
            .into_owned();
        attributes.vertices.retain(|property| property.name != NAME);
        attributes.vertices.push(Property {
            name: NAME.to_owned(),
            components: 1,
            values: Values::F64(in_file_order(mesh, &distances)),
        });
        let document = mesh.document.clone().with_attributes(attributes);
        mesh.document = document.map_err(|error| mesh.in_file(error))?;
        Ok(Finished {
            mesh: Output::InPlace,
            report,
            rest: distances,
        })
    }

    fn picture(
        &self,
        mesh: &Prepared,
        finished: &Finished<GeodesicReport, VertexMap<f64>>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.args.picture.as_ref()?;
        let (halfedge, positions) = (mesh.processing.mesh(), mesh.processing.positions());
        let lines = self.args.lines.get();
        Some((
            path,
            distance_picture(halfedge, positions, &finished.rest, lines),
        ))
    }
}

impl GeodesicJob<'_> {
    /// The vertices and points of the command line on the surface.
    fn sources(
        &self,
        mesh: &Prepared,
        surface: &Surface<'_, f64>,
    ) -> Result<Vec<SurfacePoint>, CliError> {
        let mut sources = Vec::with_capacity(self.args.from.len() + self.args.at.len());
        for &index in &self.args.from {
            // A repair may have split the vertex.
            let copies = match &mesh.file_vertices {
                Some(file) => file.in_document(index).collect(),
                None => vec![index],
            };
            let on_surface = |vertex: usize| {
                let v = mesh.processing.vertex(vertex)?;
                SurfacePoint::at_vertex(surface.mesh(), v)
            };
            let before = sources.len();
            sources.extend(copies.into_iter().filter_map(on_surface));
            if sources.len() == before {
                return Err(CliError::NoVertex {
                    path: mesh.path().to_owned(),
                    vertex: index,
                    num_vertices: mesh.document.positions().len(),
                });
            }
        }
        if !self.args.at.is_empty() {
            let tree = SurfaceTree::new(*surface);
            sources.extend(
                self.args
                    .at
                    .iter()
                    .map(|at| tree.closest(&Point3::from(*at)).on),
            );
        }
        Ok(sources)
    }
}

/// One number per vertex of the document; infinite for vertices that no face uses.
fn in_file_order(mesh: &Prepared, distances: &VertexMap<f64>) -> Vec<f64> {
    let of_document = |vertex| {
        let v = mesh.processing.vertex(vertex);
        v.map_or(f64::INFINITY, |v| distances[v])
    };
    (0..mesh.document.positions().len())
        .map(of_document)
        .collect()
}

/// The name of the property.
const NAME: &str = "distance";
