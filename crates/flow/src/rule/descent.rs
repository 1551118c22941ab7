//! Solve and search: an energy that never goes up.

use cotan_geometry::Scalar;
use cotan_halfedge::VertexMap;
use cotan_parallel as parallel;
use nalgebra::Vector3;

use super::Rule;
use crate::accelerate::{Coarse, Lbfgs, Restricted};
use crate::energy::{Energy, LocalGlobal, NextStep};
use crate::error::FlowError;
use crate::report::{LostTurn, StepReport};
use crate::updater::ScalarFieldUpdater;
use crate::vectors::dot;
use crate::winding::Winding;
use crate::workspace::Workspace;

/// The descent of an energy that a local step and the solve lower in turn.
///
/// Full steps search along the direction of L-BFGS, whose first guess of the inverse Hessian is
/// the factorization. Every other step is the plain one: after handles have moved, with a ratio
/// below 1, and without acceleration.
pub(crate) struct Descent<T: Scalar> {
    updater: Box<dyn ScalarFieldUpdater<T>>,
    model: Box<dyn LocalGlobal<T>>,
    lbfgs: Option<Lbfgs>,
    /// Built where a descent takes long; kept while the handles are the same vertices.
    coarse: Option<Coarse>,
    /// The number of steps right after a move.
    moves: usize,
    /// `true` if it cannot be built for these handles.
    is_refused: bool,
    /// Of a shape whose handles turn by more than half a turn relative to each other.
    winding: Option<Winding>,
    /// The part of a plain step that did not go too far last time.
    plain_part: f64,
    /// Σ s_ij (x_j − x_i) less what the model wants of it.
    tension: VertexMap<Vector3<f64>>,
    /// The direction in which a step searches; empty without acceleration.
    direction: VertexMap<Vector3<f64>>,
    /// That of the current positions, with the springs of soft handles.
    energy: Option<Energy>,
}

/// The outcome of a search for a lower energy.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Search {
    Went,
    Stalled,
}

/// The coarse correction is built at the first of these steps, or at the second where the plain
/// steps are so short by then, over the tolerance, that the descent will end soon.
const EARLY: usize = 4;
const LATE: usize = 10;
const NEAR: f64 = 5.0;

/// The steps at which it is refreshed.
const REFRESHED_AT: [usize; 9] = [1, 3, 6, 10, 15, 22, 32, 46, 66];

/// While a handle is dragged it is built, and refreshed, after so many moves.
const DRAGGED: usize = 10;

/// A step that goes farther, in diagonals, has diverged: positions of up to 1e20 diagonals are
/// representable in the units of the input ([`crate::BoxUnits::of`]).
const FARTHEST: f64 = 1e18;

/// The foreseen step ends a run at this part of the tolerance: together with it a shape is within
/// 0.3 % of the size of the minimum.
const HONEST: f64 = 0.5;

impl<T: Scalar> Descent<T> {
    /// With a memory of so many steps; 0 takes plain steps.
    pub(crate) fn new(
        updater: Box<dyn ScalarFieldUpdater<T>>,
        model: Box<dyn LocalGlobal<T>>,
        memory: usize,
    ) -> Self {
        Self {
            updater,
            model,
            lbfgs: (memory > 0).then(|| Lbfgs::new(memory)),
            coarse: None,
            moves: 0,
            is_refused: false,
            winding: None,
            plain_part: 1.0,
            tension: VertexMap::default(),
            direction: VertexMap::default(),
            energy: None,
        }
    }

    fn solve(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        let n = work.laplacian.len();
        if self.tension.len() != n {
            self.tension = VertexMap::filled(n, Vector3::zeros());
        }
        let next = if work.since_move == 0 && self.energy.is_none() {
            NextStep::Taken
        } else {
            NextStep::Searched
        };
        self.model
            .wanted_tension(&work.rest, next, &mut self.tension);
        work.solve_with_tension(&mut self.tension)
    }

    /// The local step at the current positions, the field as it is.
    fn fit(&mut self, work: &mut Workspace<T>) -> Result<Energy, FlowError> {
        let energy = work.orient(|state, field, out| self.model.fit(state, field, out))?;
        let springs = work.spring_energy();
        let energy = Energy {
            value: energy.value + springs,
            size: energy.size + springs,
        };
        self.energy = Some(energy);
        Ok(energy)
    }

