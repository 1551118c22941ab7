//! `cotan edit`: starts the editor, a separate program, so that the command line needs no window.

pub(crate) mod args;

use std::env::consts::EXE_SUFFIX;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::{Command, ExitCode, ExitStatus};

use crate::error::CliError;

use args::EditArgs;

/// Runs the editor and returns its exit code.
pub(crate) fn run(args: &EditArgs) -> Result<ExitCode, CliError> {
    let program = next_to_this().unwrap_or_else(|| EDITOR.into());
    let status = Command::new(&program)
        .arg(&*args.mesh)
        .args(&args.options)
        .status();
    match status {
        Ok(status) => Ok(code(status)),
        Err(error) if error.kind() == ErrorKind::NotFound => Err(CliError::NoEditor),
        Err(source) => Err(CliError::Start {
            program: program.into(),
            source,
        }),
    }
}

const EDITOR: &str = "cotan-editor";

/// The editor next to this program, if both were installed or built together.
fn next_to_this() -> Option<OsString> {
    let own: PathBuf = std::env::current_exe().ok()?;
    let editor = own.with_file_name(format!("{EDITOR}{EXE_SUFFIX}"));
    editor.is_file().then(|| editor.into_os_string())
}

fn code(status: ExitStatus) -> ExitCode {
    // The exit code that shells report for a signal.
    #[cfg(unix)]
    let signal = std::os::unix::process::ExitStatusExt::signal(&status).map(|signal| 128 + signal);
    #[cfg(not(unix))]
    let signal = None;
    let code = status.code().or(signal).unwrap_or(1);
    match u8::try_from(code) {
        Ok(code) => ExitCode::from(code),
        Err(_) => ExitCode::FAILURE,
    }
}
