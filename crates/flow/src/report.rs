//! Reports of a step and of a whole run.

use cotan_linear::Choice;

/// The report of one iteration.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct StepReport {
    /// The count of iterations since the flow was built, from 1. Each costs one solve.
    pub iteration: usize,
    /// The paper's criterion: the longest move of a vertex in this iteration, as a ratio of the
    /// bounding box's diagonal.
    pub change: f64,
    /// The longest move that a full plain step from here would make, in the same unit: how far
    /// the shape is from being a fixed point, whatever the schedule and the acceleration. Where
    /// vertices have ratios of their own, each counts by its ratio.
    pub residual: f64,
    /// The energy after the step, for a flow that descends one.
    pub energy: Option<f64>,
    /// Energies that differ by less are the same but for rounding; 0 without an energy.
    pub energy_rounding: f64,
    /// `true` if the distance left to go, as the solver predicts it, is below the tolerance.
    pub converged: bool,
    /// `true` if no step lowers the energy any further, within rounding.
    pub stalled: bool,
}

impl StepReport {
    /// For an iteration outside a flow: a plain step of this length.
    #[must_use]
    pub fn new(iteration: usize, change: f64) -> Self {
        Self {
            iteration,
            change,
            residual: change,
            energy: None,
            energy_rounding: 0.0,
            converged: false,
            stalled: false,
        }
    }
}

/// Why a run stopped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum StopReason {
    /// No vertex has farther to go than the tolerance, as the solver predicts it.
    Converged,
    /// The limit of iterations was reached first.
    IterationLimit,
    /// The observer asked to stop.
    Cancelled,
    /// No step lowers the energy any further, within rounding, though the tolerance is not met.
    Stalled,
    /// The next positions would not have been finite; the last finite ones are kept.
    Diverged,
}

impl StopReason {
    /// The reason as a word: `converged`, `iteration limit`, …
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::IterationLimit => "iteration limit",
            Self::Cancelled => "cancelled",
            Self::Stalled => "stalled",
            Self::Diverged => "diverged",
        }
    }
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The end of a run.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
#[must_use = "a run may have stopped without converging"]
pub struct Report {
    /// Iterations of this run; each costs one solve.
    pub iterations: usize,
    /// Why it stopped.
    pub stop: StopReason,
    /// The last step's [`StepReport::change`].
    pub change: f64,
    /// The last step's [`StepReport::residual`].
    pub residual: f64,
    /// The last energy, for a flow that descends one.
    pub energy: Option<f64>,
    /// The strategy for the linear system, and the reason for it.
    pub solver: Option<Choice>,
    /// A turn that was lost: handles were stated to turn by more than half a turn relative to each
    /// other, and the energy did not hold that.
    pub lost_turn: Option<LostTurn>,
}

/// A turn of more than half a turn that the energy did not hold.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub struct LostTurn {
    /// The angle in radians by which some part has turned back.
    pub back: f64,
    /// An estimate of the widest angle in radians that this shape holds between the two handles
    /// that turn most relative to each other: about 80° for each of its diameters between them,
    /// and 140° more with struts. The twist gathers in the thin parts of a shape, so that thicker
    /// ones count less.
    pub held: f64,
}

impl Default for Report {
    /// For a run that has not begun.
    fn default() -> Self {
        Self {
            iterations: 0,
            stop: StopReason::IterationLimit,
            change: f64::INFINITY,
            residual: f64::INFINITY,
            energy: None,
            solver: None,
            lost_turn: None,
        }
    }
}
