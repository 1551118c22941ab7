//! The number of threads that work.

use std::fmt;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A number of threads, waiting for work.
#[derive(Debug)]
pub struct Threads(ThreadPool);

impl Threads {
    /// Starts them.
    ///
    /// # Errors
    /// [`ThreadError`] if the system has no room for so many.
    pub fn new(threads: usize) -> Result<Self, ThreadError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(Self).map_err(ThreadError)
    }

    /// Runs `work` on one of them; its loops are shared out among all.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.0.install(work)
    }
}

/// Threads that the system does not give.
#[derive(Debug)]
pub struct ThreadError(rayon::ThreadPoolBuildError);

impl fmt::Display for ThreadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for ThreadError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        self.0.source()
    }
}

/// Runs `work` on [`Threads`] of its own.
///
/// ```
/// let sum = || cotan_parallel::Chunks::of(100).sum::<f64>(10_000, |i| (i as f64).sqrt());
/// let one = cotan_parallel::on_threads(1, sum)?;
/// assert_eq!(one, cotan_parallel::on_threads(3, sum)?);
/// # Ok::<(), cotan_parallel::ThreadError>(())
/// ```
///
/// # Errors
/// As [`Threads::new`]; `work` has not run then.
pub fn on_threads<R: Send>(
    threads: usize,
    work: impl FnOnce() -> R + Send,
) -> Result<R, ThreadError> {
    Ok(Threads::new(threads)?.run(work))
}

/// Number of threads among which a loop that starts here is shared out.
#[must_use]
pub fn num_threads() -> usize {
    rayon::current_num_threads()
}
