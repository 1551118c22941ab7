//! The filter of `detail --map`.

use cotan::detail::{
    BaseOptions, BaseSurface, Correspondence, Detail, DetailError, Stretch, Wavelength,
};
use cotan::geometry::Surface;
use cotan::merge::Similarity;
use cotan::sphere::SphereOptions;
use cotan_tool::Work;

use super::args::{DetailArgs, MapBy};
use super::map_file;
use crate::args::InputPath;
use crate::commands::smooth::{Filter, Filtered, SmoothReport, TransferReport};
use crate::error::CliError;
use crate::part;
use crate::paths;
use crate::pipeline::Context;
use crate::prepare::{Prepared, Source, Surfaces, prepare};
use crate::report::{Seconds, counted};
use crate::sphere::{self, Common, Mapped, Mapper, Turn};

/// Details of another mesh.
pub(super) struct Transfer<'a> {
    pub(super) args: &'a DetailArgs,
    pub(super) map: &'a MapBy,
    pub(super) source: &'a InputPath,
}

impl Filter for Transfer<'_> {
    fn run(&self, mesh: &Prepared, context: &Context<'_>) -> Result<Filtered, CliError> {
        if let MapBy::File(path) = self.map {
            paths::check_read("the file of --map", path)?;
        }
        let source = Source::new(self.source, None, self.args.mesh.weld).surfaces(Surfaces::Any);
        let source = prepare(source, &mut Seconds::default(), context.console)?;
        context.progress.phase("bases");
        let from = base(&source, self.args.wavelength())?;
        let to = base(mesh, from.wavelength())?;
        let map = self.correspondence([mesh, &source], [&to, &from], context)?;
        let refuse = |error| refuse(mesh, error);
        let stretch = Stretch::measure(&map, &from, &to).map_err(refuse)?;
        stretch.check(self.args.max_stretch).map_err(refuse)?;
        context.progress.phase("details");
        let options = self
            .args
            .apply_options()
            .mask(part::mask(&self.args.part, mesh)?);
        let applied = Detail::of(&from)
            .and_then(|detail| detail.sample(&map, &to)?.apply(&to, &options))
            .map_err(refuse)?;
        let surface = to.surface();
        let moved = surface.with_positions(&applied.positions);
        let crossing = [surface, moved].map(|s| s.self_intersections().len());
        let Wavelength::Share(share) = from.wavelength() else {
            return Err(refuse(DetailError::NoArea));
        };
        let transfer = TransferReport {
            map: self.map.name(),
            wavelength: share * to.unit(),
            wavelength_in_source: share * from.unit(),
            coverage: stretch.coverage,
            stretch_median: stretch.median,
            stretch_95: stretch.most,
            kept_share: applied.kept,
            damped_vertices: applied.damped_vertices,
            damping_rounds: applied.rounds,
            self_intersecting_before: crossing[0],
            self_intersecting_after: crossing[1],
        };
        warn(&transfer, share, context);
        Ok(Filtered {
            positions: applied.positions,
            report: SmoothReport {
                method: "detail",
                transfer: Some(transfer),
                ..SmoothReport::default()
            },
        })
    }
}

impl Transfer<'_> {
    fn correspondence(
        &self,
        meshes: [&Prepared; 2],
        [to, from]: [&BaseSurface<f64>; 2],
        context: &Context<'_>,
    ) -> Result<Correspondence, CliError> {
        match self.map {
            MapBy::File(path) => map_file::read(path, meshes[0], meshes[1]),
            MapBy::Closest => {
                let placed = match &self.args.landmarks {
                    Some(path) => placement(path, meshes)?,
                    None => Similarity::identity(),
                };
                Ok(Correspondence::closest(from, to, &placed))
            }
            MapBy::Sphere => {
                let common = match &self.args.landmarks {
                    Some(path) => Common::Landmarks(path),
                    None => Common::Pose,
                };
                let [target, source] = [mapped(meshes[0], context)?, mapped(meshes[1], context)?];
                let aligned = sphere::aligned(meshes, [&target, &source], common)?;
                let map = Correspondence::on_sphere(&aligned, &target.map);
                map.map_err(|error| sphere::refuse(meshes[0], error))
            }
        }
    }
}

/// The base of a mesh file.
fn base(mesh: &Prepared, wavelength: Wavelength) -> Result<BaseSurface<f64>, CliError> {
    let max_memory = mesh.check_memory(Work::Smooth)?;
    let options = BaseOptions::default()
        .wavelength(wavelength)
        .max_memory(Some(max_memory));
    let processing = &mesh.processing;
    let surface = Surface::new(processing.mesh(), processing.positions());
    let surface = surface.map_err(|error| mesh.refuse(error.into()))?;
    BaseSurface::new(surface, &options).map_err(|error| refuse(mesh, error))
}

fn mapped(mesh: &Prepared, context: &Context<'_>) -> Result<Mapped<f64>, CliError> {
    let options = SphereOptions::default().authalic(AUTHALIC);
    let mapper = Mapper {
        mesh,
        options: &options,
        turn: Turn::None,
    };
    let mapped = mapper.run::<f64>(&context.progress)?;
    sphere::warn(&mapped.report, &options, context.console);
    Ok(mapped)
}

/// The similarity that brings the landmarks of the source to those of the target.
fn placement(path: &InputPath, meshes: [&Prepared; 2]) -> Result<Similarity, CliError> {
    let pairs = sphere::pairs(path, meshes)?;
    let positions = meshes.map(|mesh| mesh.processing.positions());
    let pairs: Vec<_> = pairs
        .into_iter()
        .map(|[of_target, of_source]| [positions[1][of_source], positions[0][of_target]])
        .collect();
    Ok(Similarity::between(&pairs))
}

fn refuse(mesh: &Prepared, error: DetailError) -> CliError {
    match error {
        DetailError::Mesh(error) => mesh.refuse(error),
        other => CliError::File {
            path: mesh.path().to_owned(),
            source: other.into(),
        },
    }
}

fn warn(transfer: &TransferReport, share: f64, context: &Context<'_>) {
    let (before, after) = (
        transfer.self_intersecting_before,
        transfer.self_intersecting_after,
    );
    if after > before {
        context.console.warn(format_args!(
            "{} others, {before} did before; a smaller wavelength leaves thin parts alone, for \
             example --wavelength {:.0}%",
            match after {
                1 => "1 face intersects".to_owned(),
                _ => format!("{} intersect", counted(after, "face")),
            },
            50.0 * share
        ));
    }
    if transfer.coverage < 1.0 {
        context.console.warn(format_args!(
            "{:.2} % of the area has no counterpart and gets no details",
            100.0 * (1.0 - transfer.coverage)
        ));
    }
}

/// The degree to which the sphere maps keep areas rather than angles. Conformal maps shrink limbs
/// to points.
const AUTHALIC: f64 = 0.5;
