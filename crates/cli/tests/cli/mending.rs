//! Files that look broken but are valid or can be repaired: polygons that share a diagonal, holes
//! whose first triangulation does not fit, specks, soups, and headers of other programs.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan::shapes::icosphere;
use nalgebra::Point3;

use crate::sandbox::Sandbox;

/// A cube whose top has a vertex in its centre that is joined to two corners.
///
/// The two quads of the top share two edges, and therefore a diagonal. They start at the given
/// corners.
fn doublet(first: [usize; 2]) -> String {
    let corners = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let sides = "f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let mut tops = [[5, 6, 7, 9], [5, 9, 7, 8]];
    let tops: String = tops
        .iter_mut()
        .zip(first)
        .map(|(top, first)| {
            top.rotate_left(first);
            format!("f {} {} {} {}\n", top[0], top[1], top[2], top[3])
        })
        .collect();
    format!("{corners}v 0.5 0.5 1\n{sides}{tops}")
}

fn is_closed(sandbox: &Sandbox, name: &str) -> bool {
    let info = sandbox.cotan_ok(&format!("info --json {name}"));
    let info: serde_json::Value = serde_json::from_str(&info.stdout).unwrap();
    info["closed"] == true
}

#[test]
fn quads_that_share_a_diagonal_are_the_closed_surface_in_every_format() {
    let sandbox = Sandbox::new();
    for first in [[0, 0], [1, 0], [0, 3], [2, 2]] {
        sandbox.write("d.obj", doublet(first));
        let sphere = sandbox.cotan_ok("sphere d.obj -o s.obj");
        assert!(!sphere.stderr.contains("warning"), "{sphere:?}");
        for name in ["d.ply", "d.off", "d.stl", "d.glb", "d.gltf"] {
            sandbox.cotan_ok(&format!("convert d.obj {name}"));
            let info = sandbox.cotan_ok(&format!("info --json {name}"));
            let info: serde_json::Value = serde_json::from_str(&info.stdout).unwrap();
            assert!(
                info["closed"] == true && info["manifold"] == true,
                "{name}: {info}"
            );
            assert!(
                info["triangles"] == 14 && info["genus"] == 0,
                "{name}: {info}"
            );
            assert_eq!(info["defects"].as_array().unwrap().len(), 0, "{info}");
        }
        let repaired = sandbox.cotan_ok("repair d.obj -o r.obj --all");
        assert!(repaired.stdout.contains("none"), "{repaired:?}");
    }
}

#[test]
fn a_hole_is_filled_by_another_triangulation_or_by_new_vertices() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "two.obj",
        "v 0 0 0\nv 1 0 0\nv 1 1 1\nv 0 1 0\nf 1 2 3\nf 1 3 4\n",
    );
    let outcome = sandbox.cotan_ok("repair two.obj -o o.obj --fill-holes");
    assert!(outcome.stdout.contains("with 2 faces"), "{outcome:?}");
    sandbox.cotan_ok("sphere o.obj -o s.obj");
    sandbox.cotan_ok("sphere two.obj --fill-holes -o s.obj");

    // The seven-vertex torus without one vertex: every two of the others are joined by an edge.
    let mut torus: String = (0..6)
        .map(|v| format!("v {v} {} {}\n", v * v, v % 3))
        .collect();
    for i in 0..7 {
        for face in [[i, i + 1, i + 3], [i, i + 3, i + 2]].map(|face| face.map(|v| v % 7)) {
            if !face.contains(&6) {
                torus += &format!("f {} {} {}\n", face[0] + 1, face[1] + 1, face[2] + 1);
            }
        }
    }
    sandbox.write("torus.obj", torus);
    let outcome = sandbox.cotan_ok("repair torus.obj -o o.obj --fill-holes");
    assert!(
        outcome.stdout.contains("every way to cut it"),
        "{outcome:?}"
    );
    let outcome = sandbox.cotan_ok("repair torus.obj -o o.obj --fill-holes smooth");
    assert!(outcome.stdout.contains("new vert"), "{outcome:?}");
    assert!(is_closed(&sandbox, "o.obj"));
}

