//! The strategies that solve a system, and the choice between them.

use std::sync::Arc;

use cotan_sparse::{Precision, SparseError, Symbolic};

use crate::columns::{self, Columns};
use crate::cost::{self, Estimate};
use crate::error::LinearError;
use crate::normal::NormalEquations;
use crate::problem::{Held, Problem};
use crate::pseudo_inverse::{self, Means};
use crate::storage::{Limit, Storage};

/// A method of solving a system, or the request to choose one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Strategy {
    /// The one that is predicted to be the fastest and fits into memory.
    #[default]
    Auto,
    /// The normal equations LᵀL + μK + D, hard handles eliminated: for every operator and any
    /// number of handles, but factorized again for other handles.
    Normal,
    /// Factors of the one-ring matrix, which serve every set of handles, and a column of the
    /// inverse for each handle: for few handles, weights that are symmetric (or are when each row
    /// is scaled, as Tutte's), and no membrane or one that is proportional to the operator.
    Columns,
    /// As [`Self::Columns`], but the one-ring matrices are not factorized: each solve is an
    /// iteration, conjugate gradients preconditioned by multigrid. Memory grows in proportion to
    /// the mesh; a solve takes some ten times as long. Where no factor fits into memory.
    Iterative,
}

impl Strategy {
    /// All of them.
    pub const ALL: &[Self] = &[Self::Auto, Self::Normal, Self::Columns, Self::Iterative];

    /// Its name, for options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Normal => "normal",
            Self::Columns => "columns",
            Self::Iterative => "iterative",
        }
    }
}

impl std::fmt::Display for Strategy {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

/// A strategy that solves a system: what [`Strategy::Auto`] is resolved to.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Method {
    /// See [`Strategy::Normal`].
    Normal,
    /// See [`Strategy::Columns`].
    Columns,
    /// See [`Strategy::Iterative`].
    Iterative,
}

impl Method {
    /// Its name, for reports: that of the strategy.
    pub fn name(self) -> &'static str {
        Strategy::from(self).name()
    }
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
    }
}

impl From<Method> for Strategy {
    fn from(method: Method) -> Self {
        match method {
            Method::Normal => Self::Normal,
            Method::Columns => Self::Columns,
            Method::Iterative => Self::Iterative,
        }
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
    /// Parts of the mesh are tied to each other.
    Tied,
    /// The one-ring matrix cannot be factorized, or not accurately.
    Indefinite,
    /// The handles are so close together that their columns are equal within rounding.
    IllConditioned,
}

impl Reason {
    /// The reason in words, to follow "because".
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Requested => "it was requested",
            Self::Fastest => "it is predicted to be the fastest",
            Self::Memory => "the fastest strategy would take more memory than is allowed",
            Self::GeneralWeights => "the weights are not symmetric, whatever the scale of the rows",
            Self::OtherMembrane => "the membrane is not proportional to the operator",
            Self::Tied => "parts of the mesh are tied to each other",
            Self::Indefinite => "the one-ring matrix cannot be factorized accurately",
            Self::IllConditioned => "the handles are too close together to be distinguished",
        }
    }
}

impl std::fmt::Display for Reason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The method that solves a system, and the reason for it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct Choice {
    /// The method.
    pub method: Method,
    /// The reason.
    pub reason: Reason,
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({})", self.method, self.reason)
    }
}

/// Settings of a system.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct SystemOptions {
    /// The strategy.
    pub strategy: Strategy,
    /// The limit for the memory of factors and columns, in bytes, including the matrices and the
    /// work space from which they are made. The strategy is chosen by a rule of growth, which may
    /// be off by a factor of two. A factor that does not fit is refused before its memory is
    /// taken: a product of matrices by the lengths of the rings before it is assembled, a factor
    /// by the analysis of its matrix before it is factorized.
    pub max_memory: Option<u64>,
    /// The precision in which factors are stored.
    pub precision: Precision,
    /// The approximate number of corrections to come, which decides whether a costly factorization
    /// with cheap solves pays. Default: 20.
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
            precision: Precision::Double,
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

    /// Sets [`Self::precision`].
    #[must_use]
    pub const fn precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// Sets [`Self::expected_solves`].
    #[must_use]
    pub const fn expected_solves(mut self, solves: usize) -> Self {
        self.expected_solves = solves;
        self
    }
}

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
    /// Plans for `held` in the place of the problem's own handles. `at_hand` is what solves the
    /// problem by now.
    pub(crate) fn new(
        problem: &Problem,
        held: &Held,
        options: &SystemOptions,
        at_hand: Option<(&Solver, Method)>,
    ) -> Result<Self, LinearError> {
        let n = problem.num_vertices();
        let solves = 1 + usize::from(problem.membrane.is_some());
        let num_columns = columns::num_columns(problem, held);
        let estimate = |method: Method, size: f64| {
            let (new_factors, new_columns) = match at_hand {
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
                if at_hand.is_none() && plan.is_close() {
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