    /// One line search along the direction of the quasi-Newton model; the plain step where that
    /// fails. No step that raises the energy beyond rounding is accepted, the energy being that of
    /// the scalar field before the step.
    fn search(
        &mut self,
        lbfgs: &mut Lbfgs,
        restricted: Option<&Restricted>,
        work: &mut Workspace<T>,
    ) -> Result<Search, FlowError> {
        /// Fraction of the predicted decrease that is asked for (Armijo).
        const SUFFICIENT: f64 = 1e-4;
        const MAX_TRIALS: usize = 10;
        let before = self.energy.unwrap_or_default();
        // Near the minimum every step is one within rounding.
        let (value, rounding) = (before.value, before.rounding::<T>());
        let rate = self.aim(lbfgs, restricted, work);
        let mut length = 1.0;
        for _ in 0..MAX_TRIALS {
            self.move_along(work, length);
            let rise = 0.5 * (self.fit(work)?.value - value);
            if rise <= 0.5 * rounding - SUFFICIENT * length * rate {
                let now = work.current.positions().as_slice();
                let start = work.start.as_slice();
                lbfgs.stepped(
                    |step| parallel::fill(step, |i| (now[i] - start[i]).map(|x| x.as_f64() as f32)),
                    &mut work.terms.residual,
                    &mut work.terms.correction,
                );
                self.follow_field(work)?;
                return Ok(Search::Went);
            }
            // Minimum of the parabola through value, slope and the new value.
            let parabola = rate * length * length / (2.0 * (rise + length * rate));
            length = if parabola.is_finite() {
                parabola.clamp(0.1 * length, 0.5 * length)
            } else {
                0.1 * length
            };
        }
        lbfgs.reset();
        self.plain(work, 1.0)
    }

    /// The plain step, or a part of it that does not raise the energy beyond rounding. The system
    /// may know less than the energy: the whole step can go too far.
    fn plain(&mut self, work: &mut Workspace<T>, ratio: f64) -> Result<Search, FlowError> {
        const MAX_TRIALS: usize = 8;
        /// Fraction of the predicted decrease that is asked for. An energy that the system bounds
        /// from above falls by half of it; a step that falls by less goes beyond its best length.
        const SUFFICIENT: f64 = 0.45;
        let Some(before) = self.energy else {
            work.move_by_correction(ratio);
            self.update(work)?;
            self.follow_limbs(work)?;
            return Ok(Search::Went);
        };
        // Half the energy falls at this rate along the step; ratios of their own bend it.
        let rate = match work.settings.ratios {
            None => dot(
                work.terms.residual.as_slice(),
                work.terms.correction.as_slice(),
            ),
            Some(_) => 0.0,
        };
        let rounding = before.rounding::<T>();
        // Where rounding hides the energy, what was short enough last time is taken again.
        if rate * ratio > 4.0 * rounding {
            self.plain_part = (2.0 * self.plain_part).min(1.0);
        }
        for _ in 0..MAX_TRIALS {
            let length = ratio * self.plain_part;
            work.move_by_correction(length);
            let rise = 0.5 * (self.fit(work)?.value - before.value);
            if rise <= 0.5 * rounding - SUFFICIENT * length * rate {
                self.follow_field(work)?;
                return Ok(Search::Went);
            }
            self.plain_part *= 0.5;
        }
        self.plain_part = 1.0;
        let start = work.start.as_slice();
        work.current.write().as_mut_slice().copy_from_slice(start);
        self.fit(work)?;
        Ok(Search::Stalled)
    }

