//! Models of several parts: names, handles by names, and who follows whom.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fmt::Write;

use cotan::Mesh;
use cotan::shapes::bar;
use nalgebra::{Point3, Vector3};

use crate::sandbox::Sandbox;

/// An arm with two rings, a button, and a card far from all of them.
fn model() -> String {
    let arm = bar::<f64>([4.0, 0.6, 0.6], [24, 4, 4]);
    let button = bar::<f64>([0.2, 0.2, 0.2], [2, 2, 2]);
    let at = |mesh: &Mesh<f64>, by: [f64; 3]| {
        let positions = mesh.positions().map(|p| p + Vector3::from(by));
        mesh.with_positions(positions).unwrap()
    };
    let parts = [
        ("arm", "skin", arm),
        ("ring", "gold", at(&button, [0.5, 0.0, 0.38])),
        ("ring", "gold", at(&button, [1.5, 0.0, 0.38])),
        ("button", "bone", at(&button, [-1.0, 0.0, 0.38])),
    ];
    let (mut text, mut first) = (String::new(), 1);
    for (name, material, mesh) in &parts {
        writeln!(text, "o {name}\nusemtl {material}").unwrap();
        for p in mesh.positions().values() {
            writeln!(text, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        for t in mesh.to_triangles().chunks_exact(3) {
            let [a, b, c] = [t[0], t[1], t[2]].map(|v| v + first);
            writeln!(text, "f {a} {b} {c}").unwrap();
        }
        first += mesh.num_vertices() as u32;
    }
    text
}

const BEND: &str = r#"{"handles": [
    {"vertices": {"box": {"min": [-9, -9, -9], "max": [-1.9, 9, 9]}}, "fixed": true},
    {"vertices": {"box": {"min": [1.9, -9, -9], "max": [9, 9, 9]}},
     "transform": {"rotate": {"axis": [0, 1, 0], "degrees": -60, "about": [1, 0, 0]}}}"#;

fn sandbox() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.write("model.obj", model());
    sandbox.write("h.json", format!("{BEND}]}}"));
    sandbox
}

fn moved(before: &[Point3<f64>], after: &[Point3<f64>]) -> Vec<bool> {
    before.iter().zip(after).map(|(a, b)| a != b).collect()
}

#[test]
fn parts_follow_and_the_report_says_how_well() {
    let sandbox = sandbox();
    sandbox.cotan_ok("deform model.obj --handles h.json -o o.obj --report r.json");
    let report = sandbox.json("r.json");
    let parts = report["parts"].as_array().unwrap();
    let names: Vec<&str> = parts.iter().map(|p| p["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["arm", "ring", "ring", "button"]);
    assert_eq!(parts[0]["role"], "drives");
    for part in &parts[1..] {
        assert_eq!(part["role"], "follows");
        assert_eq!(part["follows"], serde_json::json!([0]));
        assert!(part["gap_change"].as_f64().unwrap() < 0.004, "{part}");
        assert!(part["turn_degrees"].as_f64().unwrap() < 2.0, "{part}");
    }
}

#[test]
fn options_and_the_handles_file_say_what_follows() {
    let sandbox = sandbox();
    let before = sandbox.positions("model.obj");
    let button = before.len() - 26;
    let rings = button - 2 * 26;
    let run = |options: &str| {
        sandbox.cotan_ok(&format!(
            "deform model.obj --handles h.json -o o.obj {options}"
        ));
        moved(&before, &sandbox.positions("o.obj"))
    };
    let all = |moved: &[bool], is_moved: bool| moved.iter().all(|m| *m == is_moved);
    let only_rings = run("--parts only ring");
    assert!(all(&only_rings[rings..button], true) && all(&only_rings[button..], false));
    let free_rings = run("--free 1 2");
    assert!(all(&free_rings[rings..button], false) && all(&free_rings[button..], true));
    assert!(all(&run("--parts still")[rings..], false));
    sandbox.write(
        "h.json",
        format!(r#"{BEND}], "parts": {{"follow": ["button"]}}}}"#),
    );
    let only_button = run("");
    assert!(all(&only_button[rings..button], false) && all(&only_button[button..], true));
    assert!(all(&run("--parts follow")[rings..], true));
    let line = "deform model.obj --handles h.json -o o.obj";
    sandbox.refused(
        &format!("{line} --free hat"),
        &["no part hat", "arm, ring, button"],
    );
    sandbox.refused(&format!("{line} --parts only 4"), &["no part 4", "4 parts"]);
}

#[test]
fn handles_are_chosen_by_names() {
    let sandbox = sandbox();
    let before = sandbox.positions("model.obj");
    let lift = |vertices: &str| {
        format!(
            r#"{{"handles": [{{"vertices": {vertices}, "transform": {{"translate": [0, 0, 1]}}}}]}}"#
        )
    };
    let num_moved = |vertices: &str| {
        sandbox.write("h.json", lift(vertices));
        sandbox.cotan_ok("deform model.obj --handles h.json -o o.obj --parts still");
        let after = sandbox.positions("o.obj");
        moved(&before, &after).into_iter().filter(|m| *m).count()
    };
    assert_eq!(num_moved(r#"{"object": "ring"}"#), 52);
    assert_eq!(num_moved(r#"{"material": "bone"}"#), 26);
    assert_eq!(num_moved(r#"{"part": 3}"#), 26);
    assert_eq!(num_moved(r#"{"part": "button"}"#), 26);
    assert_eq!(num_moved(r#"{"all_but": {"object": "arm"}}"#), 78);
    let refused = |vertices: &str, words: &[&str]| {
        sandbox.write("h.json", lift(vertices));
        sandbox.refused("deform model.obj --handles h.json -o o.obj", words);
    };
    refused(
        r#"{"object": "nose"}"#,
        &["handle 0", "\"nose\"", "arm, ring, button"],
    );
    refused(r#"{"group": "nose"}"#, &["handle 0", "group", "names none"]);
    refused(r#"{"part": 9}"#, &["handle 0", "no part 9", "4 parts"]);
    refused(
        r#"{"part": 1, "object": "arm"}"#,
        &["handle 0", "exactly one way"],
    );
}

#[test]
fn info_lists_the_parts() {
    let sandbox = sandbox();
    let text = sandbox.cotan_ok("info model.obj").stdout;
    assert!(text.contains("3 button: 26 vertices, follows 0"), "{text}");
    let json = sandbox.cotan_ok("info model.obj --json").stdout;
    let info: serde_json::Value = serde_json::from_str(&json).unwrap();
    let parts = info["component_parts"].as_array().unwrap();
    assert_eq!(parts.len(), 4);
    assert_eq!(parts[1]["name"], "ring");
}

#[test]
fn what_cannot_follow_is_told_with_what_to_do() {
    let sandbox = sandbox();
    sandbox.write("none.json", r#"{"handles": []}"#);
    sandbox.refused(
        "deform model.obj --handles none.json -o o.obj",
        &["no handle", "add at least one", "cotan info", "--help"],
    );
    // A part without any tie stays, and a part that is to be free does so without a word.
    let line = "deform model.obj --handles h.json -o o.obj";
    let outcome = sandbox.cotan_ok(&format!("{line} --untie arm button --untie ring button"));
    let words = "part 3 (button) stays where it is: it is tied to no part with a handle";
    assert!(outcome.stderr.contains(words), "{outcome:?}");
    assert!(outcome.stderr.contains("untie fewer pairs"), "{outcome:?}");
    let outcome = sandbox.cotan_ok(&format!("{line} --free button"));
    assert!(!outcome.stderr.contains("stays where it is"), "{outcome:?}");
    // `reconstruct` rebuilds every part by itself.
    sandbox.refused(
        "reconstruct model.obj --handles h.json -o o.obj",
        &["has no handle", "fix or move at least one vertex of it"],
    );
}
