//! `cotan edit`, with and without an installed editor.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::sandbox::Sandbox;

/// A copy of the command in a folder without an editor.
fn lone_cotan(sandbox: &Sandbox) -> PathBuf {
    let built = Path::new(env!("CARGO_BIN_EXE_cotan"));
    let folder = sandbox.path("bin");
    std::fs::create_dir(&folder).expect("a folder");
    let lone = folder.join(built.file_name().expect("a name"));
    if std::fs::hard_link(built, &lone).is_err() {
        std::fs::copy(built, &lone).expect("a copy of the command");
    }
    lone
}

fn run(sandbox: &Sandbox, cotan: &Path, path: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(cotan);
    command.args(args).current_dir(sandbox.path("."));
    command
        .env("PATH", path)
        .output()
        .expect("the command runs")
}

#[test]
fn without_an_editor_the_error_says_how_to_install_it() {
    let sandbox = Sandbox::with_bar();
    let cotan = lone_cotan(&sandbox);
    let output = run(&sandbox, &cotan, Path::new(""), &["edit", "bar.obj"]);
    assert_eq!(output.status.code(), Some(1));
    let error = String::from_utf8_lossy(&output.stderr);
    for word in [
        "error: ",
        "cotan-editor",
        "cargo install cotan-editor",
        "cargo build -p cotan-editor",
    ] {
        assert!(error.contains(word), "no `{word}` in: {error}");
    }
}

#[cfg(unix)]
#[test]
fn the_editor_receives_the_mesh_and_options_and_returns_its_exit_code() {
    let sandbox = Sandbox::with_bar();
    let cotan = lone_cotan(&sandbox);
    let script = |folder: &str, name: &str, code: i32| {
        use std::os::unix::fs::PermissionsExt;
        let path = sandbox.path(folder).join(name);
        let text = format!("#!/bin/sh\necho {folder} \"$@\"\nexit {code}\n");
        std::fs::write(&path, text).expect("a script");
        let mode = std::fs::Permissions::from_mode(0o755);
        std::fs::set_permissions(&path, mode).expect("an executable");
    };
    std::fs::create_dir(sandbox.path("path")).expect("a folder");
    script("path", "cotan-editor", 7);
    let path = sandbox.path("path");
    let args = ["edit", "bar.obj", "--handles", "h.json", "-q"];
    let output = run(&sandbox, &cotan, &path, &args);
    assert_eq!(output.status.code(), Some(7));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(text, "path bar.obj --handles h.json -q\n");

    // An editor next to the command takes precedence over the PATH.
    script("bin", "cotan-editor", 0);
    let args = ["edit", "bar.obj", "--", "--soft", "3"];
    let output = run(&sandbox, &cotan, &path, &args);
    assert_eq!(output.status.code(), Some(0));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(text, "bin bar.obj --soft 3\n");
}