    /// After the plain step that follows a move: the step of Newton's method among the motions of
    /// the clusters, as far as it lowers the energy. Costs no solve.
    fn follow_limbs(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        const LENGTHS: [f64; 3] = [1.0, 0.5, 0.2];
        let Some(coarse) = self.coarse.take() else {
            return Ok(());
        };
        let before = self.energy.unwrap_or_default().value;
        let rest = work.rest.clone();
        self.model
            .wanted_tension(&rest, NextStep::Searched, &mut self.tension);
        work.measure_residual(&mut self.tension);
        work.add_point_forces();
        let r = coarse.restrict(&rest, work.terms.residual.as_slice());
        let q = coarse.newton_step(&r);
        let without = work.current.positions().clone();
        let mut has_moved = false;
        for length in LENGTHS {
            let start = without.as_slice();
            parallel::fill(work.current.write().as_mut_slice(), |i| {
                let step = coarse.prolong(&rest, &q, i) * length;
                start[i] + step.map(T::of_f64)
            });
            has_moved = self.fit(work)?.value < before;
            if has_moved {
                break;
            }
        }
        if !has_moved {
            *work.current.write() = without;
            self.fit(work)?;
        }
        self.coarse = Some(coarse);
        Ok(())
    }

    /// Chooses a direction. Returns the rate at which half the energy falls along it.
    fn aim(
        &mut self,
        lbfgs: &mut Lbfgs,
        restricted: Option<&Restricted>,
        work: &Workspace<T>,
    ) -> f64 {
        let terms = &work.terms;
        if self.direction.len() != terms.correction.len() {
            self.direction = terms.correction.clone();
        }
        let coarse = self.coarse.as_ref().zip(restricted);
        let (residual, correction) = (&terms.residual, &terms.correction);
        let (rate, q) = lbfgs.direction(residual, correction, coarse, &mut self.direction);
        if rate > 0.0 {
            if let Some((coarse, _)) = coarse {
                parallel::update(self.direction.as_mut_slice(), |i, step| {
                    *step += coarse.prolong(&work.rest, &q, i);
                });
            }
            return rate;
        }
        lbfgs.reset();
        let (residual, correction) = (terms.residual.as_slice(), terms.correction.as_slice());
        self.direction.as_mut_slice().copy_from_slice(correction);
        dot(residual, correction)
    }

    /// x ← start + length · direction.
    fn move_along(&self, work: &mut Workspace<T>, length: f64) {
        let (start, direction) = (work.start.as_slice(), self.direction.as_slice());
        parallel::fill(work.current.write().as_mut_slice(), |i| {
            start[i] + (direction[i] * length).map(T::of_f64)
        });
    }

    /// Builds or refreshes the coarse correction where that is due.
    fn update_coarse(&mut self, lbfgs: &mut Lbfgs, work: &Workspace<T>, residual: f64) {
        // The first step that is searched for is number 1. Quick descents end before it is built.
        let step = work.since_move.saturating_sub(1);
        let is_first = step == 0;
        let is_near = residual < NEAR * work.settings.tolerance;
        // A handle that is dragged moves before every step.
        let is_dragged = is_first && self.moves.is_multiple_of(DRAGGED);
        let is_due = is_dragged || step >= if is_near { LATE } else { EARLY };
        // The coarse model knows no ties: parts without handles would be free in it.
        if !work.rest.ties().is_empty() {
            return;
        }
        let Some(cells) = self.model.cells() else {
            return;
        };
        // The step is not taken yet: the positions are those before it.
        let (rest, field, positions) = (&*work.rest, &work.field, &work.start);
        match &mut self.coarse {
            None if is_due && !self.is_refused => {
                self.coarse = Coarse::new(work, field, &cells, positions);
                self.is_refused = self.coarse.is_none();
                lbfgs.reset();
            }
            None => {}
            Some(coarse) if is_dragged || REFRESHED_AT.contains(&step) => {
                if coarse.refresh(rest, field, &cells, positions) {
                    lbfgs.refreshed(coarse);
                } else {
                    self.coarse = None;
                    lbfgs.reset();
                }
            }
            Some(_) => {}
        }
    }

    /// The residual as the coarse correction sees it.
    fn restrict(&self, work: &Workspace<T>) -> Option<Restricted> {
        let coarse = self.coarse.as_ref()?;
        let r = coarse.restrict(&work.rest, work.terms.residual.as_slice());
        Some(Restricted {
            corrected: coarse.apply(&r),
            r,
        })
    }

    /// After a step that was judged with the field kept: lets the field follow.
    fn follow_field(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        if self.updater.is_constant() {
            return Ok(());
        }
        self.update(work)
    }
}