#[test]
fn a_hole_in_a_sphere_is_closed_smoothly_in_every_format() {
    let sandbox = Sandbox::new();
    let sphere = icosphere::<f64>(3);
    let faces = sphere.connectivity().to_faces();
    let is_kept = |face: &&Vec<u32>| {
        face.iter()
            .all(|&v| sphere.positions().as_slice()[v as usize].z < 0.6)
    };
    let kept: Vec<&Vec<u32>> = faces.iter().filter(is_kept).collect();
    let document = cotan_io::Document::new(
        sphere.positions().values().copied().collect(),
        kept.into_iter().collect(),
    );
    cotan_io::save(&document.unwrap(), sandbox.path("ball.obj")).unwrap();
    sandbox.cotan_ok("repair ball.obj -o open.obj --compact");
    for name in ["a.obj", "a.ply", "a.off", "a.stl", "a.glb"] {
        sandbox.cotan_ok(&format!("convert open.obj {name}"));
        for option in ["--fill-holes=smooth", "--fill-holes smooth"] {
            sandbox.cotan_ok(&format!("repair {name} -o closed-{name} {option}"));
        }
        let positions = sandbox.positions(&format!("closed-{name}"));
        let radius = |p: &Point3<f64>| p.coords.norm();
        let filled: Vec<f64> = positions.iter().filter(|p| p.z > 0.7).map(radius).collect();
        assert!(filled.len() > 20, "{name}: {}", filled.len());
        // A flat cap would be at 0.6 of the radius.
        assert!(
            filled.iter().all(|r| (0.85..1.05).contains(r)),
            "{name}: {filled:?}"
        );
        sandbox.cotan_ok(&format!("sphere closed-{name} -o s.obj"));
    }
    sandbox.cotan_ok("sphere open.obj --fill-holes smooth -o s.obj");
    assert_eq!(
        sandbox
            .cotan("repair open.obj -o o.obj --fill-holes=smooth:0")
            .code,
        2
    );
    sandbox.cotan_ok("repair open.obj -o o.obj --fill-holes smooth:4");
}

/// A single triangle and a closed tetrahedron.
const PARTS: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 5 0 0\nv 6 0 0\nv 5 1 0\n\
    f 5 6 7\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";

#[test]
fn small_parts_are_dropped_on_request_and_the_error_names_the_command() {
    let sandbox = Sandbox::new();
    sandbox.write("p.obj", PARTS);
    sandbox.refused("sphere p.obj -o s.obj", &["cotan repair --keep-largest"]);
    for option in ["--keep-largest", "--keep-largest=1", "--drop-parts-below 2"] {
        let outcome = sandbox.cotan_ok(&format!("repair p.obj -o o.obj {option}"));
        assert!(
            outcome.stdout.contains("from face 0 (1 face)"),
            "{outcome:?}"
        );
        sandbox.cotan_ok("sphere o.obj -o s.obj");
        assert_eq!(sandbox.positions("o.obj").len(), 4);
    }
    sandbox.refused(
        "repair p.obj -o o.obj --drop-parts-below 9",
        &["fewer than 9 faces"],
    );
}

#[test]
fn a_triangle_soup_is_reported_with_its_counts() {
    let sandbox = Sandbox::new();
    let corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
    let mut soup = String::new();
    for face in [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] {
        for [x, y, z] in face.map(|v: usize| corners[v]) {
            soup += &format!("v {x} {y} {z}\n");
        }
        soup += "f -3 -2 -1\n";
    }
    sandbox.write("soup.obj", &soup);
    sandbox.write("h.txt", "0 0 0 0\n1 0 2 0\n");
    let words = "12 vertices lie at 4 distinct places; with --weld exact 12 open edges meet others";
    let info = sandbox.cotan_ok("info soup.obj");
    assert!(info.stdout.contains(words), "{info:?}");
    for line in [
        "deform soup.obj --handles h.txt -o o.obj",
        "smooth soup.obj -o o.obj",
    ] {
        let outcome = sandbox.cotan_ok(line);
        assert!(outcome.stderr.contains(words), "{outcome:?}");
        let outcome = sandbox.cotan_ok(&format!("{line} --weld exact"));
        assert!(!outcome.stderr.contains("distinct places"), "{outcome:?}");
    }
    sandbox.refused("sphere soup.obj -o s.obj", &[words]);
    sandbox.cotan_ok("sphere soup.obj -o s.obj --weld exact");
}

#[test]
fn a_hole_has_one_name_in_all_messages() {
    let sandbox = Sandbox::new();
    // The hole is at the vertices 5, 6 and 7 of the file, and 5 is not its first corner.
    let open = "v 9 9 9\nv 9 9 8\nv 9 8 9\nv 8 9 9\nv 7 7 7\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n\
        f 8 9 7\nf 6 7 9\nf 9 8 6\n";
    sandbox.write("open.obj", open);
    let name = "hole at vertex 5";
    let info = sandbox.cotan_ok("info open.obj");
    assert!(info.stdout.contains(name), "{info:?}");
    let filled = sandbox.cotan_ok("repair open.obj -o o.obj --fill-holes");
    assert!(filled.stdout.contains(name), "{filled:?}");
    sandbox.refused("sphere open.obj -o s.obj", &["the one at vertex 5"]);
}

#[test]
fn headers_of_other_programs_are_read_or_named() {
    let sandbox = Sandbox::new();
    let body = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
    sandbox.write("glued.off", format!("OFF4 4 6\n{body}"));
    assert!(is_closed(&sandbox, "glued.off"));
    sandbox.write("binary.off", b"OFF BINARY\n\0\0\0\x04\0\0\0\x04\0\0\0\x06");
    sandbox.refused("info binary.off", &["binary OFF is not read", "convert"]);
    let wide: Vec<u8> = PARTS.encode_utf16().flat_map(u16::to_le_bytes).collect();
    sandbox.write("wide.obj", &wide);
    sandbox.refused(
        "info wide.obj",
        &["wide.obj", "UTF-16", "save the file as UTF-8"],
    );
}
