//! The editor as a person has it: its window on a display, its pointer and its keys.
//!
//! Each story needs the processor for itself, so they take turns.
#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

#[allow(dead_code, reason = "the examples drive the window by it, too")]
mod harness;
mod models;
mod stories;

use std::io::Write;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

static TURN: Mutex<()> = Mutex::new(());

/// The turn of a story; none where a window cannot be tested, which only a check of the whole project
/// takes for a failure.
fn turn() -> Option<MutexGuard<'static, ()>> {
    if let Some(problem) = harness::missing_tools() {
        assert!(std::env::var_os("CI").is_none(), "{problem}");
        say(&format!("skipped: {problem}"));
        return None;
    }
    Some(TURN.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Tells something also where the tests pass.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "note: {text}");
}

fn program() -> &'static Path {
    Path::new(env!("CARGO_BIN_EXE_cotan-editor"))
}