impl<T: Scalar> Rule<T> for Descent<T> {
    fn begin(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        if let Some(guess) = work.first_guess.take() {
            work.scale = guess.scale;
            self.model.start_from(&guess);
            let swelling = guess.swelling.as_ref().map(|s| s.as_slice());
            if guess.scale != 1.0 || swelling.is_some() {
                parallel::update(work.laplacian.as_mut_slice(), |i, ell| {
                    *ell *= T::of_f64(guess.scale * swelling.map_or(1.0, |s| s[i]));
                });
            }
        }
        work.pin();
        Ok(())
    }

    fn step(&mut self, work: &mut Workspace<T>) -> Result<StepReport, FlowError> {
        self.solve(work)?;
        let before = self.energy;
        let energy_rounding = before.map_or(0.0, |energy| energy.rounding::<T>());
        let Some(step) = work.advance() else {
            return Ok(StepReport {
                energy: before.map(|energy| energy.value),
                energy_rounding,
                ..work.diverged()
            });
        };
        let mut lbfgs = self.lbfgs.take();
        let mut residual = step.residual;
        let mut tolerance = work.settings.tolerance;
        if step.is_first {
            self.moves += 1;
        }
        if let Some(lbfgs) = &mut lbfgs
            && step.ratio == 1.0
        {
            self.update_coarse(lbfgs, work, step.residual);
        }
        let is_searched = lbfgs.is_some() && !step.is_first && step.ratio == 1.0;
        let restricted = is_searched.then(|| self.restrict(work)).flatten();
        if let (Some(coarse), Some(restricted)) = (&self.coarse, &restricted) {
            // The length of the step to the minimum as both levels foresee it.
            let (rest, correction) = (&*work.rest, work.terms.correction.as_slice());
            let length = |i: usize| {
                (correction[i] + coarse.prolong(rest, &restricted.corrected, i)).norm_squared()
            };
            let longest = parallel::max(correction.len(), length).sqrt();
            residual = longest / rest.diagonal().as_f64();
            tolerance *= HONEST;
        }
        let is_short = step.ratio * residual < tolerance;
        let converged = is_short && !step.is_first;
        let search = match &mut lbfgs {
            Some(lbfgs) if !step.is_first && !converged && step.ratio == 1.0 => {
                self.search(lbfgs, restricted.as_ref(), work)
            }
            other => {
                if let Some(lbfgs) = other {
                    // Its history describes whole steps of its own only.
                    lbfgs.reset();
                }
                self.plain(work, step.ratio)
            }
        };
        self.lbfgs = lbfgs;
        let search = search?;
        let change = work.longest_move();
        if !(change < FARTHEST) || self.energy.is_some_and(|energy| !energy.value.is_finite()) {
            // Lengths beyond what the numbers can hold: the shape before the step is kept.
            let start = work.start.as_slice();
            work.current.write().as_mut_slice().copy_from_slice(start);
            self.energy = before;
            return Ok(StepReport {
                energy: before.map(|energy| energy.value),
                energy_rounding,
                residual: f64::NAN,
                ..StepReport::new(work.iteration, f64::NAN)
            });
        }
        Ok(StepReport {
            change,
            residual,
            energy: self.energy.map(|energy| energy.value),
            energy_rounding,
            converged,
            stalled: search == Search::Stalled,
            ..StepReport::new(work.iteration, 0.0)
        })
    }

    fn update(&mut self, work: &mut Workspace<T>) -> Result<(), FlowError> {
        work.update_field(&mut *self.updater)?;
        self.fit(work).map(|_| ())
    }

    fn restart(&mut self, work: &mut Workspace<T>) {
        work.pin();
        self.energy = None;
        self.coarse = self
            .coarse
            .take()
            .filter(|c| c.is_for(&work.rest, &work.targets));
        self.is_refused = false;
        self.plain_part = 1.0;
        // Handles have moved on: what they stated first is no longer the yardstick.
        self.winding = None;
        if let Some(lbfgs) = &mut self.lbfgs {
            lbfgs.reset();
        }
    }

    fn wind(&mut self, winding: Option<Winding>) {
        self.model.wind(winding.as_ref());
        self.winding = winding;
    }

