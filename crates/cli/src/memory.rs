//! The memory of this run: limits for reading, and checks that work will fit.
//!
//! The memory belongs to the process, and so does its limit: `main` sets it once, before anything
//! is read.

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

/// Sets the limits. Later calls have no effect.
pub(crate) fn set(args: &LimitArgs) {
    let memory = args.memory();
    let limits = args.reading(memory);
    // Fails on a second call, which is ignored.
    let _ = RUN.set(Run { memory, limits });
}

fn run() -> &'static Run {
    RUN.get_or_init(|| {
        let memory = MemoryLimit::of_machine();
        let limits = memory.reading(Limits::default());
        Run { memory, limits }
    })
}

/// The limits for reading a mesh file.
pub(crate) fn limits() -> &'static Limits {
    &run().limits
}

/// Refuses work that would exceed the memory limit. Returns the number of bytes left for factors.
pub(crate) fn check(work: Work, path: &Path, document: &Document) -> Result<u64, CliError> {
    let checked = run().memory.check(work, document);
    checked.map_err(|source| CliError::Memory {
        path: path.to_owned(),
        source,
    })
}
