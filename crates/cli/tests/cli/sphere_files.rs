//! The file of a sphere: every reader cuts its polygons without a flip, and all vertices are on
//! the sphere.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use cotan::Mesh;
use cotan::shapes;
use cotan::sphere::is_upright;
use cotan_io::{Document, FaceList};
use nalgebra::Point3;

use crate::sandbox::Sandbox;

/// Joins the faces of a shape to polygons of up to `most` corners, in the order of the faces.
///
/// Most are bent, and many are concave. No two share a diagonal, and no diagonal is an edge.
fn polygons(shape: &Mesh<f64>, most: usize) -> FaceList {
    let mesh = shape.connectivity();
    let triangles: Vec<[u32; 3]> = mesh
        .faces()
        .map(|f| mesh.triangle(f).map(|v| v.index() as u32))
        .collect();
    let pair = |a: u32, b: u32| [a.min(b), a.max(b)];
    let mut pairs: BTreeSet<[u32; 2]> = BTreeSet::new();
    for &[a, b, c] in &triangles {
        pairs.extend([pair(a, b), pair(b, c), pair(c, a)]);
    }
    let mut is_taken = vec![false; triangles.len()];
    let mut list: Vec<Vec<u32>> = Vec::new();
    for first in 0..triangles.len() {
        if std::mem::replace(&mut is_taken[first], true) {
            continue;
        }
        let mut polygon = triangles[first].to_vec();
        let mut own: BTreeSet<[u32; 2]> = BTreeSet::new();
        // Adds the triangle across a side if its tip is a new corner.
        'grow: while polygon.len() < most {
            for k in 0..polygon.len() {
                let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                let across = triangles.iter().enumerate().find_map(|(g, t)| {
                    let has_side = (0..3).any(|i| (t[i], t[(i + 1) % 3]) == (b, a));
                    let tip = t.iter().copied().find(|&v| v != a && v != b)?;
                    let mut others = polygon.iter().filter(|&&v| v != a && v != b);
                    let is_new = others.all(|&v| !pairs.contains(&pair(v, tip)));
                    let is_free = !is_taken[g] && !polygon.contains(&tip);
                    (has_side && is_free && is_new).then_some((g, tip))
                });
                if let Some((g, tip)) = across {
                    is_taken[g] = true;
                    own.extend(polygon.iter().map(|&v| pair(v, tip)));
                    polygon.insert(k + 1, tip);
                    continue 'grow;
                }
            }
            break;
        }
        pairs.extend(own);
        // Start at another corner, because the polygon was built as a fan from the first one.
        polygon.rotate_left(1);
        list.push(polygon);
    }
    list.iter().collect()
}

/// An OBJ with a texture coordinate per corner and the faces in two groups.
fn textured_obj(shape: &Mesh<f64>, faces: &FaceList) -> String {
    let mut text = String::from("# a sphere to be\n");
    for p in shape.positions().values() {
        writeln!(text, "v {} {} {}", p.x, p.y, p.z).expect("a line");
    }
    for corner in 0..faces.num_corners() {
        writeln!(
            text,
            "vt {} 0.5",
            corner as f64 / faces.num_corners() as f64
        )
        .expect("a line");
    }
    let mut corner = 0;
    for (face, polygon) in faces.iter().enumerate() {
        if face == 0 || face == faces.len() / 2 {
            writeln!(text, "g part{}", face.min(1)).expect("a line");
        }
        text.push('f');
        for v in polygon {
            corner += 1;
            write!(text, " {}/{corner}", v + 1).expect("a word");
        }
        text.push('\n');
    }
    text
}

/// A PLY in single or double precision with a number per face.
fn labelled_ply(shape: &Mesh<f64>, faces: &FaceList, number: &str) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty {number} x\nproperty {number} y\n\
         property {number} z\nelement face {}\nproperty list uchar int vertex_indices\n\
         property int label\nend_header\n",
        shape.positions().len(),
        faces.len()
    );
    for p in shape.positions().values() {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).expect("a line");
    }
    for (face, polygon) in faces.iter().enumerate() {
        let corners: Vec<String> = polygon.iter().map(u32::to_string).collect();
        writeln!(text, "{} {} {face}", polygon.len(), corners.join(" ")).expect("a line");
    }
    text
}

/// The number of flipped triangles in a file, cut as a fan and as our reader cuts it.
fn flips(sandbox: &Sandbox, name: &str) -> [usize; 2] {
    let document = cotan_io::load(sandbox.path(name)).expect("a mesh");
    let x = document.positions();
    let is_flipped = |t: [usize; 3]| !is_upright(&x[t[0]], &x[t[1]], &x[t[2]]);
    let mut fans = 0;
    for polygon in document.faces().iter() {
        let at = |k: usize| polygon[k] as usize;
        fans += (2..polygon.len())
            .filter(|&k| is_flipped([at(0), at(k - 1), at(k)]))
            .count();
    }
    let surface = document.surface().expect("a surface");
    let mesh = surface.mesh();
    let own = mesh
        .faces()
        .map(|f| mesh.triangle(f).map(|v| surface.document_vertex(v)));
    [fans, own.filter(|&t| is_flipped(t)).count()]
}

