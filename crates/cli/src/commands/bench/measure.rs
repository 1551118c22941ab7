//! Measures the cost of a mesh on this machine, phase by phase.

use std::hint::black_box;
use std::time::{Duration, Instant};

use cotan::flow::Flow;
use cotan::geometry::{BoundingBox, Surface};
use cotan::laplacian::{Cotangent, Operator};
use cotan::linear::{Defect, Handle, PreparedSystem, SystemOptions};
use cotan::prelude::{
    DeformOptions, Isometry3, OrientationKind, Point3, Vector3, VertexId, VertexMap,
};
use cotan_io::{Folder, IoError, ProcessingMesh, Weld, load_with};
use cotan_tool::Work;
use cotan_tool::numbers::in_file_numbers;
use serde::Serialize;

use crate::args::InputPath;
use crate::console::Console;
use crate::error::{CliError, Cure};
use crate::files;
use crate::memory;

/// The parameters of a measurement.
pub(crate) struct Plan<'a> {
    pub(crate) path: &'a InputPath,
    pub(crate) weld: Weld,
    pub(crate) orientation: OrientationKind,
    /// The maximum number of runs of each phase.
    pub(crate) rounds: u32,
}

/// The results. The fields are those of the JSON.
#[derive(Debug, Serialize)]
pub(crate) struct Measured {
    pub(crate) mesh: String,
    pub(crate) vertices: usize,
    pub(crate) faces: usize,
    pub(crate) handles: usize,
    pub(crate) threads: usize,
    pub(crate) orientation: &'static str,
    /// `true` if the mesh was renumbered because the order of the file was poor.
    pub(crate) is_renumbered: bool,
    pub(crate) seconds: PhaseSeconds,
    pub(crate) bytes: Bytes,
    pub(crate) job: Drag,
}

/// Medians in seconds.
#[derive(Debug, Serialize)]
pub(crate) struct PhaseSeconds {
    pub(crate) load: f64,
    pub(crate) build: f64,
    pub(crate) assemble: f64,
    pub(crate) factor: f64,
    pub(crate) add_handle: f64,
    pub(crate) solve: f64,
    pub(crate) iteration: f64,
    /// An iteration without one solve.
    pub(crate) iteration_rest: f64,
}

#[derive(Debug, Serialize)]
pub(crate) struct Bytes {
    pub(crate) file: u64,
    pub(crate) mesh: u64,
    pub(crate) factor: u64,
}

/// The standard drag, from a built mesh to convergence.
#[derive(Debug, Serialize)]
pub(crate) struct Drag {
    pub(crate) seconds: f64,
    pub(crate) iterations: usize,
    pub(crate) stop_reason: &'static str,
    pub(crate) tolerance: f64,
}

type Moves = Vec<(VertexId, Point3<f64>)>;

