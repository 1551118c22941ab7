//! The workspace of every rule: the shape between two steps, and the system.
//!
//! It owns what `start` and `point_handles` prepare, and both of them work on it.

use std::sync::Arc;

use cotan_geometry::{Positions, Scalar};
use cotan_halfedge::VertexMap;
use cotan_linear::{Defect, PreparedSystem};
use cotan_parallel as parallel;
use nalgebra::Vector3;

use crate::current::Current;
use crate::error::FlowError;
use crate::point_handles::PointHandles;
use crate::report::StepReport;
use crate::rest::Rest;
use crate::schedule::Schedule;
use crate::start::FirstGuess;
use crate::state::FlowState;
use crate::targets::Targets;
use crate::updater::ScalarFieldUpdater;

/// The shape of a flow, its targets, and the vectors of one solve; allocated once.
pub(crate) struct Workspace<T: Scalar> {
    pub(crate) rest: Arc<Rest<T>>,
    pub(crate) targets: Targets<T>,
    pub(crate) system: PreparedSystem,
    /// μ of the membrane in the system, 0 without one.
    pub(crate) membrane_weight: f64,
    /// Current positions, in box units.
    pub(crate) current: Current<T>,
    /// The positions before the current step.
    pub(crate) start: Positions<T>,
    /// Scalar field d, and the Laplacian coordinates that the next solve aims at.
    pub(crate) field: VertexMap<T>,
    pub(crate) laplacian: VertexMap<Vector3<T>>,
    pub(crate) terms: Terms,
    pub(crate) settings: Settings<T>,
    pub(crate) iteration: usize,
    /// Iterations since a handle moved: 0 right after.
    pub(crate) since_move: usize,
    /// The handles that pull at a disc; none for a rule without a membrane.
    pub(crate) point_handles: Option<PointHandles>,
    /// The radius of their discs, in box units.
    pub(crate) point_radius: f64,
    /// The scale of the similarity that moved all handles when the flow was built; 1 for any other
    /// motion.
    pub(crate) scale: f64,
    /// The first guess of the rotations, until it has been used to orient.
    pub(crate) first_guess: Option<FirstGuess>,
}

/// The vectors of one solve.
pub(crate) struct Terms {
    /// ℓ − L⁰x.
    pub(crate) mismatch: VertexMap<Vector3<f64>>,
    /// u − x at soft handles, 0 elsewhere.
    pub(crate) pull: VertexMap<Vector3<f64>>,
    /// Half the negative gradient, after [`Workspace::solve_with_tension`]; empty before.
    pub(crate) residual: VertexMap<Vector3<f64>>,
    /// The displacement of a full plain step.
    pub(crate) correction: VertexMap<Vector3<f64>>,
}

impl Terms {
    pub(crate) fn new(num_vertices: usize) -> Self {
        let zeros = || VertexMap::filled(num_vertices, Vector3::zeros());
        Self {
            mismatch: zeros(),
            pull: zeros(),
            residual: VertexMap::default(),
            correction: zeros(),
        }
    }
}

/// The settings of a flow that its steps read.
#[derive(Clone, Debug)]
pub(crate) struct Settings<T> {
    pub(crate) schedule: Schedule,
    pub(crate) ratios: Option<VertexMap<T>>,
    pub(crate) tolerance: f64,
    pub(crate) iteration_limit: usize,
}

/// A solve whose correction is finite, counted as an iteration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Advance {
    /// The updating ratio of this step.
    pub(crate) ratio: f64,
    /// See [`StepReport::residual`].
    pub(crate) residual: f64,
    /// `true` for the first solve after a move, whose length depends on the handles and says
    /// nothing about convergence.
    pub(crate) is_first: bool,
}

impl<T: Scalar> Workspace<T> {
    /// Computes the correction that a full plain step would make.
    pub(crate) fn solve(&mut self) -> Result<(), FlowError> {
        self.miss();
        self.targets
            .pull(self.current.positions(), &mut self.terms.pull);
        let terms = &mut self.terms;
        let defect = Defect::of_laplacian(&terms.mismatch).with_pull(&terms.pull);
        Ok(self.system.correct(&defect, &mut terms.correction)?)
    }