/// A ball with deep, steep bumps.
fn bent() -> Mesh<f64> {
    let mut shape = shapes::icosphere::<f64>(3);
    for p in shape.positions_mut().iter_mut() {
        let bumps = (9.0 * p.x).sin() * (8.0 * p.y).cos() * (7.0 * p.z + 1.0).sin();
        *p *= 1.0 + 0.5 * bumps;
        p.z *= 2.5;
    }
    shape
}

#[test]
fn polygons_of_a_sphere_are_cut_without_a_flip_by_every_reader_of_every_format() {
    let sandbox = Sandbox::new();
    let shape = bent();
    let mut num_written_as_triangles = 0;
    for most in [4, 5] {
        let faces = polygons(&shape, most);
        assert!(faces.iter().any(|polygon| polygon.len() == most));
        sandbox.write("in.obj", textured_obj(&shape, &faces));
        sandbox.write("float.ply", labelled_ply(&shape, &faces, "float"));
        sandbox.write("double.ply", labelled_ply(&shape, &faces, "double"));
        for (from, to) in [
            ("in.obj", "o.obj"),
            ("in.obj", "o.off"),
            ("in.obj", "o.ply"),
            ("in.obj", "o.stl"),
            ("in.obj", "o.glb"),
            ("in.obj", "o.obj.gz"),
            ("float.ply", "f.ply"),
            ("double.ply", "d.ply"),
            ("double.ply", "p.obj"),
        ] {
            for options in ["", "--precision f32", "--authalic 0.5", "--uv"] {
                let line = format!("sphere {from} -o {to} --report r.json {options}");
                let outcome = sandbox.cotan_ok(&line);
                let report = sandbox.json("r.json");
                num_written_as_triangles +=
                    report["written_as_triangles"].as_u64().expect("a count");
                if outcome.stderr.contains("shorter numbers") {
                    // The triangles of the map themselves do not survive the format, as the
                    // warning says.
                    assert!(from == "float.ply" || to.ends_with("stl") || to.ends_with("glb"));
                    continue;
                }
                assert_eq!(flips(&sandbox, to), [0, 0], "{most} corners, {line}");
            }
        }
    }
    assert!(num_written_as_triangles > 0);
}

#[test]
fn polygons_that_become_triangles_keep_their_texture_groups_and_labels() {
    let sandbox = Sandbox::new();
    let shape = bent();
    let faces = polygons(&shape, 5);
    sandbox.write("in.obj", textured_obj(&shape, &faces));
    sandbox.write("in.ply", labelled_ply(&shape, &faces, "double"));
    sandbox.cotan_ok("sphere in.obj -o out.obj --report r.json");
    let report = sandbox.json("r.json");
    let written = report["written_as_triangles"].as_u64().expect("a count");
    assert!(written > 0);
    let load = |name: &str| cotan_io::load(sandbox.path(name)).expect("a mesh");
    let [before, after] = ["in.obj", "out.obj"].map(load);
    let more: usize = after.faces().len() - before.faces().len();
    assert!(more >= written as usize);
    // Each corner keeps its texture coordinate; here these are all different.
    let text = String::from_utf8(sandbox.read("out.obj")).expect("text");
    assert!(text.starts_with("# a sphere to be\n"));
    let mut vertex_of_texture = vec![None; faces.num_corners() + 1];
    for (corner, &v) in faces.corners().iter().enumerate() {
        vertex_of_texture[corner + 1] = Some(v + 1);
    }
    // Each triangle is in the group of its polygon.
    let first_of_second_group = faces.corner_range(faces.len() / 2).start;
    let mut group = "";
    for line in text.lines() {
        if let Some(name) = line.strip_prefix("g ") {
            group = name;
        }
        if !line.starts_with("f ") {
            continue;
        }
        for word in line.split_whitespace().skip(1) {
            let (v, vt) = word.split_once('/').expect("a texture coordinate");
            let vt: usize = vt.parse().expect("a number");
            let is_second = vt > first_of_second_group;
            assert_eq!(group, if is_second { "part1" } else { "part0" });
            assert_eq!(
                vertex_of_texture[vt].map(|v| v.to_string()).as_deref(),
                Some(v)
            );
        }
    }
    // Each triangle has the label of its polygon.
    sandbox.cotan_ok("sphere in.ply -o out.ply");
    let text = String::from_utf8(sandbox.read("out.ply")).expect("text");
    let rows = text.lines().skip_while(|line| *line != "end_header");
    let mut seen = vec![0; faces.len()];
    for row in rows.skip(1 + shape.positions().len()) {
        let words: Vec<usize> = row
            .split_whitespace()
            .map(|w| w.parse().expect("a number"))
            .collect();
        let (label, corners) = (words[words.len() - 1], &words[1..words.len() - 1]);
        let polygon = faces.get(label).expect("a face");
        assert!(
            corners.iter().all(|&v| polygon.contains(&(v as u32))),
            "{row}"
        );
        seen[label] += corners.len() - 2;
    }
    let degrees: Vec<usize> = faces.iter().map(|polygon| polygon.len() - 2).collect();
    assert_eq!(seen, degrees);
}

