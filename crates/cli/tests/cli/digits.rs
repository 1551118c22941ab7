//! A vertex that does not move keeps its digits, in every job and whatever else moves.

use std::fmt::Write as _;

use cotan::Mesh;
use cotan::shapes;
use cotan_io::{Document, FaceList};
use nalgebra::{Point3, Vector3};

use crate::sandbox::Sandbox;

/// Joins two shapes into one mesh.
fn beside(a: &Mesh<f64>, b: &Mesh<f64>) -> Document {
    let n = a.positions().len() as u32;
    let faces_of = |shape: &Mesh<f64>, first: u32| -> Vec<[u32; 3]> {
        let faces = shape.connectivity().faces();
        faces
            .map(|f| {
                shape
                    .connectivity()
                    .triangle(f)
                    .map(|v| first + v.index() as u32)
            })
            .collect()
    };
    let faces: FaceList = [faces_of(a, 0), faces_of(b, n)]
        .concat()
        .into_iter()
        .collect();
    let away = Vector3::new(4.0, 0.3, -0.1);
    let positions = a
        .positions()
        .values()
        .copied()
        .chain(b.positions().values().map(|p| p + away));
    Document::new(positions.collect(), faces).expect("a document")
}

/// An OBJ of a shape with 20 digits per number and a face without area.
fn odd_obj(shape: &Mesh<f64>) -> String {
    let mut text = String::new();
    for p in shape.positions().values() {
        writeln!(text, "v {:.20} {:.20} {:.20}", p.x, p.y, p.z).expect("a line");
    }
    let mesh = shape.connectivity();
    let mut faces: Vec<Vec<usize>> = mesh
        .faces()
        .map(|f| mesh.triangle(f).map(|v| v.index() + 1).to_vec())
        .collect();
    // A vertex on a side of a single face, and the flat face that closes the gap.
    let [a, b, c] = [faces[0][0], faces[0][1], faces[0][2]];
    let [p, q] = [a, b].map(|v| shape.positions().as_slice()[v - 1]);
    let m = Point3::from((p.coords * 3.0 + q.coords) / 4.0);
    writeln!(text, "v {:.20} {:.20} {:.20}", m.x, m.y, m.z).expect("a line");
    let m = shape.positions().len() + 1;
    faces[0] = vec![a, m, c];
    faces.extend([vec![m, b, c], vec![a, b, m]]);
    for face in faces {
        writeln!(text, "f {} {} {}", face[0], face[1], face[2]).expect("a line");
    }
    text
}

fn fixed(vertices: impl Iterator<Item = usize>) -> String {
    format!(
        r#"{{"handles": [{{"vertices": {:?}, "fixed": true}}]}}"#,
        vertices.collect::<Vec<_>>()
    )
}

/// Writes the same shape in every format.
fn in_every_format(sandbox: &Sandbox) -> Vec<&'static str> {
    sandbox.write("in.obj", odd_obj(&shapes::creature(12)));
    let names = [
        "in.ply",
        "in.off",
        "in.stl",
        "in.glb",
        "in.gltf",
        "in.obj.gz",
    ];
    for name in names {
        sandbox.cotan_ok(&format!("convert in.obj {name}"));
    }
    let single = String::from_utf8(sandbox.read("in.off")).expect("text");
    let mut lines = single.lines().skip(1);
    let counts: Vec<usize> = lines
        .next()
        .expect("counts")
        .split_whitespace()
        .map(|w| w.parse().expect("a count"))
        .collect();
    let body: Vec<&str> = lines.collect();
    sandbox.write(
        "float.ply",
        format!(
            "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
             property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n{}\n",
            counts[0],
            counts[1],
            body.join("\n")
        ),
    );
    [&["in.obj", "float.ply"][..], &names[..]].concat()
}

