//! The updating ratio s: the part of a full step that the vertices take.

use crate::error::FlowError;

/// The updating ratio of step 1, x ← (1 − s) x + s x̃ (paper, equation 8), over the iterations
/// since a handle last moved.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Schedule {
    /// The same ratio throughout.
    Constant(f64),
    /// From `from` to `to` in equal steps, then `to`.
    Decay {
        /// Ratio of the first iteration, and of every one while a handle moves.
        from: f64,
        /// The last ratio.
        to: f64,
        /// The number of steps.
        steps: usize,
    },
}

impl Schedule {
    /// Full steps.
    pub const FULL: Self = Self::Constant(1.0);

    /// The paper's: 1 while a handle moves, then down to 0.1 in five steps (section 3.2).
    ///
    /// It makes every change look ten times smaller: a flow that "converged" under it may be at
    /// ten times the tolerance.
    pub const PAPER: Self = Self::Decay {
        from: 1.0,
        to: 0.1,
        steps: 5,
    };

    /// The ratio of the iteration with index `since_move`.
    pub fn ratio(&self, since_move: usize) -> f64 {
        match *self {
            Self::Constant(s) => s,
            Self::Decay { to, steps, .. } if since_move >= steps => to,
            Self::Decay { from, to, steps } => {
                from + (to - from) * (since_move as f64 / steps as f64)
            }
        }
    }

    pub(crate) fn check(&self) -> Result<(), FlowError> {
        let ends = match *self {
            Self::Constant(s) => [s, s],
            Self::Decay { from, to, .. } => [from, to],
        };
        match ends.into_iter().find(|s| !(*s > 0.0 && *s <= 1.0)) {
            Some(value) => Err(FlowError::Setting {
                setting: "updating ratio",
                range: "above 0 and at most 1",
                value,
            }),
            None => Ok(()),
        }
    }
}

impl Default for Schedule {
    fn default() -> Self {
        Self::FULL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_schedule_reaches_a_tenth_in_five_steps() {
        let ratios: Vec<f64> = (0..8).map(|k| Schedule::PAPER.ratio(k)).collect();
        assert_eq!(ratios[0], 1.0);
        assert!(ratios.windows(2).all(|w| w[1] <= w[0]));
        assert!((ratios[4] - 0.28).abs() < 1e-12);
        assert!(ratios[5..].iter().all(|s| *s == 0.1));
        let at_once = Schedule::Decay {
            from: 1.0,
            to: 0.2,
            steps: 0,
        };
        assert_eq!(at_once.ratio(0), 0.2);
    }

    #[test]
    fn ratios_outside_of_0_to_1_are_refused() {
        assert!(Schedule::Constant(0.0).check().is_err());
        assert!(Schedule::Constant(f64::NAN).check().is_err());
        let error = Schedule::Constant(1.5).check().unwrap_err().to_string();
        assert!(
            error.contains("updating ratio") && error.contains("1.5"),
            "{error}"
        );
    }
}
