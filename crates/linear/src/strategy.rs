//! How a system is solved, and who decides it.

use crate::columns::{self, Columns};
use crate::cost::{self, Estimate};
use crate::error::LinearError;
use crate::normal::NormalEquations;
use crate::problem::{Held, Problem};
use crate::pseudo_inverse;

/// How a system is solved.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Strategy {
    /// What is predicted to be the fastest and fits into memory.
    #[default]
    Auto,
    /// The normal equations LᵀL + μK + D, hard handles eliminated: for every operator and any number
    /// of handles, but factorized again for other handles.
    Normal,
    /// Factors of the one-ring matrix, which serve every set of handles, and a column of the inverse
    /// for each handle: for few handles, weights that are symmetric (or are when each row is scaled, as
    /// Tutte's), and no membrane or one that is proportional to the operator.
    Columns,
}

impl Strategy {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Auto, Self::Normal, Self::Columns];

    /// Its name, for options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Normal => "normal",
            Self::Columns => "columns",
        }
    }
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a system is solved the way it is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Reason {
    /// It was asked for.
    Requested,
    /// It is predicted to be the fastest.
    Fastest,
    /// The fastest would take more memory than is allowed.
    Memory,
    /// The weights are not symmetric, whatever the scale of the rows.
    GeneralWeights,
    /// There is a membrane that is not proportional to the operator.
    OtherMembrane,
    /// The one-ring matrix cannot be factorized, or not accurately.
    Indefinite,
    /// The handles are so close together that their columns cannot be told apart.
    IllConditioned,
}

impl Reason {
    /// The reason in words, to follow "because".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Requested => "it was asked for",
            Self::Fastest => "it is predicted to be the fastest",
            Self::Memory => "the fastest strategy would take more memory than is allowed",
            Self::GeneralWeights => "the weights are not symmetric, whatever the scale of the rows",
            Self::OtherMembrane => "the membrane is not proportional to the operator",
            Self::Indefinite => "the one-ring matrix cannot be factorized accurately",
            Self::IllConditioned => "the handles are too close together to be told apart",
        }
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// How a system is solved, and why so.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct Choice {
    /// Never [`Strategy::Auto`].
    pub strategy: Strategy,
    /// Why.
    pub reason: Reason,
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.strategy, self.reason)
    }
}

/// Settings of a system.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct SystemOptions {
    /// How to solve it.
    pub strategy: Strategy,
    /// The most memory that factors and columns may take, in bytes. What they take is predicted
    /// before anything is factorized, by a rule of growth: it may be off by a factor of two.
    pub max_memory: Option<u64>,
    /// How many corrections are going to be asked for, roughly: what decides whether a costly
    /// factorization with cheap solves pays. Default: 20.
    pub expected_solves: usize,
}

impl Default for SystemOptions {
    fn default() -> Self {
        Self::new()
    }
}

impl SystemOptions {
    /// The defaults.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            strategy: Strategy::Auto,
            max_memory: None,
            expected_solves: 20,
        }
    }

    /// Sets [`Self::strategy`].
    #[must_use]
    pub const fn strategy(mut self, strategy: Strategy) -> Self {
        self.strategy = strategy;
        self
    }

    /// Sets [`Self::max_memory`].
    #[must_use]
    pub const fn max_memory(mut self, bytes: u64) -> Self {
        self.max_memory = Some(bytes);
        self
    }

    /// Sets [`Self::expected_solves`].
    #[must_use]
    pub const fn expected_solves(mut self, solves: usize) -> Self {
        self.expected_solves = solves;
        self
    }
}

/// What solves a problem.
pub(crate) enum Solver {
    Normal(Box<NormalEquations>),
    Columns(Box<Columns>),
}

/// What is known before anything is factorized.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plan {
    /// What to try first, and why.
    pub(crate) choice: Choice,
    normal: Estimate,
}

