//! The one generic solver: solve, update the scalar field, orient, again.

use std::ops::ControlFlow;

use cotan_geometry::{Positions, Scalar, Surface, bounding_box};
use cotan_halfedge::{HalfedgeMesh, VertexId, VertexMap};
use cotan_laplacian::LaplacianScheme;
use cotan_linear::{Handle, Hold, PreparedSystem};
use nalgebra::{Matrix3, Point3, Rotation3, Vector3};

use crate::anderson::Anderson;
use crate::builder::{Acceleration, FlowBuilder, Settings, Start, with_outside};
use crate::error::FlowError;
use crate::lbfgs::Lbfgs;
use crate::orientation::{Energy, Orientation};
use crate::projection::Projection;
use crate::report::{Report, StepReport, StopReason};
use crate::rest::Rest;
use crate::schedule::Schedule;
use crate::start::handle_rotations;
use crate::state::Measured;
use crate::updater::ScalarFieldUpdater;
use crate::vectors::add_scaled;

/// Box units: the bounding box's lower corner at 0, its longest side 1. All errors and tolerances
/// are measured there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<T: Scalar> {
    corner: Point3<T>,
    size: T,
    diagonal: T,
}

impl<T: Scalar> Frame<T> {
    pub(crate) fn new(surface: &Surface<'_, T>) -> Result<Self, FlowError> {
        let bounds = bounding_box(surface);
        let size = bounds.longest_side();
        // Room above the size, so that a shape that grows without bound is seen to do so before its
        // positions overflow.
        let reach = size * T::of_f64(1e20);
        if !(size > T::zero() && reach.is_finite()) {
            return Err(FlowError::NoExtent);
        }
        // Scaled first: the squares of huge coordinates would overflow.
        Ok(Self {
            corner: bounds.min,
            size,
            diagonal: (bounds.extents() / size).norm(),
        })
    }

    pub(crate) fn to_box(self, p: Point3<T>) -> Point3<T> {
        Point3::from((p - self.corner) / self.size)
    }

    pub(crate) fn to_box_all(self, positions: &Positions<T>) -> Positions<T> {
        positions.map(|p| self.to_box(*p))
    }

    /// Diagonal of the box, in box units.
    pub(crate) fn diagonal(self) -> T {
        self.diagonal
    }
}

/// What the builder hands over.
pub(crate) struct Parts<'m, T: Scalar> {
    pub(crate) original: &'m Positions<T>,
    pub(crate) frame: Frame<T>,
    pub(crate) rest: Rest<'m, T>,
    pub(crate) scheme: Box<dyn LaplacianScheme<T> + 'm>,
    pub(crate) updater: Box<dyn ScalarFieldUpdater<T> + 'm>,
    pub(crate) orientation: Box<dyn Orientation<T> + 'm>,
    pub(crate) projection: Option<Box<dyn Projection<T> + 'm>>,
    pub(crate) system: PreparedSystem,
    /// Whether the orientation asked for a membrane.
    pub(crate) has_membrane: bool,
    /// Whether each vertex may move, if not all may.
    pub(crate) region: Option<VertexMap<bool>>,
    pub(crate) handles: Vec<Handle>,
    /// Where the handles are to be, in the units of the input and in box units.
    pub(crate) user_targets: Vec<Point3<T>>,
    pub(crate) targets: Vec<Point3<T>>,
}

/// The iteration of curvature-flow Laplacian editing on one mesh with one set of handles.
///
/// Built by [`Flow::builder`]; then stepped ([`Flow::step`]) or run ([`Flow::run`]). It can be kept
/// and fed new handle positions ([`Flow::set_targets`]), frame after frame: nothing is factorized
/// again.
pub struct Flow<'m, T: Scalar> {
    pub(crate) parts: Parts<'m, T>,
    pub(crate) settings: Settings<T>,
    pub(crate) measured: Measured<T>,
    /// Current positions, in box units.
    pub(crate) positions: Positions<T>,
    /// The positions before the step at hand.
    pub(crate) start: Positions<T>,
    /// Scalar field d, and the Laplacian coordinates that the next solve aims at.
    pub(crate) field: VertexMap<T>,
    pub(crate) laplacian: VertexMap<Vector3<T>>,
    /// The Laplacian coordinates before the update at hand.
    pub(crate) before: VertexMap<Vector3<T>>,
    pub(crate) terms: Terms,
    pub(crate) accelerator: Accelerator,
    /// Per vertex the number of its handle.
    handle_of: VertexMap<Option<u32>>,
    pub(crate) energy: Option<Energy>,
    pub(crate) iteration: usize,
    /// Iterations since a handle moved: 0 right after.
    pub(crate) since_move: usize,
    /// Whether the Laplacian coordinates at hand are a plain image, not an extrapolation.
    pub(crate) is_plain: bool,
    /// Whether the orientation has seen the current positions.
    pub(crate) is_seen: bool,
}

