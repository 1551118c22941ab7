//! Tests of the editor as the user sees it: a window on a display, a pointer and keys.
//!
//! Each story needs the processor for itself, so they run one at a time.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

#[allow(dead_code, reason = "the examples drive the window by it, too")]
mod harness;
mod models;
mod stories;

use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

static TURN: Mutex<()> = Mutex::new(());

/// Waits for the story's turn.
///
/// Returns `None` if windows cannot be tested here, which is a failure only in CI.
fn turn() -> Option<MutexGuard<'static, ()>> {
    if let Some(problem) = harness::missing_tools() {
        assert!(std::env::var_os("CI").is_none(), "{problem}");
        say(&format!("skipped: {problem}"));
        cotan_testing::skip(problem);
        return None;
    }
    Some(TURN.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Prints a note that is visible even if the tests pass.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "note: {text}");
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_cotan-editor"))
}
