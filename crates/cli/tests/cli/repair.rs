//! `cotan repair`, `--repair`, `--weld`, and parts of a mesh without a handle.

use crate::sandbox::Sandbox;

/// Two bow-ties and a flipped face: vertex 0 has two fans, face 2 is opposed to face 1.
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
fn a_repair_reports_changes_and_remaining_defects() {
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
    // Nothing is left to repair.
    let again = sandbox.cotan_ok("repair sound.obj -o again.obj").stdout;
    assert!(again.contains("changes                 none"), "{again}");
    assert_eq!(sandbox.read("again.obj"), sandbox.read("sound.obj"));
}

#[test]
fn only_the_requested_repairs_are_made() {
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
fn formats_that_lose_a_repair_cause_a_warning() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    let outcome = sandbox.cotan_ok("repair bow.obj -o o.stl");
    assert!(
        outcome
            .stderr
            .contains("merged again when the file is read"),
        "{outcome:?}"
    );
    let quiet = sandbox.cotan_ok("repair bow.obj -o o.stl --quiet");
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn deform_repairs_on_request_and_handles_keep_their_indices() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", BOW_TIE);
    sandbox.write("h.txt", "0 0 0 0\n2 0 2 0\n5 -1 -1 0\n");
    let line = "deform bow.obj --handles h.txt -o o.obj";
    // As it is the file deforms too; what needs one surface asks for the repair.
    sandbox.cotan_ok(line);
    let distances = "geodesic bow.obj --from 0 -o d.ply";
    sandbox.refused(distances, &["bow.obj", "or pass --repair"]);
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
        "geodesic fin.obj --from 0 -o d.ply --repair",
        &[
            "fin.obj",
            "3 faces",
            "--repair is not enough",
            "--split-edges",
        ],
    );
}

#[test]
fn still_parts_stay() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "two.obj",
        "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 4\nv 1 0 4\nv 0 1 4\nf 2 3 4\nf 5 6 7\n",
    );
    sandbox.write("h.txt", "1 0 0 0\n2 2 0 0\n3 0 2 0\n");
    let outcome = sandbox.cotan_ok("deform two.obj --handles h.txt -o o.obj --parts still");
    let words = "1 component without a handle (3 vertices, from vertex 4) has been held in place";
    assert!(outcome.stderr.contains(words), "{outcome:?}");
    let (before, after) = (sandbox.positions("two.obj"), sandbox.positions("o.obj"));
    assert_eq!(before[4..], after[4..]);
    assert_eq!(after[2], [2.0, 0.0, 0.0].into());
}

#[test]
fn welding_decides_what_is_connected() {
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
fn info_lists_the_requested_number_of_defects() {
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

#[test]
fn a_sound_surface_of_two_faces_is_left_alone() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "pillow.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n",
    );
    sandbox.write("h.txt", "0 0 0 0\n1 1 0 0\n2 0 2 0\n");
    let outcome = sandbox.cotan_ok("deform pillow.obj --handles h.txt -o o.obj --repair");
    assert!(!outcome.stderr.contains("repaired"), "{outcome:?}");
    let written = String::from_utf8(sandbox.read("o.obj")).unwrap();
    assert!(written.ends_with("f 1 2 3\nf 1 3 2\n"), "{written}");
}

/// [`BOW_TIE`] with separate vertices for the two fans and all faces oriented.
const SEAMED_BOW_TIE: &str = "\
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 0
v -1 0 0
v 0 -1 0
f 1 2 3
f 4 5 6
";

#[test]
fn welding_and_repairs_combine() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", SEAMED_BOW_TIE);
    sandbox.write("h.txt", "0 0 0 0\n2 0 2 0\n5 0 -1 0\n");
    let line = "deform bow.obj --handles h.txt --weld exact -o o.obj";
    let cure = "`cotan repair --weld exact --split-vertices` and then omit --weld";
    let distances = "geodesic bow.obj --from 0 --weld exact -o d.ply";
    sandbox.refused(distances, &["bow.obj", cure, "or pass --repair"]);
    sandbox.cotan_ok(line);
    // Both remedies work.
    let outcome = sandbox.cotan_ok(&format!("{line} --repair"));
    assert!(
        outcome.stderr.contains("repaired by 1 change"),
        "{outcome:?}"
    );
    let positions = sandbox.positions("o.obj");
    assert_eq!(positions.len(), 6);
    assert_eq!(positions[2], [0.0, 2.0, 0.0].into());
    sandbox.cotan_ok("repair bow.obj -o sound.obj --weld exact --split-vertices");
    sandbox.write("h.txt", "0 0 0 0\n2 0 2 0\n4 0 -1 0\n");
    sandbox.cotan_ok("deform sound.obj --handles h.txt -o o.obj");
    // `deform` also warns about formats that lose the repair.
    sandbox.write("bow.obj", BOW_TIE);
    let outcome = sandbox.cotan_ok("deform bow.obj --handles h.txt --repair -o o.stl");
    let words = "merged again when the file is read\n";
    assert!(outcome.stderr.contains(words), "{outcome:?}");
}

