//! Signals while a mesh is written.
#![cfg(unix)]

use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cotan::shapes;
use cotan_io::Document;

use crate::sandbox::Sandbox;

#[test]
fn a_signal_leaves_the_old_file_or_the_new_one_and_nothing_else() {
    let sandbox = Sandbox::new();
    let ball = shapes::icosphere::<f64>(6);
    let ball = Document::from_mesh(ball.connectivity(), ball.positions()).expect("a document");
    cotan_io::save(&ball, sandbox.path("ball.obj")).expect("a mesh file");
    sandbox.cotan_ok("convert ball.obj new.ply");
    let new = sandbox.read("new.ply");
    let (mut num_ended, mut num_caught) = (0, 0);
    let tries = [("INT", 2), ("TERM", 15), ("HUP", 1)].repeat(4);
    for (turn, (signal, number)) in tries.into_iter().enumerate() {
        sandbox.write("out.ply", "old");
        let mut child = Command::new(env!("CARGO_BIN_EXE_cotan"))
            .args(["convert", "ball.obj", "out.ply"])
            .current_dir(sandbox.path("."))
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("the command runs");
        // At once, as soon as something is written, or when the run has ended.
        let start = Instant::now();
        let is_writing = || unfinished(&sandbox) > 0;
        while turn % 2 == 0 && !is_writing() && child.try_wait().expect("a status").is_none() {
            assert!(start.elapsed() < Duration::from_secs(120), "it hangs");
        }
        num_caught += usize::from(is_writing());
        let pid = child.id().to_string();
        let _ = Command::new("kill")
            .args(["-s", signal, &pid])
            .stderr(Stdio::null())
            .status();
        let status = child.wait().expect("a status");
        match status.signal() {
            Some(by) => {
                assert_eq!(by, number);
                num_ended += 1;
            }
            // The run ended before the signal.
            None => assert_eq!(status.code(), Some(0)),
        }
        assert_eq!(unfinished(&sandbox), 0, "{signal}");
        let left = sandbox.read("out.ply");
        assert!(left == b"old" || left == new, "{} bytes", left.len());
    }
    assert!(num_ended > 0);
    println!("{num_caught} of 12 were caught while writing, {num_ended} ended by the signal");
}

#[test]
fn a_file_above_the_size_limit_is_an_error() {
    let sandbox = Sandbox::new();
    let ball = shapes::icosphere::<f64>(4);
    let ball = Document::from_mesh(ball.connectivity(), ball.positions()).expect("a document");
    cotan_io::save(&ball, sandbox.path("ball.obj")).expect("a mesh file");
    sandbox.write("out.ply", "old");
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 8; exec \"$0\" convert ball.obj out.ply"])
        .arg(env!("CARGO_BIN_EXE_cotan"))
        .current_dir(sandbox.path("."))
        .stdin(Stdio::null())
        .output()
        .expect("the command runs");
    assert_eq!(output.status.code(), Some(1), "{output:?}");
    assert_eq!(sandbox.read("out.ply"), b"old");
    assert_eq!(unfinished(&sandbox), 0);
}

/// The number of temporary files.
fn unfinished(sandbox: &Sandbox) -> usize {
    let entries = std::fs::read_dir(sandbox.path(".")).expect("the sandbox");
    let names = entries.filter_map(|entry| Some(entry.ok()?.file_name()));
    names
        .filter(|name| name.as_encoded_bytes().starts_with(b".cotan-"))
        .count()
}
