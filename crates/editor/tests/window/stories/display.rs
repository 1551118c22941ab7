//! Starting without a display.

use std::process::Stdio;

use crate::harness::command;

/// Needs neither Xvfb nor xdotool.
#[test]
fn without_a_display_one_sentence_tells_so() {
    let data = tempfile::tempdir().unwrap();
    let output = command(crate::program(), data.path())
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(!told.contains("panicked"), "{told}");
    assert_eq!(told.trim_end().lines().count(), 1, "{told}");
    assert!(
        told.starts_with("error: ") && told.contains("display"),
        "{told}"
    );
}
