//! The strategies that solve a system, and the settings of it.

use cotan_sparse::Precision;

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
