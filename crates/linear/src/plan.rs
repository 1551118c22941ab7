//! The choice between the strategies, and the fallback to the next one.

use std::sync::Arc;

use cotan_sparse::{SparseError, Symbolic};

use crate::columns::{self, Columns};
use crate::cost::{self, Estimate};
use crate::error::LinearError;
use crate::normal::NormalEquations;
use crate::problem::{Held, Problem};
use crate::pseudo_inverse::{self, Means};
use crate::storage::{Limit, Storage};
use crate::strategy::{Choice, Method, Reason, Strategy, SystemOptions};

/// The solver of a problem.
pub(crate) enum Solver {
    Normal(Box<NormalEquations>),
    Columns(Box<Columns>),
}

/// The plan before anything is factorized.
#[derive(Clone)]
pub(crate) struct Plan {
    /// The method to try first, and the reason.
    pub(crate) choice: Choice,
    normal: Estimate,
    columns: Estimate,
    iterative: Estimate,
    /// `true` if the one-ring matrices can stand for the problem.
    has_columns: bool,
    /// The number of factors, and the bytes of the columns in addition, for the strategy of
    /// columns.
    num_factors: u64,
    column_bytes: u64,
    /// The analysis of the one-ring matrices, where it was needed to decide.
    analysis: Option<Arc<Symbolic>>,
    options: SystemOptions,
}

impl Plan {
    /// Plans for `held` in the place of the problem's own handles. `current` is the solver of
    /// the problem so far.
    pub(crate) fn new(
        problem: &Problem,
        held: &Held,
        options: &SystemOptions,
        current: Option<(&Solver, Method)>,
    ) -> Result<Self, LinearError> {
        let n = problem.num_vertices();
        let solves = 1 + usize::from(problem.membrane.is_some());
        let num_columns = columns::num_columns(problem, held);
        let estimate = |method: Method, size: f64| {
            let (new_factors, new_columns) = match current {
                Some((Solver::Columns(columns), other)) if other == method => {
                    (0, columns.num_missing(problem, held))
                }
                _ => (solves, num_columns),
            };
            let plan = cost::ColumnsPlan {
                num_vertices: n,
                new_factors,
                solves,
                new_columns,
                columns: num_columns,
                corrections: options.expected_solves,
                precision: options.precision,
                size,
            };
            match method {
                Method::Iterative => cost::iterative(&plan),
                _ => cost::columns(&plan),
            }
        };
        let obstacle = pseudo_inverse::obstacle(problem);
        let requested = |method| Choice {
            method,
            reason: Reason::Requested,
        };
        let mut plan = Self {
            choice: requested(Method::Normal),
            normal: cost::normal(n - held.num_hard, options.expected_solves, 1.0),
            columns: estimate(Method::Columns, 1.0),
            iterative: estimate(Method::Iterative, 1.0),
            has_columns: obstacle.is_none(),
            num_factors: solves as u64,
            column_bytes: cost::column_bytes(n, num_columns),
            analysis: None,
            options: *options,
        };
        match (options.strategy, obstacle) {
            (Strategy::Columns | Strategy::Iterative, Some(reason)) => {
                return Err(LinearError::StrategyUnsuitable {
                    strategy: options.strategy,
                    reason,
                });
            }
            (Strategy::Auto, Some(reason)) => {
                plan.choice = Choice {
                    method: Method::Normal,
                    reason,
                };
            }
            (Strategy::Auto, None) => {
                if current.is_none() && plan.is_close() {
                    // The size of the factor decides; it is known from the analysis.
                    let analysis = pseudo_inverse::analyse(problem)?;
                    let size = analysis.num_entries() as f64 / cost::one_ring_entries(n);
                    plan.normal = cost::normal(n - held.num_hard, options.expected_solves, size);
                    plan.columns = estimate(Method::Columns, size);
                    plan.analysis = Some(analysis);
                }
                plan.choice = plan.fastest(&[Method::Columns, Method::Normal, Method::Iterative]);
            }
            (Strategy::Normal, _) => plan.choice = requested(Method::Normal),
            (Strategy::Columns, None) => plan.choice = requested(Method::Columns),
            (Strategy::Iterative, None) => plan.choice = requested(Method::Iterative),
        }
        Ok(plan)
    }