    fn lost_turn(&self) -> Option<LostTurn> {
        /// Parts that keep their turn come to 90° from it at most, parts that lose it to 170°.
        const LOST: f64 = 130.0;
        /// The angle that a body holds per diameter, in degrees, and the number of diameters that
        /// struts are worth, which keep the ends from collapsing: bars of 3 : 1 to 9 : 1 and rods
        /// lose their turns within 15 % of this.
        const HELD: f64 = 80.0;
        const BY_STRUTS: f64 = 1.7;
        let (cells, winding) = (self.model.cells()?, self.winding.as_ref()?);
        let mut back = 0.0_f64;
        for (now, wound) in cells.rotations.iter().zip(winding.rotations.values()) {
            let trace: f64 = now.iter().zip(wound.iter()).map(|(a, b)| a * b).sum();
            back = back.max((0.5 * (trace - 1.0)).clamp(-1.0, 1.0).acos());
        }
        let by_struts = if cells.has_struts() { BY_STRUTS } else { 0.0 };
        (back > LOST.to_radians()).then_some(LostTurn {
            back,
            held: (winding.diameters + by_struts) * HELD.to_radians(),
        })
    }

    fn pins_handles(&self) -> bool {
        true
    }

    fn energy(&self) -> Option<f64> {
        self.energy.map(|energy| energy.value)
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use cotan_geometry::shapes::icosphere;
    use cotan_halfedge::{VertexId, VertexMap};
    use cotan_linear::Hold;
    use nalgebra::Vector3;

    use super::*;
    use crate::energy::Hybrid;
    use crate::flow::tests::{build, farthest, handles};
    use crate::updater::KeepMagnitude;
    use crate::{Acceleration, StopReason};

    /// Half the energy's derivative along a direction is minus the residual's product with it.
    #[test]
    fn the_residual_is_half_the_negative_gradient() {
        let shape = icosphere::<f64>(2);
        let mut held = handles(&shape);
        let last = held.len() - 1;
        held[last].0.hold = Hold::Soft(0.3);
        let flow = build(&shape).handles(held).build().unwrap();
        let (mut work, _) = flow.into_parts();
        let mut hybrid = Hybrid::default();
        hybrid.begin(&work.rest).unwrap();
        let mut descent = Descent::new(Box::new(KeepMagnitude), Box::new(hybrid), 0);
        for _ in 0..3 {
            descent.step(&mut work).unwrap();
        }
        descent.solve(&mut work).unwrap();
        let residual = work.terms.residual.clone();
        work.start = work.current.positions().clone();
        let mut direction = VertexMap::from_fn(work.start.len(), |v: VertexId| {
            let i = v.index() as f64;
            Vector3::new(i.sin(), (2.0 * i).cos(), 0.3)
        });
        for handle in work.targets.handles() {
            if handle.hold == Hold::Hard {
                direction[handle.vertex] = Vector3::zeros();
            }
        }
        descent.direction = direction.clone();
        let step = 1e-4;
        let mut energy_at = |length: f64| {
            descent.move_along(&mut work, length);
            descent.update(&mut work).unwrap();
            Rule::<f64>::energy(&descent).unwrap()
        };
        let slope = (energy_at(step) - energy_at(-step)) / (2.0 * step);
        let expected = -2.0 * dot(residual.as_slice(), direction.as_slice());
        assert!(
            (slope - expected).abs() < 1e-6 * expected.abs(),
            "{slope} {expected}"
        );
    }

    #[test]
    fn plain_and_accelerated_descents_meet() {
        let shape = icosphere::<f64>(3);
        let run = |acceleration| {
            let mut flow = build(&shape)
                .acceleration(acceleration)
                .tolerance(1e-9)
                .iteration_limit(5000)
                .build()
                .unwrap();
            let report = flow.run(|_, _| ControlFlow::Continue(())).unwrap();
            assert_eq!(report.stop, StopReason::Converged);
            (flow.positions(), report.iterations)
        };
        let (plain, many) = run(Acceleration::Off);
        let (accelerated, few) = run(Acceleration::default());
        assert!(2 * few < many, "{few} {many}");
        assert!(farthest(&plain, &accelerated) < 1e-5);
    }
}