impl Plan {
    /// Plans for `held` in the place of the problem's own handles. `at_hand` is what solves the problem
    /// by now.
    pub(crate) fn new(
        problem: &Problem,
        held: &Held,
        options: &SystemOptions,
        at_hand: Option<&Solver>,
    ) -> Result<Self, LinearError> {
        let n = problem.num_vertices();
        let normal = cost::normal(n - held.num_hard, options.expected_solves);
        let (factors, missing) = match at_hand {
            Some(Solver::Columns(columns)) => (0, columns.num_missing(problem, held)),
            _ => (
                1 + usize::from(problem.membrane.is_some()),
                columns::num_columns(problem, held),
            ),
        };
        let columns = cost::columns(&cost::ColumnsPlan {
            num_vertices: n,
            new_factors: factors,
            solves: 1 + usize::from(problem.membrane.is_some()),
            new_columns: missing,
            columns: columns::num_columns(problem, held),
            corrections: options.expected_solves,
        });
        let obstacle = pseudo_inverse::obstacle(problem);
        let fits = |estimate: &Estimate| options.max_memory.is_none_or(|max| estimate.bytes <= max);
        let choice = |strategy, reason| Choice { strategy, reason };
        let choice = match (options.strategy, obstacle) {
            (Strategy::Normal, _) => choice(Strategy::Normal, Reason::Requested),
            (Strategy::Columns, None) => choice(Strategy::Columns, Reason::Requested),
            (Strategy::Columns, Some(reason)) => {
                return Err(LinearError::StrategyUnsuitable {
                    strategy: Strategy::Columns,
                    reason,
                });
            }
            (Strategy::Auto, Some(reason)) => choice(Strategy::Normal, reason),
            (Strategy::Auto, None) => match (columns.seconds <= normal.seconds, fits(&columns)) {
                (true, true) => choice(Strategy::Columns, Reason::Fastest),
                (true, false) => choice(Strategy::Normal, Reason::Memory),
                (false, true) if !fits(&normal) => choice(Strategy::Columns, Reason::Memory),
                (false, _) => choice(Strategy::Normal, Reason::Fastest),
            },
        };
        let plan = Self { choice, normal };
        plan.check_memory(
            if choice.strategy == Strategy::Columns {
                &columns
            } else {
                &normal
            },
            options,
        )?;
        Ok(plan)
    }

    fn check_memory(
        &self,
        estimate: &Estimate,
        options: &SystemOptions,
    ) -> Result<(), LinearError> {
        match options.max_memory {
            Some(permitted) if estimate.bytes > permitted => Err(LinearError::MemoryLimit {
                strategy: self.choice.strategy,
                predicted: estimate.bytes,
                permitted,
            }),
            _ => Ok(()),
        }
    }

    /// Does what was planned. Where the columns turn out not to serve, the normal equations do, unless
    /// the columns were asked for.
    pub(crate) fn carry_out(
        self,
        options: &SystemOptions,
        columns: impl FnOnce() -> Result<Solver, LinearError>,
        normal: impl FnOnce() -> Result<Solver, LinearError>,
    ) -> Result<(Solver, Choice), LinearError> {
        if self.choice.strategy != Strategy::Columns {
            return Ok((normal()?, self.choice));
        }
        match columns() {
            Ok(solver) => Ok((solver, self.choice)),
            Err(error) => {
                let plan = self.without_columns(error, options)?;
                Ok((normal()?, plan.choice))
            }
        }
    }

    /// What remains after the columns have failed.
    pub(crate) fn without_columns(
        self,
        error: LinearError,
        options: &SystemOptions,
    ) -> Result<Self, LinearError> {
        let reason = match error {
            LinearError::OutOfMemory { .. } => return Err(error),
            _ if options.strategy == Strategy::Columns => return Err(error),
            LinearError::IllConditioned { .. } => Reason::IllConditioned,
            _ => Reason::Indefinite,
        };
        let choice = Choice {
            strategy: Strategy::Normal,
            reason,
        };
        let plan = Self { choice, ..self };
        plan.check_memory(&self.normal, options)?;
        Ok(plan)
    }
}