    /// Returns `true` if the rules of growth leave the decision open.
    fn is_close(&self) -> bool {
        const CLEAR: f64 = 4.0;
        let ratio = self.columns.seconds / self.normal.seconds;
        let is_tight = self.options.max_memory.is_some_and(|max| {
            let bytes = self.columns.bytes.min(self.normal.bytes);
            bytes > max / 4
        });
        is_tight || (1.0 / CLEAR..CLEAR).contains(&ratio)
    }

    fn estimate(&self, method: Method) -> &Estimate {
        match method {
            Method::Columns => &self.columns,
            Method::Iterative => &self.iterative,
            Method::Normal => &self.normal,
        }
    }

    /// The fastest that fits, or the fastest of all if none does. The iteration is for what does
    /// not fit: its speed depends on the mesh too much to be predicted.
    fn fastest(&self, methods: &[Method]) -> Choice {
        let fits = |m: &Method| {
            let bytes = self.estimate(*m).bytes;
            self.options.max_memory.is_none_or(|max| bytes <= max)
        };
        let rank = |a: &&Method, b: &&Method| {
            let key = |m: &Method| (*m == Method::Iterative, self.estimate(*m).seconds);
            let (a, b) = (key(a), key(b));
            a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
        };
        let first = methods.iter().min_by(rank);
        let fitting = methods.iter().filter(|m| fits(m)).min_by(rank);
        let method = *fitting.or(first).unwrap_or(&Method::Normal);
        let reason = if Some(&method) == first {
            Reason::Fastest
        } else {
            Reason::Memory
        };
        Choice { method, reason }
    }

    /// Runs the planned strategy, and falls back to the next one if it fails or does not fit in
    /// memory, unless it was requested.
    pub(crate) fn carry_out(
        mut self,
        columns: impl Fn(&Means) -> Result<Solver, LinearError>,
        normal: impl Fn(&Storage) -> Result<Solver, LinearError>,
    ) -> Result<(Solver, Choice), LinearError> {
        loop {
            let result = match self.choice.method {
                Method::Columns => columns(&Means::Factor(self.storage())),
                Method::Iterative => self
                    .check_iterative()
                    .and_then(|()| columns(&Means::Iteration)),
                Method::Normal => normal(&self.storage()),
            };
            match result {
                Ok(solver) => return Ok((solver, self.choice)),
                Err(error) => self = self.after(error)?,
            }
        }
    }

    /// The plan after the chosen strategy has failed.
    pub(crate) fn after(self, error: LinearError) -> Result<Self, LinearError> {
        if self.options.strategy != Strategy::Auto {
            return Err(error);
        }
        let too_large = matches!(error, LinearError::MemoryLimit { .. });
        let next = match (self.choice.method, too_large) {
            // Where the normal equations are the fastest there are many handles: their columns
            // would be larger still.
            (Method::Columns, true) if self.has_columns => Method::Iterative,
            (Method::Columns | Method::Iterative, false) => Method::Normal,
            _ => return Err(error),
        };
        let reason = match error {
            LinearError::Sparse(SparseError::OutOfMemory { .. }) => return Err(error),
            LinearError::MemoryLimit { .. } => Reason::Memory,
            LinearError::IllConditioned { .. } => Reason::IllConditioned,
            _ => Reason::Indefinite,
        };
        Ok(Self {
            choice: Choice {
                method: next,
                reason,
            },
            ..self
        })
    }

    fn storage(&self) -> Storage {
        let by_columns = self.choice.method == Method::Columns;
        Storage {
            precision: self.options.precision,
            analysis: self.analysis.clone().filter(|_| by_columns),
            limit: self.options.max_memory.map(|permitted| Limit {
                strategy: self.choice.method.into(),
                factors: if by_columns { self.num_factors } else { 1 },
                in_addition: if by_columns { self.column_bytes } else { 0 },
                permitted,
            }),
        }
    }

    fn check_iterative(&self) -> Result<(), LinearError> {
        let predicted = self.iterative.bytes;
        match self.options.max_memory {
            Some(permitted) if predicted > permitted => Err(LinearError::MemoryLimit {
                strategy: Strategy::Iterative,
                predicted,
                permitted,
            }),
            _ => Ok(()),
        }
    }
}
