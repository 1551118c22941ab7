//! Files whose surface is not manifold or not consistently oriented: jobs that need neither work on
//! them as they are, and the file keeps its vertices and faces.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fmt::Write as _;

use cotan_io::{Document, Folder, Limits};
use nalgebra::Point3;

use crate::sandbox::Sandbox;

const FORMATS: [&str; 6] = ["m.obj", "m.ply", "m.off", "m.stl", "m.glb", "m.gltf"];

/// Three pages that are bound along the z axis, a fourth sheet that touches them at one vertex, and
/// every third face reversed.
fn sheets() -> String {
    let mut text = String::new();
    let mut faces = String::new();
    let mut points: Vec<[f64; 3]> = Vec::new();
    let mut number = |p: [f64; 3], text: &mut String| {
        if let Some(at) = points.iter().position(|q| *q == p) {
            return at + 1;
        }
        points.push(p);
        writeln!(text, "v {} {} {}", p[0], p[1], p[2]).unwrap();
        points.len()
    };
    let mut count = 0;
    for (from, [x, y]) in [
        (0.0, [1.0, 0.0]),
        (0.0, [0.0, 1.0]),
        (0.0, [-1.0, -1.0]),
        (2.0, [-1.0, 0.5]),
    ] {
        for i in 0..4 {
            for j in 0..8 {
                let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                let mut quad = corners.map(|[i, j]| {
                    let [r, z] = [i, j].map(|k| 0.25 * f64::from(k));
                    number([r * x, r * y, from + z], &mut text)
                });
                count += 1;
                if count % 3 == 0 {
                    quad.reverse();
                }
                writeln!(faces, "f {} {} {} {}", quad[0], quad[1], quad[2], quad[3]).unwrap();
            }
        }
    }
    text + &faces
}

const HANDLES: &str = r#"{"handles": [
  {"vertices": {"box": {"min": [-2, -2, -0.01], "max": [2, 2, 0.01]}}, "fixed": true},
  {"vertices": {"box": {"min": [-2, -2, 3.99], "max": [2, 2, 4.01]}},
   "transform": {"translate": [0.3, 0.2, -0.1]}}
]}"#;

fn document(sandbox: &Sandbox, name: &str) -> Document {
    let path = sandbox.path(name);
    cotan_io::load_with(&path, &Limits::default(), &Folder::of(&path)).unwrap()
}

/// The faces, as indices of the positions.
fn faces(document: &Document) -> Vec<Vec<u32>> {
    document.faces().iter().map(<[u32]>::to_vec).collect()
}

/// Vertices that were at one place are at one place.
fn assert_no_crack(before: &Document, after: &Document, line: &str) {
    let bits = |p: &Point3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let pairs = before.positions().iter().zip(after.positions());
    let mut pairs: Vec<_> = pairs.map(|(a, b)| (bits(a), bits(b))).collect();
    pairs.sort_unstable();
    for pair in pairs.windows(2) {
        assert!(pair[0].0 != pair[1].0 || pair[0].1 == pair[1].1, "{line}");
    }
}

#[test]
fn sheets_that_meet_are_edited_without_repair_in_every_format() {
    let sandbox = Sandbox::new();
    sandbox.write("m.obj", sheets());
    sandbox.write("h.json", HANDLES);
    for name in FORMATS {
        if name != "m.obj" {
            sandbox.cotan_ok(&format!("convert m.obj {name}"));
        }
        let info = sandbox.cotan_ok(&format!("info --json {name}")).stdout;
        for defect in ["non-manifold edge", "orientation", "fans"] {
            assert!(info.contains(defect), "{name}: no `{defect}` in {info}");
        }
        let before = document(&sandbox, name);
        for job in [
            "deform --handles h.json",
            "deform --handles h.json --precision f32 --history --report r.json --picture p.png",
            "smooth",
            "smooth --size 5% --free-boundary",
            "denoise",
            "denoise --method anchored --preserve-volume --picture p.png",
            "detail --scale 1.5 --report r.json",
        ] {
            let line = format!("{job} {name} -o out-{name}");
            sandbox.cotan_ok(&line);
            let after = document(&sandbox, &format!("out-{name}"));
            assert_eq!(faces(&before), faces(&after), "{line}");
            assert_no_crack(&before, &after, &line);
            if job.starts_with("deform") {
                let moved = before.positions().iter().zip(after.positions());
                let far = moved.filter(|(a, b)| (*a - *b).norm() > 0.2).count();
                assert!(far > before.positions().len() / 10, "{line}: {far}");
            }
        }
    }
    sandbox.refused("sphere m.obj -o s.obj", &["cotan repair"]);
    sandbox.refused(
        "deform m.obj --handles h.json -o o.obj --orientation reflect",
        &["needs one oriented surface", "the default orientation"],
    );
}

#[test]
fn a_file_in_which_every_third_face_is_reversed_keeps_every_other_byte() {
    let sandbox = Sandbox::new();
    let text = sheets();
    sandbox.write("m.obj", &text);
    sandbox.write("h.json", HANDLES);
    sandbox.cotan_ok("deform m.obj --handles h.json -o out.obj");
    let out = String::from_utf8(sandbox.read("out.obj")).unwrap();
    let faces = |text: &str| -> Vec<String> {
        let lines = text.lines().filter(|line| line.starts_with('f'));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(faces(&text), faces(&out));
    assert_eq!(text.lines().count(), out.lines().count());
}