    /// As [`Self::solve`] with a membrane, and half the negative gradient. `tension` is the wanted
    /// pull of the membrane's edges and becomes what they pull beyond it.
    pub(crate) fn solve_with_tension(
        &mut self,
        tension: &mut VertexMap<Vector3<f64>>,
    ) -> Result<(), FlowError> {
        self.measure_residual(tension);
        let Terms {
            mismatch,
            pull,
            residual,
            correction,
        } = &mut self.terms;
        let defect = Defect::of_laplacian(mismatch)
            .with_tension(tension)
            .with_pull(pull);
        self.system
            .correct_residual(&defect, residual, correction)?;
        if let Some(points) = &self.point_handles {
            let positions = self.current.positions();
            points.correct(&self.targets, positions, residual, correction);
        }
        self.add_point_forces();
        Ok(())
    }

    /// Adds the springs of the point handles to half the negative gradient.
    pub(crate) fn add_point_forces(&mut self) {
        if let Some(points) = &self.point_handles {
            let positions = self.current.positions();
            points.add_forces(&self.targets, positions, &mut self.terms.residual);
        }
    }

    /// Writes half the negative gradient, without the springs of the point handles. `tension` is
    /// the wanted pull of the membrane's edges and becomes the pull in excess of it.
    pub(crate) fn measure_residual(&mut self, tension: &mut VertexMap<Vector3<f64>>) {
        let (rest, laplacian) = (&*self.rest, self.laplacian.as_slice());
        let missed = |i: usize, now| laplacian[i].map(T::as_f64) - now;
        let mismatch = self.terms.mismatch.as_mut_slice();
        let known = self.current.known_rest_laplacian();
        if let Some(now) = known.filter(|_| rest.has_own_cotangents()) {
            // The membrane pulls by half of L⁰x.
            let now = now.as_slice();
            parallel::update(
                (mismatch, tension.as_mut_slice()),
                |i, (mismatch, tension)| {
                    *mismatch = missed(i, now[i]);
                    *tension = now[i] * 0.5 - *tension;
                },
            );
        } else {
            let positions = self.current.positions();
            parallel::update(
                (mismatch, tension.as_mut_slice()),
                |i, (mismatch, tension)| {
                    let [now, pull] = rest.laplacian_and_pull(positions, i);
                    *mismatch = missed(i, now);
                    *tension = pull - *tension;
                },
            );
        }
        self.targets
            .pull(self.current.positions(), &mut self.terms.pull);
        let terms = &mut self.terms;
        let defect = Defect::of_laplacian(&terms.mismatch)
            .with_tension(tension)
            .with_pull(&terms.pull);
        if terms.residual.len() != terms.correction.len() {
            terms.residual = terms.correction.clone();
        }
        self.system.residual(&defect, &mut terms.residual);
        if let Some(points) = &self.point_handles {
            points.complete(&self.system, &defect, &mut terms.residual);
        }
    }

    /// mismatch ← ℓ − L⁰x.
    fn miss(&mut self) {
        let laplacian = self.laplacian.as_slice();
        let missed = |i: usize, now| laplacian[i].map(T::as_f64) - now;
        let mismatch = self.terms.mismatch.as_mut_slice();
        if let Some(now) = self.current.known_rest_laplacian() {
            let now = now.as_slice();
            parallel::fill(mismatch, |i| missed(i, now[i]));
        } else {
            let (operator, x) = (self.rest.operator(), self.current.positions());
            parallel::fill(mismatch, |i| missed(i, operator.apply_at(x, i)));
        }
    }