#[test]
fn an_edit_that_moves_nothing_changes_no_byte() {
    let sandbox = Sandbox::new();
    for name in in_every_format(&sandbox) {
        let n = sandbox.positions(name).len();
        sandbox.write("some.json", fixed((0..n).step_by(17)));
        sandbox.write("half.json", fixed(0..n / 2));
        // Also with a transform that moves nothing.
        sandbox.write(
            "turned.json",
            r#"{"handles": [{"vertices": [0, 5, 9], "transform": {"translate": [0, 0, 0],
               "rotate": {"axis": [0, 0, 1], "degrees": 0}}}]}"#,
        );
        let out = format!("out{}", &name[name.find('.').expect("an extension")..]);
        let as_read = match name {
            "in.obj.gz" => sandbox.read("in.obj"),
            _ => sandbox.read(name),
        };
        let mut lines = vec![
            format!("detail {name} -o {out} --scale 1"),
            format!("detail {name} -o {out} --scale 1 --preserve-volume --max-displacement 0.1"),
            format!("smooth {name} -o {out} --iterations 0"),
        ];
        for handles in ["some", "half", "turned"] {
            for options in [
                "",
                "--precision f32",
                "--soft 100",
                "--orientation reflect",
                "--scheme tutte",
            ] {
                lines.push(format!(
                    "deform {name} --handles {handles}.json -o {out} {options}"
                ));
            }
        }
        for line in lines {
            let outcome = sandbox.cotan(&line);
            if outcome.code != 0 {
                // Some settings do not work with the flat face.
                assert!(
                    line.contains("--scheme") || line.contains("--orientation"),
                    "{outcome:?}"
                );
                continue;
            }
            let bytes = match name {
                "in.obj.gz" => {
                    sandbox.cotan_ok("convert out.obj.gz unpacked.obj");
                    sandbox.read("unpacked.obj")
                }
                _ => sandbox.read(&out),
            };
            assert!(bytes == as_read, "cotan {line}");
        }
    }
}

#[test]
fn fixed_and_unmoved_vertices_keep_their_digits() {
    let sandbox = Sandbox::new();
    let (a, b) = (
        shapes::torus::<f64>(1.0, 0.4, 16, 8),
        shapes::creature::<f64>(12),
    );
    let n = a.positions().len();
    let document = beside(&a, &b);
    cotan_io::save(&document, sandbox.path("in.obj")).expect("a file");
    sandbox.cotan_ok("convert in.obj in.ply");
    sandbox.cotan_ok("convert in.obj in.stl");
    sandbox.cotan_ok("convert in.obj in.glb");
    let before = sandbox.positions("in.obj");
    let held: Vec<usize> = (0..8).collect();
    let pulled = before[70] + Vector3::new(0.0, 0.3, 0.5);
    let ends = [n, n + 40];
    sandbox.write(
        "pull.json",
        format!(
            r#"{{"handles": [{{"vertices": {held:?}, "fixed": true}}, {{"vertices": {ends:?}, "fixed": true}},
                {{"vertices": [70], "to": [[{}, {}, {}]]}}]}}"#,
            pulled.x, pulled.y, pulled.z
        ),
    );
    for precision in ["f64", "f32"] {
        for name in ["in.obj", "in.ply", "in.glb"] {
            let out = format!("out{}", &name[2..]);
            sandbox.cotan_ok(&format!(
                "deform {name} --handles pull.json -o {out} --precision {precision}"
            ));
            let [was, is] = [name, &out].map(|name| sandbox.positions(name));
            for v in 0..was.len() {
                if v >= n || held.contains(&v) {
                    assert_eq!(was[v], is[v], "{name} {precision}: vertex {v}");
                }
            }
            assert!((is[70] - pulled).norm() < 1e-6, "{name} {precision}");
        }
        // Compare line by line, including every digit.
        let [was, is] =
            ["in.obj", "out.obj"].map(|name| String::from_utf8(sandbox.read(name)).expect("text"));
        let lines = was
            .lines()
            .zip(is.lines())
            .filter(|(was, _)| was.starts_with("v "));
        for (v, (was, is)) in lines.enumerate() {
            assert!(
                was == is || (v < n && !held.contains(&v)),
                "vertex {v}: {was} {is}"
            );
        }
    }
}

