//! The number of worker threads.

use std::fmt;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A pool with a given number of threads.
#[derive(Debug)]
pub struct Threads(ThreadPool);

impl Threads {
    /// Starts the threads.
    ///
    /// # Errors
    /// [`ThreadError`] if the system cannot start that many.
    pub fn new(threads: usize) -> Result<Self, ThreadError> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build();
        pool.map(Self).map_err(ThreadError)
    }

    /// Runs `work` on one of the threads; its loops use all of them.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        self.0.install(work)
    }
}

/// The system could not start the requested threads.
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

/// Runs `work` on a new pool of [`Threads`].
///
/// ```
/// let sum = || cotan_parallel::Chunks::of(100).sum::<f64>(10_000, |i| (i as f64).sqrt());
/// let one = cotan_parallel::on_threads(1, sum)?;
/// assert_eq!(one, cotan_parallel::on_threads(3, sum)?);
/// # Ok::<(), cotan_parallel::ThreadError>(())
/// ```
///
/// # Errors
/// Same as [`Threads::new`], in which case `work` has not run.
pub fn on_threads<R: Send>(
    threads: usize,
    work: impl FnOnce() -> R + Send,
) -> Result<R, ThreadError> {
    Ok(Threads::new(threads)?.run(work))
}

/// The number of threads available to a loop that starts here.
#[must_use]
pub fn num_threads() -> usize {
    rayon::current_num_threads()
}
