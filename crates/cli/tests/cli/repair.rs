//! `cotan repair`, `--repair`, `--weld`, and parts of a mesh that no handle holds.

use crate::sandbox::Sandbox;

/// Two bow-ties and a turned face: vertex 0 has two fans, face 2 is against face 1.
const BOW_TIE: &str = "\
# a bow-tie
v 0 0 0
v 1 0 0
v 0 1 0
v -1 0 0
v 0 -1 0
v -1 -1 0
f 1 2 3
f 1 4 5
f 4 5 6
";

const FIN: &str = "\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
v 0 0 -1
f 1 2 3
f 2 1 4
f 1 2 5
";

#[test]
fn a_repair_tells_each_change_and_what_is_left() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    let outcome = sandbox.cotan_ok("repair bow.obj -o sound.obj --report r.json");
    assert!(
        outcome
            .stdout
            .contains("split vertex 0 into 2 (new vertex 6)"),
        "{outcome:?}"
    );
    assert!(
        outcome.stdout.contains("turned face 1 round")
            || outcome.stdout.contains("turned face 2 round"),
        "{outcome:?}"
    );
    let report = sandbox.json("r.json");
    assert_eq!(report["vertices"], 7);
    assert_eq!(report["changes"].as_array().unwrap().len(), 2);
    assert_eq!(report["defect_counts"]["hole"], 2);
    let written = String::from_utf8(sandbox.read("sound.obj")).unwrap();
    assert!(written.starts_with("# a bow-tie\nv 0 0 0\n"), "{written}");
    let info = sandbox.cotan_ok("info sound.obj").stdout;
    assert!(info.contains("manifold                yes"), "{info}");
    // Nothing is left to do.
    let again = sandbox.cotan_ok("repair sound.obj -o again.obj").stdout;
    assert!(again.contains("changes                 none"), "{again}");
    assert_eq!(sandbox.read("again.obj"), sandbox.read("sound.obj"));
}

#[test]
fn only_the_repairs_that_are_named_are_made() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    let outcome = sandbox.cotan_ok("repair bow.obj -o o.obj --split-vertices");
    assert!(!outcome.stdout.contains("turned"), "{outcome:?}");
    assert!(
        outcome.stdout.contains("left: inconsistent orientation"),
        "{outcome:?}"
    );
    sandbox.write("fin.obj", FIN);
    let outcome = sandbox.cotan_ok("repair fin.obj -o o.obj");
    assert!(
        outcome.stdout.contains("left: non-manifold edge"),
        "{outcome:?}"
    );
    let outcome = sandbox.cotan_ok("repair fin.obj -o o.obj --all");
    assert!(
        !outcome.stdout.contains("left: non-manifold edge"),
        "{outcome:?}"
    );
    for line in [
        "repair fin.obj",
        "repair fin.obj -o o.obj --weld off",
        "repair fin.obj -o o.obj --fill-holes many",
        "info fin.obj --weld -1",
    ] {
        assert_eq!(sandbox.cotan(line).code, 2, "cotan {line}");
    }
}

#[test]
fn a_format_that_forgets_is_warned_of() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    let outcome = sandbox.cotan_ok("repair bow.obj -o o.stl");
    assert!(
        outcome.stderr.contains("meets again when the file is read"),
        "{outcome:?}"
    );
    let quiet = sandbox.cotan_ok("repair bow.obj -o o.stl --quiet");
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn deform_repairs_on_request_and_handles_keep_their_numbers() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    sandbox.write("h.txt", "0 0 0 0\n2 0 2 0\n5 -1 -1 0\n");
    let line = "deform bow.obj --handles h.txt -o o.obj";
    sandbox.refused(line, &["bow.obj", "or pass --repair"]);
    let outcome = sandbox.cotan_ok(&format!("{line} --repair"));
    assert!(
        outcome.stderr.contains("repaired by 2 changes"),
        "{outcome:?}"
    );
    let positions = sandbox.positions("o.obj");
    assert_eq!(positions.len(), 7);
    assert_eq!(positions[2], [0.0, 2.0, 0.0].into());
    // Both copies of the split vertex are held.
    assert_eq!(
        (positions[0], positions[6]),
        ([0.0; 3].into(), [0.0; 3].into())
    );
    sandbox.write("fin.obj", FIN);
    sandbox.refused(
        "deform fin.obj --handles h.txt -o o.obj --repair",
        &[
            "fin.obj",
            "3 faces",
            "--repair does not go so far",
            "--split-edges",
        ],
    );
}

#[test]
fn parts_without_a_handle_stay() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "two.obj",
        "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 4\nv 1 0 4\nv 0 1 4\nf 2 3 4\nf 5 6 7\n",
    );
    sandbox.write("h.txt", "1 0 0 0\n2 2 0 0\n3 0 2 0\n");
    let outcome = sandbox.cotan_ok("deform two.obj --handles h.txt -o o.obj");
    let words = "1 component without a handle (3 vertices, from vertex 4) has been held still";
    assert!(outcome.stderr.contains(words), "{outcome:?}");
    let (before, after) = (sandbox.positions("two.obj"), sandbox.positions("o.obj"));
    assert_eq!(before[4..], after[4..]);
    assert_eq!(after[2], [2.0, 0.0, 0.0].into());
}

#[test]
fn welding_decides_what_hangs_together() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "seam.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 1e-7\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n",
    );
    let components = |weld: &str| {
        let json = sandbox
            .cotan_ok(&format!("info seam.obj --json {weld}"))
            .stdout;
        let info: serde_json::Value = serde_json::from_str(&json).unwrap();
        info["components"].as_u64().unwrap()
    };
    assert_eq!(components(""), 2);
    assert_eq!(components("--weld exact"), 2);
    assert_eq!(components("--weld 1e-6"), 1);
    sandbox.cotan_ok("repair seam.obj -o one.obj --weld 1e-6");
    assert_eq!(sandbox.positions("one.obj").len(), 4);
}

#[test]
fn info_lists_as_many_defects_as_are_asked_for() {
    let sandbox = Sandbox::new();
    let points: String = (0..50).map(|i| format!("v {i} 0 0\n")).collect();
    sandbox.write("points.obj", format!("{points}v 0 1 0\nf 1 2 51\n"));
    let info = |limit: &str| -> serde_json::Value {
        let json = sandbox
            .cotan_ok(&format!("info points.obj --json {limit}"))
            .stdout;
        serde_json::from_str(&json).unwrap()
    };
    let few = info("--limit 3");
    assert_eq!(few["defect_counts"]["unreferenced vertex"], 48);
    assert_eq!(few["defects"].as_array().unwrap().len(), 4);
    assert_eq!(few["defects"][1]["cure"], "--compact");
    assert_eq!(info("")["defects"].as_array().unwrap().len(), 49);
}
