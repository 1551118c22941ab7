//! The memory of this run: the limits of reading, and whether work will fit.
//!
//! Memory belongs to the process, and so does its limit: `main` sets it once, before anything is
//! read.

use std::path::Path;
use std::sync::OnceLock;

use cotan_io::{Document, Limits};
use cotan_tool::{MemoryLimit, Work};

use crate::args::LimitArgs;
use crate::error::CliError;

struct Run {
    memory: MemoryLimit,
    limits: Limits,
}

static RUN: OnceLock<Run> = OnceLock::new();

/// Sets the limits; those that were set first stay.
pub(crate) fn set(args: &LimitArgs) {
    let memory = args.memory();
    let limits = args.reading(memory);
    // A second call has nothing to add.
    let _ = RUN.set(Run { memory, limits });
}

fn run() -> &'static Run {
    RUN.get_or_init(|| {
        let memory = MemoryLimit::of_machine();
        let limits = memory.reading(Limits::default());
        Run { memory, limits }
    })
}

/// The limits of reading a mesh file.
pub(crate) fn limits() -> &'static Limits {
    &run().limits
}

/// Refuses work that would take more memory than is allowed; how many bytes it leaves for factors.
pub(crate) fn check(work: Work, path: &Path, document: &Document) -> Result<u64, CliError> {
    let checked = run().memory.check(work, document);
    checked.map_err(|source| CliError::Memory {
        path: path.to_owned(),
        source,
    })
}