#[test]
fn polygons_that_need_no_cut_stay_polygons() {
    let sandbox = Sandbox::new();
    let text = "v 1 1 1\nv -1 1 1\nv -1 -1 1\nv 1 -1 1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 -1\nv 1 -1 -1\n\
                f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n";
    sandbox.write("box.obj", text);
    sandbox.cotan_ok("sphere box.obj -o o.obj --report r.json");
    assert_eq!(sandbox.json("r.json")["written_as_triangles"], 0);
    let written = String::from_utf8(sandbox.read("o.obj")).expect("text");
    assert!(
        written.ends_with("f 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\nf 3 7 8 4\nf 4 8 5 1\n")
    );
}

/// Vertices in no face: far away, inside, at the centre, and at the position of another.
#[test]
fn vertices_in_no_face_land_on_the_sphere_and_are_counted() {
    let sandbox = Sandbox::new();
    let shape = shapes::icosphere::<f64>(2);
    let mut positions: Vec<Point3<f64>> = shape.positions().values().copied().collect();
    let n = positions.len();
    let unused = [
        Point3::new(5.0, 5.0, 5.0),
        Point3::new(0.0, -1e-3, 0.0),
        Point3::origin(),
        Point3::new(1e300, 0.0, 0.0),
        positions[7],
    ];
    positions.extend(unused);
    let faces: FaceList = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    let document = Document::new(positions, faces).expect("a document");
    cotan_io::save(&document, sandbox.path("in.obj")).expect("a file");
    for (options, allowed) in [
        ("", 1e-15),
        ("--precision f32", 2e-7),
        ("--orient principal", 1e-15),
    ] {
        for to in ["o.obj", "o.off", "o.ply"] {
            sandbox.cotan_ok(&format!("sphere in.obj -o {to} --report r.json {options}"));
            let x = sandbox.positions(to);
            let off = |p: &Point3<f64>| (p.coords.norm() - 1.0).abs();
            assert!(x.iter().all(|p| off(p) <= allowed), "{options} {to}");
            assert!((x[n] - Point3::from([1.0 / 3.0_f64.sqrt(); 3])).norm() < 1e-6);
            assert!((x[n + 1] - Point3::new(0.0, -1.0, 0.0)).norm() < 1e-6);
            assert_eq!(x[n + 4], x[7]);
            let report = sandbox.json("r.json");
            assert_eq!(report["unused_vertices"], 5);
            let told = report["sphericity_error"].as_f64().expect("a number");
            assert!(told <= allowed && x.iter().all(|p| off(p) <= told));
        }
    }
}

/// A patch shrunk to a point: its vertices share one position, even those whose faces a repair
/// dropped.
#[test]
fn welded_vertices_land_on_their_mapped_twin() {
    let sandbox = Sandbox::new();
    let shape = shapes::icosphere::<f64>(3);
    let shrunk = shape.positions().map(|p| match p.z > 0.7 {
        true => Point3::new(0.0, 0.0, 0.9),
        false => *p,
    });
    let document = Document::from_mesh(shape.connectivity(), &shrunk).expect("a document");
    cotan_io::save(&document, sandbox.path("patch.obj")).expect("a file");
    for options in [
        "--weld exact",
        "--repair --weld exact",
        "--repair --fill-holes --weld exact",
    ] {
        sandbox.cotan_ok(&format!(
            "sphere patch.obj -o o.obj --report r.json {options}"
        ));
        let x = sandbox.positions("o.obj");
        assert!(
            x.iter().all(|p| (p.coords.norm() - 1.0).abs() < 1e-15),
            "{options}"
        );
        let mut patch = shrunk
            .values()
            .zip(&x)
            .filter(|(p, _)| p.z == 0.9)
            .map(|(_, x)| *x);
        let first = patch.next().expect("a patch");
        assert!(patch.all(|p| p == first), "{options}");
        assert!(
            sandbox.json("r.json")["sphericity_error"]
                .as_f64()
                .expect("a number")
                < 1e-15
        );
    }
    // Almost the same position counts as the same, and both vertices are on the sphere.
    let near = shape.positions().iter().map(|(v, p)| match v.index() {
        0 => Point3::from(p.coords * (1.0 + 1e-7)),
        _ => *p,
    });
    let mut positions: Vec<Point3<f64>> = near.collect();
    positions.push(shape.positions().as_slice()[0]);
    let last = positions.len() as u32 - 1;
    let mut faces: Vec<[u32; 3]> = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    let at = faces.iter().position(|t| t.contains(&0)).expect("a face");
    faces[at] = faces[at].map(|v| if v == 0 { last } else { v });
    let document = Document::new(positions, faces.into_iter().collect()).expect("a document");
    cotan_io::save(&document, sandbox.path("near.obj")).expect("a file");
    sandbox.cotan_ok("sphere near.obj -o o.obj --weld 1e-5");
    let x = sandbox.positions("o.obj");
    assert_eq!(x[0], x[last as usize]);
    assert!(x.iter().all(|p| (p.coords.norm() - 1.0).abs() < 1e-15));
}

