//! The threads of a run.

use std::num::NonZeroUsize;

use cotan_parallel::{Threads, on_threads};

use crate::error::CliError;

/// Runs `work` in a pool of `threads` threads, or in the pool of the run if `threads` is `None`.
pub(crate) fn with_threads<R: Send>(
    threads: Option<NonZeroUsize>,
    work: impl FnOnce() -> R + Send,
) -> Result<R, CliError> {
    let Some(threads) = threads.map(NonZeroUsize::get) else {
        return Ok(work());
    };
    on_threads(threads, work).map_err(|e| CliError::Threads {
        threads,
        problem: e.to_string(),
    })
}

/// Runs `work` in a pool of one thread per core, or of as many as the system allows.
///
/// Memory may not suffice for more stacks, in which case rayon's default pool would panic.
pub(crate) fn within_pool<R: Send>(work: impl FnOnce() -> R + Send) -> Result<R, CliError> {
    let mut threads = std::thread::available_parallelism().map_or(1, NonZeroUsize::get);
    loop {
        match Threads::new(threads) {
            Ok(threads) => return Ok(threads.run(work)),
            Err(_) if threads > 1 => threads /= 2,
            Err(error) => {
                return Err(CliError::Threads {
                    threads,
                    problem: error.to_string(),
                });
            }
        }
    }
}
