//! `cotan sphere`: maps a closed mesh onto the unit sphere without flipping a triangle.

pub(crate) mod args;
mod geometry_image;
mod picture;
mod polygons;
mod texture;
mod unused;
mod written;

use std::marker::PhantomData;

use cotan::geometry::Scalar;
use cotan::sphere::SphereOptions;
use cotan_io::Format;

use crate::args::{OutputPath, Precision};
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::pipeline::{self, Context, Finished, Job, Output, Plan};
use crate::prepare::{Prepared, Source};
use crate::sphere::{self, MapReport, Mapped, Mapper, WrittenSphere};

use args::SphereArgs;
use polygons::Upright;

pub(crate) fn run(args: &SphereArgs, console: &Console) -> Result<(), CliError> {
    match args.run.precision {
        Precision::F64 => pipeline::execute(&SphereJob::<f64>::new(args), console),
        Precision::F32 => pipeline::execute(&SphereJob::<f32>::new(args), console),
    }
}

/// The mapping of a mesh file in the number type `T`.
struct SphereJob<'a, T> {
    args: &'a SphereArgs,
    options: SphereOptions,
    number: PhantomData<T>,
}

impl<'a, T: Scalar> SphereJob<'a, T> {
    fn new(args: &'a SphereArgs) -> Self {
        Self {
            args,
            options: args.map.options(),
            number: PhantomData,
        }
    }
}

impl<T: Scalar> Job for SphereJob<'_, T> {
    type Meshes = Prepared;
    type Report = MapReport;
    type Rest = Mapped<T>;

    fn plan(&self) -> Plan<'_, Source> {
        let input = &self.args.input;
        Plan {
            sources: input.mending.source(&input.mesh),
            output: &self.args.output,
            embed: self.args.embed,
            threads: self.args.run.threads,
            report: self.args.run.report.as_ref(),
            iterations: Some(self.options.iteration_limit),
        }
    }

    fn run(
        &self,
        mesh: &mut Prepared,
        context: &Context<'_>,
    ) -> Result<Finished<MapReport, Mapped<T>>, CliError> {
        let mapper = Mapper {
            mesh,
            options: &self.options,
            turn: self.args.turn.turn(),
        };
        let mapped = mapper.run::<T>(&context.progress)?;
        let written = self.place(mesh, &mapped, context.format)?;
        let report = MapReport::new(&mapped, &self.options, self.args.run.precision);
        Ok(Finished {
            mesh: Output::InPlace,
            report: report.written(&written),
            rest: mapped,
        })
    }

    fn after_save(
        &self,
        mesh: &Prepared,
        finished: &mut Finished<MapReport, Mapped<T>>,
        context: &Context<'_>,
    ) -> Result<(), CliError> {
        let (mapped, console) = (&finished.rest, context.console);
        let output = &self.args.output;
        written::warn_of_short_numbers(output, context.format, mapped, &mesh.processing, console)?;
        sphere::warn(&mapped.report, &self.options, console);
        if let Some(path) = &self.args.geometry_image {
            let drawn = geometry_image::geometry_image(mapped, self.args.size);
            let (png, fields) = drawn.map_err(|error| sphere::refuse(mesh, error))?;
            files::write(path, &png)?;
            finished.report.geometry_image = Some(fields);
        }
        Ok(())
    }

    fn picture(
        &self,
        _: &Prepared,
        finished: &Finished<MapReport, Mapped<T>>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        let path = self.args.picture.as_ref()?;
        Some((path, picture::area_picture(&finished.rest)))
    }
}

impl<T: Scalar> SphereJob<'_, T> {
    /// Moves all vertices of the document to the sphere.
    ///
    /// Polygons are replaced so that every reader of `format` cuts them without a flip.
    fn place(
        &self,
        mesh: &mut Prepared,
        mapped: &Mapped<T>,
        format: Format,
    ) -> Result<WrittenSphere, CliError> {
        let Prepared {
            source,
            document: original,
            processing,
            ..
        } = mesh;
        let in_file = |error| files::in_file(&source.path, error);
        let mut document = original.clone();
        document
            .set_positions(processing, mapped.map.positions())
            .map_err(in_file)?;
        unused::join_welded(&mut document, processing).map_err(in_file)?;
        let before = original.positions();
        let unused_vertices =
            unused::place_unused(&mut document, before, mapped, processing).map_err(in_file)?;
        let sphericity_error = unused::sphericity_error(&document);
        if self.args.uv {
            document = texture::with_texture(document, mapped, processing).map_err(in_file)?;
        }
        let Upright {
            document,
            written_as_triangles,
        } = polygons::upright(document, format, processing).map_err(in_file)?;
        *original = document;
        Ok(WrittenSphere {
            unused_vertices,
            written_as_triangles,
            sphericity_error,
        })
    }
}