#[test]
fn meshes_of_any_size_are_mapped_alike_in_both_precisions() {
    let sandbox = Sandbox::new();
    let shape = shapes::creature::<f64>(16);
    let mut first: Vec<Option<Vec<Point3<f64>>>> = vec![None; 2];
    let mut ratios: Option<f64> = None;
    for power in [0, 900, 100, -100, -900] {
        // A power of two, so that no digit changes.
        let scaled = shape.positions().map(|p| p * 2.0_f64.powi(power));
        let document = Document::from_mesh(shape.connectivity(), &scaled).expect("a document");
        cotan_io::save(&document, sandbox.path("in.obj")).expect("a file");
        for (precision, first) in ["f64", "f32"].into_iter().zip(&mut first) {
            let line = format!("sphere in.obj -o o.obj --precision {precision}");
            let outcome = sandbox.cotan_ok(&line);
            assert_eq!(outcome.stderr, "", "2^{power}");
            let x = sandbox.positions("o.obj");
            assert_eq!(
                first.get_or_insert_with(|| x.clone()),
                &x,
                "2^{power} {precision}"
            );
            sandbox.cotan_ok(&format!(
                "resample in.obj -o s.obj --level 2 --precision {precision}"
            ));
            let size = |name: &str| {
                sandbox
                    .positions(name)
                    .iter()
                    .map(|p| p.coords.amax())
                    .fold(0.0, f64::max)
            };
            // With so few vertices limbs are lost, the same share at any size.
            let ratio = size("s.obj") / size("in.obj");
            let first = ratios.get_or_insert(ratio);
            assert!(
                (ratio / *first - 1.0).abs() < 1e-5,
                "2^{power} {precision}: {ratio} {first}"
            );
        }
        sandbox.cotan_ok("morph in.obj in.obj -o m.obj -t 0.5");
        let moved = sandbox.positions("m.obj");
        let pairs = moved.iter().zip(scaled.values());
        let off = pairs.map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
        assert!(
            off <= 1e-9 * scaled.values().map(|p| p.coords.amax()).fold(0.0, f64::max),
            "2^{power}"
        );
    }
}

/// Lengths that differ by twenty orders of magnitude.
#[test]
fn lengths_beyond_the_precision_are_reported() {
    let sandbox = Sandbox::new();
    let shape = shapes::icosphere::<f64>(3);
    let long = shape.positions().map(|p| Point3::new(1e20 * p.x, p.y, p.z));
    let document = Document::from_mesh(shape.connectivity(), &long).expect("a document");
    cotan_io::save(&document, sandbox.path("long.obj")).expect("a file");
    let outcome = sandbox.cotan_ok("sphere long.obj -o o.obj --report r.json");
    assert!(
        !outcome.stderr.contains("raise --iterations"),
        "{outcome:?}"
    );
    if sandbox.json("r.json")["converged"] != true {
        // Rounding decides whether a step overflows or the iterations only get nowhere.
        let reasons = [
            "overflow",
            "cannot be represented",
            "more of them rarely help",
        ];
        assert!(
            reasons.iter().any(|reason| outcome.stderr.contains(reason)),
            "{outcome:?}"
        );
    }
    assert_eq!(flips(&sandbox, "o.obj"), [0, 0]);
    for method in ["cmcf", "paper"] {
        let outcome = sandbox.cotan(&format!("sphere long.obj -o o.obj --method {method}"));
        assert!(
            !outcome.stderr.contains("NaN") && !outcome.stderr.contains("raise --iterations"),
            "{outcome:?}"
        );
    }
}