/// The vectors of one solve; allocated once.
pub(crate) struct Terms {
    pub(crate) mismatch: VertexMap<Vector3<f64>>,
    pub(crate) tension: VertexMap<Vector3<f64>>,
    pub(crate) pull: VertexMap<Vector3<f64>>,
    pub(crate) residual: VertexMap<Vector3<f64>>,
    pub(crate) correction: VertexMap<Vector3<f64>>,
    /// Where a descent searches.
    pub(crate) direction: VertexMap<Vector3<f64>>,
}

pub(crate) enum Accelerator {
    Off,
    Anderson(Anderson),
    Lbfgs(Lbfgs),
}

impl<T: Scalar> std::fmt::Debug for Flow<'_, T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Flow")
            .field("vertices", &self.positions.len())
            .field("handles", &self.parts.handles.len())
            .field("iteration", &self.iteration)
            .field("settings", &self.settings)
            .finish_non_exhaustive()
    }
}

impl<'m, T: Scalar> Flow<'m, T> {
    /// Starts to describe a flow on `mesh` with its original `positions`.
    pub fn builder(mesh: &'m HalfedgeMesh, positions: &'m Positions<T>) -> FlowBuilder<'m, T> {
        FlowBuilder::new(mesh, positions)
    }

    pub(crate) fn assemble(parts: Parts<'m, T>, settings: Settings<T>) -> Self {
        let rest = &parts.rest;
        let zeros = || VertexMap::filled(rest.positions().len(), Vector3::zeros());
        Self {
            handle_of: numbers(&parts.handles, rest.positions().len()),
            measured: Measured::new(rest),
            positions: rest.positions().clone(),
            start: rest.positions().clone(),
            field: rest.magnitudes().clone(),
            laplacian: rest.laplacian().clone(),
            before: rest.laplacian().clone(),
            terms: Terms {
                mismatch: zeros(),
                tension: zeros(),
                pull: zeros(),
                residual: zeros(),
                correction: zeros(),
                direction: zeros(),
            },
            accelerator: Accelerator::Off,
            energy: None,
            iteration: 0,
            since_move: 0,
            is_plain: true,
            is_seen: false,
            parts,
            settings,
        }
    }

    /// Sets the first Laplacian coordinates and membrane edges, and the handles in place.
    pub(crate) fn begin(&mut self, first_shape: Option<Positions<T>>) -> Result<(), FlowError> {
        self.is_seen = false;
        if let Some(shape) = first_shape {
            self.positions = shape;
        }
        let n = self.positions.len();
        let identity = || VertexMap::filled(n, Matrix3::identity());
        let rotations = match self.settings.start {
            Start::Original | Start::Updated => identity(),
            Start::HandleRotations => self.interpolated_rotations().unwrap_or_else(identity),
            Start::Zero => {
                self.laplacian
                    .values_mut()
                    .for_each(|ell| *ell = Vector3::zeros());
                identity()
            }
        };
        for (ell, rotation) in self.laplacian.values_mut().zip(rotations.values()) {
            *ell = (rotation * ell.map(T::as_f64)).map(T::of_f64);
        }
        self.accelerator = match self.settings.acceleration {
            // What is projected is no fixed-point iteration of the Laplacian coordinates alone.
            _ if self.parts.projection.is_some() => Accelerator::Off,
            // A ratio of its own for every vertex is no step that could be extrapolated.
            Acceleration::Memory(memory) if memory > 0 && self.settings.ratios.is_none() => {
                if self.parts.orientation.energy().is_some() {
                    Accelerator::Lbfgs(Lbfgs::new(memory))
                } else if self.parts.has_membrane {
                    // Its state is more than the Laplacian coordinates: plain steps.
                    Accelerator::Off
                } else {
                    Accelerator::Anderson(Anderson::new(memory))
                }
            }
            _ => Accelerator::Off,
        };
        self.parts.orientation.start_from(&rotations);
        match &mut self.parts.projection {
            Some(projection) => projection.start(&self.parts.rest, &mut self.positions)?,
            None => self.pin(),
        }
        if self.settings.start == Start::Updated {
            self.update()?;
        }
        Ok(())
    }

    /// Rotation vectors of the handle regions, spread over the mesh by the system itself.
    fn interpolated_rotations(&mut self) -> Option<VertexMap<Matrix3<f64>>> {
        let parts = &mut self.parts;
        let at_handles = handle_rotations(&parts.rest, &parts.handles, &parts.targets);
        if at_handles.iter().all(|w| w.norm() < 1e-12) {
            return None;
        }
        let mut turn = VertexMap::filled(self.positions.len(), Vector3::zeros());
        for (handle, w) in parts.handles.iter().zip(at_handles) {
            turn[handle.vertex] = w;
        }
        // The smoothest field with these values: mismatch 0 − Lω, tension Σ s (ω_j − ω_i).
        let terms = &mut self.terms;
        for i in 0..turn.len() {
            let (mut ell, mut tension) = (Vector3::zeros(), Vector3::zeros());
            let at = turn.as_slice();
            for (j, h) in parts.rest.rings().ring(i) {
                let step = at[j.index()] - at[i];
                ell -= step * parts.rest.operator().weights()[h].as_f64();
                tension += step * parts.rest.stiffness()[h.edge()];
            }
            terms.mismatch.as_mut_slice()[i] = ell;
            terms.tension.as_mut_slice()[i] = tension;
        }
        terms.pull.values_mut().for_each(|p| *p = Vector3::zeros());
        parts.system.correct(
            &terms.mismatch,
            Some(&terms.tension),
            &terms.pull,
            &mut terms.residual,
            &mut terms.correction,
        );
        add_scaled(turn.as_mut_slice(), 1.0, terms.correction.as_slice());
        Some(turn.map(|w| Rotation3::new(*w).into_inner()))
    }

    /// The original mesh, in box units.
    pub fn rest(&self) -> &Rest<'m, T> {
        &self.parts.rest
    }

    /// The handles, in the order of their targets.
    pub fn handles(&self) -> &[Handle] {
        &self.parts.handles
    }

    /// The system that the iterations solve.
    pub fn system(&self) -> &PreparedSystem {
        &self.parts.system
    }

    /// Iterations since the flow was built.
    pub fn iteration(&self) -> usize {
        self.iteration
    }

    /// The energy of the current shape, for an orientation that has one: after the first step since
    /// the flow was built or a handle moved.
    pub fn energy(&self) -> Option<f64> {
        self.energy.map(|energy| energy.value)
    }

    /// Where the handles are to be, in their order and in the units of the input.
    pub fn handle_targets(&self) -> &[Point3<T>] {
        &self.parts.user_targets
    }

    /// The longest side of the original mesh's bounding box, in the units of the input.
    pub fn size(&self) -> T {
        self.parts.frame.size
    }

    /// The current positions, in the units of the input. Hard handles are exactly at their targets
    /// (unless something projects the flow), and a vertex that has not moved has exactly its original
    /// position.
    ///
    /// Positions are computed as numbers up to 1, box units, and each step rounds them to the
    /// spacing ε
    /// of such numbers: a vertex within 4 ε of its original place in each coordinate has not moved.
    pub fn positions(&self) -> Positions<T> {
        let size = self.parts.frame.size;
        let rounding = T::default_epsilon() * T::of_f64(UNMOVED);
        let rest = self.parts.rest.positions().values();
        let original = self.parts.original.values();
        let mut positions: Positions<T> = original
            .zip(rest)
            .zip(self.positions.values())
            .map(|((original, rest), now)| {
                let way = now - rest;
                match way.iter().all(|x| x.abs() <= rounding) {
                    true => *original,
                    false => original + way * size,
                }
            })
            .collect();
        let is_held = self.parts.projection.is_none();
        for (handle, target) in self.parts.handles.iter().zip(&self.parts.user_targets) {
            if is_held && handle.hold == Hold::Hard {
                positions[handle.vertex] = *target;
            }
        }
        positions
    }

    /// The current positions, in box units, or in those of the projection.
    pub fn box_positions(&self) -> &Positions<T> {
        &self.positions
    }

    /// Moves all handles to new targets, in the order of [`Self::handles`]. The shape is kept and
    /// follows in the next steps; the schedule and the acceleration start over, so that a flow whose
    /// handles move before every step takes plain steps. Targets that are the same change nothing.
    ///
    /// # Errors
    /// [`FlowError`] if there are too few or too many targets, or one is not finite.
    pub fn set_targets(&mut self, targets: &[Point3<T>]) -> Result<(), FlowError> {
        if targets.len() != self.parts.handles.len() {
            return Err(FlowError::TargetCount {
                targets: targets.len(),
                handles: self.parts.handles.len(),
            });
        }
        for (handle, target) in self.parts.handles.iter().zip(targets) {
            check_target(&self.parts.frame, handle.vertex, target)?;
        }
        if self.parts.user_targets != targets {
            self.parts.user_targets.copy_from_slice(targets);
            self.targets_moved();
        }
        Ok(())
    }

    /// Moves some handles to new targets; the others stay where they are.
    ///
    /// # Errors
    /// [`FlowError`] if a vertex is not a handle or a target is not finite; nothing has moved then.
    pub fn move_handles(&mut self, moves: &[(VertexId, Point3<T>)]) -> Result<(), FlowError> {
        let mut targets = self.parts.user_targets.clone();
        for (vertex, target) in moves {
            check_target(&self.parts.frame, *vertex, target)?;
            let index = self
                .handle_of
                .get(*vertex)
                .copied()
                .flatten()
                .ok_or(FlowError::NotAHandle { vertex: *vertex })?;
            targets[index as usize] = *target;
        }
        if self.parts.user_targets != targets {
            self.parts.user_targets = targets;
            self.targets_moved();
        }
        Ok(())
    }

    /// Puts other handles in the place of all handles at hand, each with its target. The shape is kept and
    /// follows in the next steps; schedule and acceleration start over. A handle that was hard and is
    /// none any more lets go of its vertex where it is.
    ///
    /// Whether anything is factorized depends on how the system is solved: see
    /// [`cotan_linear::Strategy`].
    ///
    /// # Errors
    /// [`FlowError`] as from [`FlowBuilder::build`]; nothing has changed then.
    pub fn set_handles(&mut self, handles: &[(Handle, Point3<T>)]) -> Result<(), FlowError> {
        for (handle, target) in handles {
            check_target(&self.parts.frame, handle.vertex, target)?;
        }
        let (handles, user_targets): (Vec<Handle>, Vec<Point3<T>>) =
            handles.iter().copied().unzip();
        let parts = &mut self.parts;
        if parts.handles != handles {
            let held = with_outside(&handles, parts.region.as_ref());
            parts.system.set_handles(&held)?;
            self.handle_of = numbers(&handles, self.positions.len());
            parts.targets = user_targets.clone();
            parts.handles = handles;
        } else if parts.user_targets == user_targets {
            return Ok(());
        }
        parts.user_targets = user_targets;
        self.targets_moved();
        Ok(())
    }

    /// Changes the schedule of the steps from here on: 1 while a handle is held, say, and a falling one
    /// when it is let go of.
    ///
    /// # Errors
    /// [`FlowError`] for ratios out of range.
    pub fn set_schedule(&mut self, schedule: Schedule) -> Result<(), FlowError> {
        schedule.check()?;
        if self.settings.schedule != schedule {
            self.settings.schedule = schedule;
            // Its first ratio comes next; that handles have moved is answered to already, or not.
            self.since_move = self.since_move.min(1);
        }
        Ok(())
    }

    /// Puts another shape in the place of the one at hand, in the units of the input; hard handles stay
    /// at their targets. The next steps go on from there; schedule and acceleration start over.
    ///
    /// **Shapes**: one position a vertex.
    ///
    /// # Errors
    /// [`FlowError`] for a shape of another mesh or with a position that is not finite (nothing has
    /// changed then), and what updater and orientation report.
    pub fn set_shape(&mut self, shape: &Positions<T>) -> Result<(), FlowError> {
        Surface::new(self.parts.rest.mesh(), shape)?;
        self.positions = self.parts.frame.to_box_all(shape);
        self.targets_moved();
        self.update()
    }

    fn targets_moved(&mut self) {
        let Parts {
            targets,
            user_targets,
            frame,
            ..
        } = &mut self.parts;
        for (slot, target) in targets.iter_mut().zip(user_targets) {
            *slot = frame.to_box(*target);
        }
        if self.parts.projection.is_none() {
            self.pin();
        }
        self.since_move = 0;
        self.is_plain = true;
        self.energy = None;
        match &mut self.accelerator {
            Accelerator::Off => {}
            Accelerator::Anderson(anderson) => anderson.reset(),
            Accelerator::Lbfgs(lbfgs) => lbfgs.reset(),
        }
    }

    /// Puts the hard handles on their targets.
    fn pin(&mut self) {
        self.is_seen = false;
        for (handle, target) in self.parts.handles.iter().zip(&self.parts.targets) {
            if handle.hold == Hold::Hard {
                self.positions[handle.vertex] = *target;
            }
        }
    }

    /// Iterates until convergence or the iteration limit.
    ///
    /// # Errors
    /// What [`Flow::step`] reports.
    pub fn run_to_end(&mut self) -> Result<Report, FlowError> {
        self.run(|_, _| ControlFlow::Continue(()))
    }

    /// Iterates until convergence, the iteration limit, or until the observer breaks.
    ///
    /// The observer sees the flow after every step; [`Flow::positions`] and the error measures are
    /// computed when it asks for them.
    ///
    /// # Errors
    /// What [`Flow::step`] reports. Reaching the iteration limit is a stop reason, not an error.
    pub fn run(
        &mut self,
        mut observer: impl FnMut(&Self, &StepReport) -> ControlFlow<()>,
    ) -> Result<Report, FlowError> {
        let mut report = Report {
            energy: self.energy(),
            solver: Some(self.parts.system.choice()),
            ..Report::default()
        };
        while report.iterations < self.settings.iteration_limit {
            let step = self.step()?;
            report.iterations += 1;
            report.change = step.change;
            report.residual = step.residual;
            report.energy = step.energy;
            let cancelled = observer(self, &step).is_break();
            let stop = if !step.residual.is_finite() {
                Some(StopReason::Diverged)
            } else if step.converged {
                Some(StopReason::Converged)
            } else if step.stalled {
                Some(StopReason::Stalled)
            } else {
                cancelled.then_some(StopReason::Cancelled)
            };
            if let Some(stop) = stop {
                report.stop = stop;
                break;
            }
        }
        tracing::debug!(
            iterations = report.iterations,
            stop = report.stop.as_str(),
            "flow ended"
        );
        Ok(report)
    }
}

/// A displacement of so many ε of the size is the rounding of a step or two.
const UNMOVED: f64 = 4.0;

/// Per vertex the number of its handle.
fn numbers(handles: &[Handle], num_vertices: usize) -> VertexMap<Option<u32>> {
    let mut handle_of = VertexMap::filled(num_vertices, None);
    for (index, handle) in handles.iter().enumerate() {
        handle_of[handle.vertex] = Some(index as u32);
    }
    handle_of
}

/// Refuses targets that are not finite, or so far away that the mesh would vanish beside them.
pub(crate) fn check_target<T: Scalar>(
    frame: &Frame<T>,
    vertex: VertexId,
    target: &Point3<T>,
) -> Result<(), FlowError> {
    // In box units: so far away that the precision keeps four digits of the mesh.
    let farthest = (1e-4 / T::default_epsilon().as_f64()).min(1e9);
    if target.iter().any(|x| !x.is_finite()) {
        return Err(FlowError::NonFiniteTarget { vertex });
    }
    let boxed = frame.to_box(*target);
    if boxed.iter().any(|x| !(x.as_f64().abs() <= farthest)) {
        return Err(FlowError::TargetTooFar { vertex });
    }
    Ok(())
}
