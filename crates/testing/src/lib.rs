//! Tests that need something the machine may lack: real models, the right to mount a disk.
//!
//! Such a test calls [`shared`] or [`skip`] and returns. It passes, and the test harness shows
//! nothing of it, so it also leaves a file in the folder that the environment variable
//! [`RECORD`] names, if there is one. `.ci/run` counts these files.

use std::fmt::Display;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The environment variable with the folder of records, one file per test that was skipped.
pub const RECORD: &str = "COTAN_SKIPPED_TESTS";

/// The folder of [`shared`], which need not exist.
pub const SHARED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared");

/// A file or folder of `shared`, the folder of models and reference results next to the project.
///
/// They are other people's data and never part of this repository. Returns `None` if it does not
/// exist, and records that the test is skipped.
pub fn shared(path: &str) -> Option<PathBuf> {
    let full = Path::new(SHARED).join(path);
    if full.exists() {
        return Some(full);
    }
    skip(format_args!("shared/{path} is not next to the project"));
    None
}

/// Records that the current test, or a part of it, is skipped.
///
/// The test is identified by the name of its thread, which the test harness sets to that of the
/// test, unless it runs all tests on the main thread; then each reason counts as one test.
pub fn skip(reason: impl Display) {
    println!("skipped: {reason}");
    let Some(folder) = std::env::var_os(RECORD) else {
        return;
    };
    let reason = reason.to_string();
    let thread = std::thread::current();
    let test = match thread.name() {
        None | Some("main") => reason.as_str(),
        Some(name) => name,
    };
    let recorded = record(Path::new(&folder), &file_name(&program(), test), &reason);
    // A record that cannot be made would hide the test.
    assert!(recorded.is_ok(), "{RECORD}: {recorded:?}");
}

/// Adds a reason to the record of a test.
fn record(folder: &Path, test: &str, reason: &str) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut file = std::fs::File::options()
        .create(true)
        .append(true)
        .open(folder.join(test))?;
    writeln!(file, "{reason}")
}

/// The name of the test program, without the hash that cargo appends.
fn program() -> String {
    let program = std::env::current_exe().unwrap_or_default();
    let name = program.file_stem().unwrap_or_default().to_string_lossy();
    let without_hash = name.rsplit_once('-').map(|(name, _)| name.to_owned());
    without_hash.unwrap_or_else(|| name.into_owned())
}

/// A file name for a test of a program.
fn file_name(program: &str, test: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    let plain = |c| if is_plain(c) { c } else { '.' };
    let name = format!("{program}--{}", test.replace("::", "."));
    // File systems allow 255 bytes.
    name.chars().map(plain).take(200).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_a_file_name() {
        let name = file_name("cli", "shared::a/b is not \"there\"");
        assert_eq!(name, "cli--shared.a.b.is.not..there.");
        assert!(file_name("cli", &"x".repeat(1000)).len() <= 200);
    }

    #[test]
    fn a_test_with_two_reasons_has_one_record() {
        let folder = std::env::temp_dir().join(format!("cotan-testing-{}", std::process::id()));
        for reason in ["no model", "no reference"] {
            record(&folder, "cli--shared.a_story", reason).expect("a record");
        }
        let entries = std::fs::read_dir(&folder).expect("the folder").count();
        let text = std::fs::read_to_string(folder.join("cli--shared.a_story"));
        std::fs::remove_dir_all(&folder).expect("the folder goes");
        assert_eq!(entries, 1);
        assert_eq!(text.expect("the record"), "no model\nno reference\n");
    }
}
