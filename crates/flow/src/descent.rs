//! A step of an orientation with an energy: a line search that never goes uphill.

use cotan_geometry::Scalar;

use crate::error::FlowError;
use crate::flow::Flow;
use crate::lbfgs::Lbfgs;
use crate::step::Field;
use crate::vectors::{dot, fill};

/// Whether a descent found a lower energy.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Descent {
    Went,
    Stalled,
}

impl<T: Scalar> Flow<'_, T> {
    /// One line search along the direction of the quasi-Newton model; the plain step where that
    /// fails. No step that raises the energy beyond rounding is accepted, the energy being that of
    /// the scalar field before the step.
    pub(crate) fn descend(&mut self, lbfgs: &mut Lbfgs) -> Result<Descent, FlowError> {
        /// Fraction of the predicted decrease that is asked for (Armijo).
        const SUFFICIENT: f64 = 1e-4;
        const MOST_TRIALS: usize = 10;
        let before = self.energy.unwrap_or_default();
        // Near the minimum every step is one within rounding.
        let (value, rounding) = (before.value, before.rounding::<T>());
        let terms = &mut self.terms;
        // Half the energy falls at this rate along the direction.
        let mut rate = lbfgs.direction(&terms.residual, &terms.correction, &mut terms.direction);
        if !(rate > 0.0) {
            lbfgs.reset();
            let (residual, correction) = (terms.residual.as_slice(), terms.correction.as_slice());
            terms.direction.as_mut_slice().copy_from_slice(correction);
            rate = dot(residual, correction);
        }

        let mut length = 1.0;
        for _ in 0..MOST_TRIALS {
            self.move_along(length);
            self.refresh(Field::Kept)?;
            let rise = 0.5 * (self.energy.unwrap_or_default().value - value);
            if rise <= 0.5 * rounding - SUFFICIENT * length * rate {
                let (now, start) = (self.positions.as_slice(), self.start.as_slice());
                lbfgs.stepped(
                    |step| fill(step, |i| (now[i] - start[i]).map(|x| x.as_f64() as f32)),
                    &mut self.terms.residual,
                    &mut self.terms.correction,
                );
                self.follow_field()?;
                return Ok(Descent::Went);
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
        self.move_by_correction(1.0);
        self.refresh(Field::Kept)?;
        if self.energy.unwrap_or_default().value <= value + rounding {
            self.follow_field()?;
            return Ok(Descent::Went);
        }
        let start = self.start.as_slice();
        self.positions.as_mut_slice().copy_from_slice(start);
        self.refresh(Field::Kept)?;
        Ok(Descent::Stalled)
    }

    /// After a step that was judged with the field kept: lets the field follow.
    fn follow_field(&mut self) -> Result<(), FlowError> {
        if self.parts.updater.is_constant() {
            return Ok(());
        }
        self.update()
    }

    /// x ← start + length · direction.
    fn move_along(&mut self, length: f64) {
        self.is_seen = false;
        let (start, direction) = (self.start.as_slice(), self.terms.direction.as_slice());
        fill(self.positions.as_mut_slice(), |i| {
            start[i] + (direction[i] * length).map(T::of_f64)
        });
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
    use crate::step::tests::{build, farthest, handles};
    use crate::{Acceleration, StopReason};

    /// Half the energy's derivative along a direction is minus the residual's product with it.
    #[test]
    fn the_residual_is_half_the_negative_gradient() {
        let shape = icosphere::<f64>(2);
        let mut held = handles(&shape);
        let last = held.len() - 1;
        held[last].0.hold = Hold::Soft(0.3);
        let mut flow = build(&shape)
            .handles(held)
            .acceleration(Acceleration::Off)
            .build()
            .unwrap();
        for _ in 0..3 {
            flow.step().unwrap();
        }
        flow.solve();
        let residual = flow.terms.residual.clone();
        flow.start = flow.positions.clone();
        let mut direction = VertexMap::from_fn(flow.start.len(), |v: VertexId| {
            let i = v.index() as f64;
            Vector3::new(i.sin(), (2.0 * i).cos(), 0.3)
        });
        for handle in flow.handles().iter().filter(|h| h.hold == Hold::Hard) {
            direction[handle.vertex] = Vector3::zeros();
        }
        flow.terms.direction = direction.clone();
        let step = 1e-4;
        let mut energy_at = |length: f64| {
            flow.move_along(length);
            flow.update().unwrap();
            flow.energy().unwrap()
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
