//! `cotan demo`.

use crate::sandbox::Sandbox;

#[test]
fn the_demo_writes_its_files_and_can_be_repeated_by_hand() {
    let sandbox = Sandbox::new();
    let outcome = sandbox.cotan_ok("demo -o out/demo");
    for word in [
        "E_p",
        "E_g",
        "converged",
        "flipped faces",
        "seconds",
        "demo.png",
    ] {
        assert!(outcome.stdout.contains(word), "no {word} in {outcome:?}");
    }
    assert_eq!(outcome.stderr, "");
    assert!(sandbox.read("out/demo/demo.png").starts_with(b"\x89PNG"));
    assert!(
        sandbox
            .read("out/demo/smoothing.png")
            .starts_with(b"\x89PNG")
    );
    let report = sandbox.json("out/demo/report.json");
    assert_eq!(report["stop_reason"], "converged");
    assert_eq!(report["flipped_faces"], 0);

    sandbox.cotan_ok("denoise out/demo/noisy.obj -o smoothed.obj --picture smoothing.png");
    assert_eq!(
        sandbox.read("smoothed.obj"),
        sandbox.read("out/demo/smoothed.obj")
    );

    sandbox.cotan_ok(
        "deform out/demo/before.obj --handles out/demo/handles.json -o again.obj --picture again.png",
    );
    assert_eq!(
        sandbox.read("again.obj"),
        sandbox.read("out/demo/after.obj")
    );
    assert_eq!(sandbox.read("again.png"), sandbox.read("out/demo/demo.png"));
}