/// Two welded vertices at one position: both move exactly with the one that has a handle.
///
/// A copy in no face moves with them, and one that is not welded stays.
#[test]
fn welded_twins_follow_exactly() {
    let sandbox = Sandbox::new();
    let shape = shapes::icosphere::<f64>(2);
    let n = shape.positions().len();
    let mut positions: Vec<Point3<f64>> = shape.positions().values().copied().collect();
    // The copy of vertex 3 has one of its faces; that of vertex 4 has none.
    positions.extend([positions[3], positions[4], Point3::new(9.0, 9.0, 9.0)]);
    let mut faces: Vec<[u32; 3]> = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    let at = faces.iter().position(|t| t.contains(&3)).expect("a face");
    faces[at] = faces[at].map(|v| if v == 3 { n as u32 } else { v });
    let document =
        Document::new(positions.clone(), faces.into_iter().collect()).expect("a document");
    cotan_io::save(&document, sandbox.path("in.obj")).expect("a file");
    let pulled = positions[0] * 1.4;
    sandbox.write(
        "pull.json",
        format!(
            r#"{{"handles": [{{"vertices": [9, 11], "fixed": true}},
                {{"vertices": [0], "to": [[{}, {}, {}]]}}]}}"#,
            pulled.x, pulled.y, pulled.z
        ),
    );
    for line in [
        "deform in.obj --handles pull.json -o out.obj --weld exact",
        "deform in.obj --handles pull.json -o out.obj --weld exact --precision f32",
        "smooth in.obj -o out.obj --weld exact --method taubin",
        "detail in.obj -o out.obj --weld exact --scale 0",
    ] {
        sandbox.cotan_ok(line);
        let x = sandbox.positions("out.obj");
        assert_eq!(x[n], x[3], "{line}");
        assert_eq!(x[n + 1], x[4], "{line}");
        assert_eq!(x[n + 2], positions[n + 2], "{line}");
        assert!(x[4] != positions[4] && x[3] != positions[3], "{line}");
    }
}

/// A patch shrunk to a point, whose faces a repair drops: all its vertices follow the one that
/// remains.
#[test]
fn vertices_whose_faces_a_repair_dropped_follow_their_twin() {
    let sandbox = Sandbox::new();
    let shape = shapes::icosphere::<f64>(3);
    let shrunk = shape.positions().map(|p| match p.z > 0.7 {
        true => Point3::new(0.0, 0.0, 0.9),
        false => *p,
    });
    let document = Document::from_mesh(shape.connectivity(), &shrunk).expect("a document");
    cotan_io::save(&document, sandbox.path("patch.obj")).expect("a file");
    let of_patch: Vec<usize> = (0..shrunk.len())
        .filter(|&v| shrunk.as_slice()[v].z == 0.9)
        .collect();
    let low = (0..shrunk.len()).min_by(|&a, &b| {
        let z = |v: usize| shrunk.as_slice()[v].z;
        z(a).total_cmp(&z(b))
    });
    let (low, last) = (low.expect("a vertex"), of_patch[of_patch.len() - 1]);
    sandbox.write(
        "pull.json",
        format!(
            r#"{{"handles": [{{"vertices": [{low}], "fixed": true}},
                {{"vertices": [{last}], "to": [[0.1, 0.2, 1.5]]}}]}}"#
        ),
    );
    for options in ["--weld exact", "--repair --weld exact"] {
        sandbox.cotan_ok(&format!(
            "deform patch.obj --handles pull.json -o out.obj {options}"
        ));
        let x = sandbox.positions("out.obj");
        for &v in &of_patch {
            assert_eq!(x[v], Point3::new(0.1, 0.2, 1.5), "{options}");
        }
    }
}