#[test]
fn indices_are_those_of_the_file_after_a_repair() {
    let sandbox = Sandbox::new();
    // Face 0 is degenerate and is dropped; faces 1 to 3 share an edge.
    let fin = FIN.replacen("f 1", "f 1 1 2\nf 1", 1);
    sandbox.write("fin.obj", fin);
    let outcome = sandbox.cotan("geodesic fin.obj --from 0 -o d.ply --repair");
    assert_eq!(outcome.code, 1, "{outcome:?}");
    assert!(
        outcome.stderr.contains("(among them face 3)"),
        "{outcome:?}"
    );
}

#[test]
fn welded_vertices_are_held_once_and_keep_their_distance() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "seam.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 0 0.125\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 4 6 5\n",
    );
    let run = |handles: &str| {
        sandbox.write("h.json", handles);
        sandbox.cotan_ok("deform seam.obj --handles h.json --weld 0.25 -o o.obj");
        sandbox.positions("o.obj")
    };
    // Both vertices of the pair, which a quarter turn separates.
    let moved = run(
        r#"{"handles": [{"vertices": [1, 3], "transform": {"rotate": {"axis": [1, 0, 0],
            "degrees": 90, "about": [1, 0, 0]}, "translate": [1, 0, 0]}},
            {"vertices": [0, 2, 5], "fixed": true}]}"#,
    );
    assert!((moved[1] - nalgebra::Point3::new(2.0, 0.0, 0.0)).norm() < 1e-12);
    assert_eq!(moved[3] - moved[1], nalgebra::Vector3::new(0.0, 0.0, 0.125));
    let moved = run(r#"{"handles": [{"vertices": [3], "to": [[2, 0, 0.5]]},
            {"vertices": [0, 2, 5], "fixed": true}]}"#);
    assert_eq!(moved[3], [2.0, 0.0, 0.5].into());
    assert_eq!(moved[1], [2.0, 0.0, 0.375].into());
}

#[test]
fn cures_are_whole_commands() {
    let sandbox = Sandbox::new();
    sandbox.write("bow.obj", SEAMED_BOW_TIE);
    let info = sandbox.cotan_ok("info bow.obj").stdout;
    assert!(info.contains("(cotan repair --weld exact)"), "{info}");
    let info = sandbox.cotan_ok("info bow.obj --weld exact").stdout;
    assert!(
        info.contains("(cotan repair --weld exact --split-vertices)"),
        "{info}"
    );
}

#[test]
fn the_edges_of_fill_holes_follow_an_equals_sign() {
    let sandbox = Sandbox::new();
    sandbox.write("fin.obj", FIN);
    for line in [
        "repair fin.obj -o o.obj --fill-holes=0",
        "repair fin.obj -o o.obj --fill-holes=many",
        "repair fin.obj -o o.obj --fill-holes 8",
    ] {
        assert_eq!(sandbox.cotan(line).code, 2, "cotan {line}");
    }
    sandbox.cotan_ok("repair -o o.obj --fill-holes fin.obj");
    sandbox.cotan_ok("repair fin.obj -o o.obj --fill-holes=8");
}

#[test]
fn a_report_cannot_be_a_folder() {
    let sandbox = Sandbox::with_bar();
    std::fs::create_dir(sandbox.path("folder")).unwrap();
    sandbox.write("h.txt", "0 0 0 0\n");
    for option in ["--report", "--picture"] {
        let line = format!("deform bar.obj --handles h.txt -o o.obj {option} folder");
        sandbox.refused(&line, &["folder", "cannot write"]);
        assert!(!sandbox.path("o.obj").exists());
    }
}