impl Plan<'_> {
    pub(crate) fn measure(&self, console: &Console) -> Result<Measured, CliError> {
        let document = files::load(self.path, console)?;
        let load = self
            .median(|| load_with(self.path, memory::limits(), &Folder::of(self.path)).map(drop))?;
        let max_memory = memory::check(Work::Bench, self.path, &document)?;
        let build_once = || document.surface_with(self.weld);
        let refuse = |error: IoError| CliError::surface(self.path, error, Cure::Command, self.weld);
        let processing = build_once().map_err(refuse)?;
        let build = self.median(|| build_once().map(drop))?;
        drop(document);
        self.on_mesh(&processing, max_memory, load, build)
            .map_err(|error| CliError::Mesh {
                path: self.path.to_path_buf(),
                source: in_file_numbers(error, &processing, None),
            })
    }

    fn on_mesh(
        &self,
        processing: &ProcessingMesh,
        max_memory: u64,
        load: f64,
        build: f64,
    ) -> Result<Measured, cotan::Error> {
        let (mesh, positions) = (processing.mesh(), processing.positions());
        let surface = Surface::new(mesh, positions)?;
        let assemble =
            self.median(|| Operator::assemble(&Cotangent::default(), &surface).map(drop));
        let assemble = assemble.map_err(cotan::flow::FlowError::from)?;

        let moves = standard_drag(&surface);
        // The memory holds a flow and, while a system is replaced, two more systems.
        let system = SystemOptions::new().max_memory(max_memory / 3);
        let options = DeformOptions::default()
            .orientation(self.orientation)
            .system(system);
        let (job, mut flow) = self.drag(&surface, &moves, &options)?;
        let system = self.system(&flow, &options.system)?;
        let iteration = self.iterations(&mut flow, &moves)?;
        Ok(Measured {
            mesh: String::new(),
            vertices: mesh.num_vertices(),
            faces: mesh.num_faces(),
            handles: moves.len(),
            threads: cotan_parallel::num_threads(),
            orientation: self.orientation.name(),
            is_renumbered: processing.is_renumbered(),
            seconds: PhaseSeconds {
                load,
                build,
                assemble,
                factor: system.factor,
                add_handle: system.add_handle,
                solve: system.solve,
                iteration,
                iteration_rest: (iteration - system.solve).max(0.0),
            },
            bytes: Bytes {
                file: std::fs::metadata(self.path).map_or(0, |m| m.len()),
                mesh: (mesh.num_bytes() + size_of_val(positions.as_slice())) as u64,
                factor: system.factor_bytes,
            },
            job,
        })
    }

    /// Runs the whole drag. Also returns a flow that has its handles but has not moved.
    fn drag(
        &self,
        surface: &Surface<'_, f64>,
        moves: &Moves,
        options: &DeformOptions,
    ) -> Result<(Drag, Flow<f64>), cotan::Error> {
        let (mesh, positions) = (surface.mesh(), surface.positions());
        let build = |targets: Moves, tolerance: f64| {
            options
                .apply(Flow::builder(mesh, positions))
                .handles(targets.into_iter().map(|(v, p)| (Handle::hard(v), p)))
                .tolerance(tolerance)
                .build()
        };
        let mut last = None;
        let seconds = self.median(|| {
            last = Some(build(moves.clone(), options.tolerance)?.run_to_end()?);
            Ok::<_, cotan::flow::FlowError>(())
        })?;
        let at_rest = moves.iter().map(|&(v, _)| (v, positions[v])).collect();
        // With tolerance 0 no step takes the shortcut of a converged one.
        let flow = build(at_rest, 0.0)?;
        Ok((
            Drag {
                seconds,
                iterations: last.as_ref().map_or(0, |report| report.iterations),
                stop_reason: last.as_ref().map_or("", |report| report.stop.as_str()),
                tolerance: options.tolerance,
            },
            flow,
        ))
    }

    /// Builds the linear system of a flow and solves it once.
    fn system(
        &self,
        flow: &Flow<f64>,
        options: &SystemOptions,
    ) -> Result<SystemSeconds, cotan::flow::FlowError> {
        let rest = flow.rest();
        let mut system = prepare(flow, options)?;
        let factor = self.median(|| {
            system = prepare(flow, options)?;
            Ok::<_, cotan::flow::FlowError>(())
        })?;
        let factor_bytes = 8 * system.factor_entries() as u64;

        let n = rest.positions().len();
        let still = VertexMap::filled(n, Vector3::zeros());
        let mismatch = rest.laplacian().clone();
        let mut correction = still.clone();
        let solve = self.median(|| {
            let defect = Defect::of_laplacian(black_box(&mismatch)).with_tension(&still);
            let solved = system.correct(&defect, &mut correction);
            solved.map_err(cotan::flow::FlowError::from)
        })?;
        Ok(SystemSeconds {
            factor,
            add_handle: self.add_handle(flow, &mut system)?,
            solve,
            factor_bytes,
        })
    }

    /// Measures adding one handle.
    fn add_handle(
        &self,
        flow: &Flow<f64>,
        system: &mut PreparedSystem,
    ) -> Result<f64, cotan::flow::FlowError> {
        let rest = flow.rest();
        let mut is_held = vec![false; rest.positions().len()];
        let mut handles = flow.handles().to_vec();
        handles
            .iter()
            .for_each(|h| is_held[h.vertex.index()] = true);
        let mut free = rest.mesh().vertices().filter(|v| !is_held[v.index()]);
        // Each run adds one handle to those before.
        self.median(|| {
            handles.extend(free.next().map(Handle::hard));
            system.set_handles(&handles)?;
            Ok(())
        })
    }

    fn iterations(
        &self,
        flow: &mut Flow<f64>,
        moves: &Moves,
    ) -> Result<f64, cotan::flow::FlowError> {
        flow.move_handles(moves)?;
        // The first two steps only respond to the move.
        flow.step()?;
        flow.step()?;
        self.median(|| flow.step().map(drop))
    }

    /// The median of up to `rounds` runs, fewer if they take long.
    fn median<E>(&self, mut work: impl FnMut() -> Result<(), E>) -> Result<f64, E> {
        let start = Instant::now();
        let mut runs = Vec::new();
        for _ in 0..self.rounds {
            let clock = Instant::now();
            work()?;
            runs.push(clock.elapsed().as_secs_f64());
            if start.elapsed() > ENOUGH {
                break;
            }
        }
        runs.sort_by(f64::total_cmp);
        Ok(runs.get(runs.len() / 2).copied().unwrap_or(0.0))
    }
}