    /// Counts a solve, and makes the current positions the start of a step: the current ones are
    /// then to be overwritten. `None` if the correction is not finite; the positions are then
    /// kept.
    pub(crate) fn advance(&mut self) -> Option<Advance> {
        self.iteration += 1;
        let step = Advance {
            ratio: self.settings.schedule.ratio(self.since_move),
            residual: self.residual(),
            is_first: self.since_move == 0,
        };
        if !step.residual.is_finite() {
            return None;
        }
        self.since_move += 1;
        std::mem::swap(&mut self.start, self.current.write());
        Some(step)
    }

    /// The report of a step that [`Self::advance`] refused.
    pub(crate) fn diverged(&self) -> StepReport {
        StepReport {
            residual: self.residual(),
            ..StepReport::new(self.iteration, f64::NAN)
        }
    }

    /// The longest correction, each vertex by its own ratio, over the diagonal.
    fn residual(&self) -> f64 {
        let correction = self.terms.correction.as_slice();
        let ratios = self.settings.ratios.as_ref();
        let length = |v: usize| {
            let own = ratios.map_or(1.0, |r| r.as_slice()[v].as_f64());
            (correction[v] * own).norm_squared()
        };
        parallel::max(correction.len(), length).sqrt() / self.rest.diagonal().as_f64()
    }

    /// The longest displacement of a vertex in the step, over the diagonal.
    pub(crate) fn longest_move(&self) -> f64 {
        let (now, start) = (self.current.positions().as_slice(), self.start.as_slice());
        let length = |i: usize| (now[i] - start[i]).map(T::as_f64).norm_squared();
        parallel::max(now.len(), length).sqrt() / self.rest.diagonal().as_f64()
    }

    /// x ← start + s δ.
    pub(crate) fn move_by_correction(&mut self, ratio: f64) {
        let ratios = self.settings.ratios.as_ref();
        let (start, correction) = (self.start.as_slice(), self.terms.correction.as_slice());
        parallel::fill(self.current.write().as_mut_slice(), |v| {
            let own = ratios.map_or(1.0, |r| r.as_slice()[v].as_f64());
            start[v] + (correction[v] * (ratio * own)).map(T::of_f64)
        });
    }

    /// Puts the hard handles on their targets, except those that pull at a disc.
    pub(crate) fn pin(&mut self) {
        let points = self.point_handles.as_ref();
        let is_kept = |v| points.is_some_and(|p| p.contains(v));
        self.targets.pin(self.current.write(), is_kept);
        if let Some(points) = &mut self.point_handles {
            points.aim(&self.rest, &self.targets, self.scale);
        }
    }

    /// Finds the discs of the point handles.
    pub(crate) fn find_point_handles(&mut self) {
        self.point_handles = PointHandles::new(self, self.point_radius);
    }

    /// Σ k² |x − u|² over the soft handles, and the springs of the point handles.
    pub(crate) fn spring_energy(&self) -> f64 {
        let positions = self.current.positions();
        let points = self.point_handles.as_ref();
        let of_points = points.map_or(0.0, |p| p.energy(&self.targets, positions));
        self.targets.spring_energy(positions, &self.system) + of_points
    }

    /// Updates the scalar field from the current positions.
    pub(crate) fn update_field(
        &mut self,
        updater: &mut dyn ScalarFieldUpdater<T>,
    ) -> Result<(), FlowError> {
        let first = self.first_guess.as_ref().map(|guess| &guess.rotations);
        let state = FlowState::new(&self.rest, &self.current, self.iteration, first);
        updater.update(&state, &mut self.field)
    }

    /// Rewrites the Laplacian coordinates from the current positions and the field.
    pub(crate) fn orient<R>(
        &mut self,
        orient: impl FnOnce(
            &FlowState<'_, T>,
            &VertexMap<T>,
            &mut VertexMap<Vector3<T>>,
        ) -> Result<R, FlowError>,
    ) -> Result<R, FlowError> {
        let first = self.first_guess.as_ref().map(|guess| &guess.rotations);
        let state = FlowState::new(&self.rest, &self.current, self.iteration, first);
        let result = orient(&state, &self.field, &mut self.laplacian);
        self.first_guess = None;
        result
    }
}