struct SystemSeconds {
    factor: f64,
    add_handle: f64,
    solve: f64,
    factor_bytes: u64,
}

/// Prepares the system of a flow, as the last step of `FlowBuilder::build` does.
fn prepare(
    flow: &Flow<f64>,
    options: &SystemOptions,
) -> Result<PreparedSystem, cotan::flow::FlowError> {
    Ok(PreparedSystem::prepare_with(
        flow.rest().operator(),
        flow.handles(),
        flow.membrane(),
        options,
    )?)
}

/// The handles of the standard drag.
///
/// A tenth of the vertices at each end along the longest side of the box: the lower end is held,
/// the upper one rotated and lifted. Components without any of these vertices are fixed.
fn standard_drag(surface: &Surface<'_, f64>) -> Moves {
    let (mesh, positions) = (surface.mesh(), surface.positions());
    let bounds = surface.bounding_box();
    let axis = bounds.extents().imax();
    let mut along: Vec<VertexId> = mesh.vertices().collect();
    along.sort_by(|&a, &b| positions[a][axis].total_cmp(&positions[b][axis]));
    let count = (along.len() / 10).max(1);
    let motion = lift(&bounds, axis);
    let mut moves: Moves = along[..count].iter().map(|&v| (v, positions[v])).collect();
    let upper = along[along.len() - count..].iter();
    moves.extend(upper.map(|&v| (v, motion * positions[v])));

    let components = mesh.components();
    let mut is_held = vec![false; components.count()];
    moves
        .iter()
        .for_each(|&(v, _)| is_held[components.of(v)] = true);
    let loose = mesh.vertices().filter(|&v| !is_held[components.of(v)]);
    moves.extend(loose.map(|v| (v, positions[v])));
    moves
}

/// A rotation by 45° about an axis across the longest side, and a shift by a quarter of that
/// side.
fn lift(bounds: &BoundingBox<f64>, axis: usize) -> Isometry3<f64> {
    let across = Vector3::ith((axis + 1) % 3, 1.0);
    let aside = Vector3::ith((axis + 2) % 3, 0.25 * bounds.longest_side());
    let center = bounds.center().coords;
    let turn = Isometry3::rotation(across * std::f64::consts::FRAC_PI_4);
    Isometry3::from(center + aside) * turn * Isometry3::from(-center)
}

/// A phase is not repeated after this time.
const ENOUGH: Duration = Duration::from_secs(20);
