//! Realistic glTF files: shared accessors, external files, and positions far from the origin.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use serde_json::{Value, json};

use crate::sandbox::Sandbox;

const CORNERS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const FACES: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];
/// The base of the tetrahedron stays, its tip moves up.
const HANDLES: &str =
    r#"{"handles":[{"vertices":[0,1,2],"fixed":true},{"vertices":[3],"to":[[0,0,2]]}]}"#;

/// A tetrahedron in the files `pos.bin` and `idx.bin`, referenced by `nodes` as one of `meshes`.
fn tetrahedron(sandbox: &Sandbox, name: &str, nodes: &Value, num_meshes: usize) {
    let folder = name.rsplit_once('/').map_or("", |(folder, _)| folder);
    let at = |file: &str| {
        format!("{folder}/{file}")
            .trim_start_matches('/')
            .to_owned()
    };
    std::fs::create_dir_all(sandbox.path(folder)).unwrap();
    let bytes: Vec<u8> = CORNERS.iter().flat_map(|x| x.to_le_bytes()).collect();
    sandbox.write(&at("pos.bin"), bytes);
    let bytes: Vec<u8> = FACES.iter().flat_map(|x| x.to_le_bytes()).collect();
    sandbox.write(&at("idx.bin"), bytes);
    let meshes = (0..num_meshes)
        .map(|_| json!({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}));
    let json = json!({
        "asset": {"version": "2.0"},
        "nodes": nodes,
        "meshes": meshes.collect::<Vec<_>>(),
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 1, "byteLength": 24}],
        "buffers": [
            {"uri": "pos.bin", "byteLength": 48},
            {"uri": "idx.bin", "byteLength": 24},
        ],
    });
    sandbox.write(name, json.to_string());
}

#[test]
fn a_second_use_of_an_accessor_is_neither_moved_nor_dropped() {
    let sandbox = Sandbox::new();
    let nodes = json!([{"mesh": 0}, {"mesh": 1, "translation": [3, 0, 0]}]);
    tetrahedron(&sandbox, "two.gltf", &nodes, 2);
    sandbox.write("h.json", HANDLES);
    let info = sandbox.cotan_ok("info two.gltf --json").stdout;
    let info: Value = serde_json::from_str(&info).unwrap();
    assert_eq!((&info["vertices"], &info["faces"]), (&json!(8), &json!(8)));
    for line in [
        "deform two.gltf --handles h.json -o out.gltf",
        "deform two.gltf --repair --handles h.json -o out.gltf",
        "repair two.gltf -o out.gltf",
        "smooth two.gltf --repair --iterations 1 -o out.gltf",
        "convert two.gltf out.obj",
    ] {
        let outcome = sandbox.cotan_ok(line);
        assert!(
            !outcome.stderr.contains("repaired by"),
            "{line}: {outcome:?}"
        );
        let out = line.rsplit(' ').next().unwrap();
        let places = sandbox.positions_beside(out);
        assert_eq!(places.len(), 8, "{line}");
        let is_at = |v: usize, x: f64| (places[v].x - x).abs() < 0.9;
        assert!((0..4).all(|v| is_at(v, 0.5)), "{line}: {places:?}");
        assert!((4..8).all(|v| is_at(v, 3.5)), "{line}: {places:?}");
        if out == "out.gltf" {
            assert_eq!(sandbox.json(out)["nodes"], nodes, "{line}");
        }
    }
    // The tip of one instance was moved, that of the other was not.
    sandbox.cotan_ok("deform two.gltf --handles h.json --parts still -o out.gltf");
    let places = sandbox.positions_beside("out.gltf");
    assert_eq!((places[3].z, places[7].z), (2.0, 1.0));
}

#[test]
fn nodes_that_share_a_mesh_are_all_converted() {
    let sandbox = Sandbox::new();
    let nodes = json!([{"mesh": 0}, {"mesh": 0, "translation": [3, 0, 0]}]);
    tetrahedron(&sandbox, "two.gltf", &nodes, 1);
    sandbox.write("h.json", HANDLES);
    let outcome = sandbox.cotan_ok("deform two.gltf --handles h.json -o out.gltf");
    assert!(
        outcome.stderr.contains("an edit of it shows everywhere"),
        "{outcome:?}"
    );
    assert_eq!(sandbox.json("out.gltf")["nodes"], nodes);
    sandbox.cotan_ok("convert out.gltf out.ply");
    let places = sandbox.positions("out.ply");
    assert_eq!(places.len(), 8);
    assert_eq!((places[3].z, places[7].z, places[7].x), (2.0, 2.0, 3.0));
    // New attributes make a new file, which has both instances as well.
    sandbox.cotan_ok("sphere two.gltf -o sphere.glb --uv");
    let places = sandbox.positions("sphere.glb");
    let [near, far] = [0.0, 3.0].map(|x| {
        let is_near = |p: &&nalgebra::Point3<f64>| (p.x - x).abs() <= 1.0 + 1e-6;
        places.iter().filter(is_near).count()
    });
    assert!(
        near >= 4 && near == far && near + far == places.len(),
        "{places:?}"
    );
}

#[test]
fn files_go_with_a_gltf_to_another_folder() {
    let sandbox = Sandbox::new();
    tetrahedron(&sandbox, "a/m.gltf", &json!([{"mesh": 0}]), 1);
    std::fs::create_dir(sandbox.path("b")).unwrap();
    sandbox.write("h.json", HANDLES);
    let outcome = sandbox.cotan_ok("convert a/m.gltf b/m.gltf");
    for file in ["pos.bin", "idx.bin"] {
        assert!(
            outcome.stderr.contains(&format!("b/{file}: copied")),
            "{outcome:?}"
        );
    }
    sandbox.cotan_ok("info b/m.gltf");
    // An unrelated file of that name is neither overwritten nor mistaken for the right one.
    sandbox.write("b/idx.bin", [0; 24]);
    for line in [
        "convert a/m.gltf b/out.gltf",
        "repair a/m.gltf -o b/out.gltf",
        "deform a/m.gltf --handles h.json -o b/out.gltf",
    ] {
        sandbox.refused(line, &["b/idx.bin", "another file of that name"]);
        assert!(!sandbox.path("b/out.gltf").exists(), "{line}");
        assert_eq!(sandbox.read("b/idx.bin"), [0; 24]);
        // With --embed no other file is needed.
        sandbox.cotan_ok(&format!("{line} --embed"));
        std::fs::rename(sandbox.path("b/out.gltf"), sandbox.path("alone.gltf")).unwrap();
        assert_eq!(sandbox.positions("alone.gltf").len(), 4, "{line}");
    }
}

#[test]
fn a_uri_that_many_buffers_name_is_read_once() {
    let sandbox = Sandbox::new();
    tetrahedron(&sandbox, "m.gltf", &json!([{"mesh": 0}]), 1);
    let mut json = sandbox.json("m.gltf");
    let length = 1 << 26;
    std::fs::File::create(sandbox.path("big.bin"))
        .unwrap()
        .set_len(length)
        .unwrap();
    let big = json!({"uri": "big.bin", "byteLength": length});
    // 200 times 64 MiB exceed the limit of 2 GiB; counted once, the buffer does not.
    let buffers = json["buffers"].as_array_mut().unwrap();
    buffers.extend(std::iter::repeat_n(big, 200));
    sandbox.write("m.gltf", json.to_string());
    sandbox.cotan_ok("info m.gltf");
}

#[test]
fn far_from_the_origin_a_gltf_keeps_its_shape_and_an_stl_warns_of_losses() {
    let sandbox = Sandbox::new();
    let [x, y, z] = [4_201_637.25, 168_743.5, 4_780_214.75];
    let corners = CORNERS
        .chunks(3)
        .map(|p| p.iter().map(|&x| 0.1 * f64::from(x)));
    let corners = corners.map(|mut p| {
        let mut next = |at: f64| at + p.next().unwrap();
        format!("v {} {} {}\n", next(x), next(y), next(z))
    });
    let faces = FACES
        .chunks(3)
        .map(|f| format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
    let obj: String = corners.chain(faces).collect();
    sandbox.write("far.obj", obj);
    let outcome = sandbox.cotan_ok("convert far.obj far.glb");
    assert!(outcome.stderr.contains("vertices move by"), "{outcome:?}");
    assert!(outcome.stderr.contains("e-9 at most"), "{outcome:?}");
    let [obj, glb] = ["far.obj", "far.glb"].map(|name| sandbox.positions(name));
    for (a, b) in obj.iter().zip(&glb) {
        assert!((a - b).norm() < 1e-8, "{a} {b}");
    }
    let outcome = sandbox.cotan_ok("convert far.obj far.stl");
    for words in [
        "far from the origin",
        "% of the size",
        "faces become degenerate",
    ] {
        assert!(outcome.stderr.contains(words), "{outcome:?}");
    }
}

#[test]
fn the_error_names_version_1_of_gltf() {
    let sandbox = Sandbox::new();
    for json in [
        json!({"asset": {"version": "1.0"}, "meshes": {"m": {"primitives": []}}}),
        json!({"asset": {"version": 1.0}, "meshes": {}}),
        json!({"accessors": {}, "meshes": {}}),
        json!({"asset": {"version": "1.1"}, "meshes": []}),
    ] {
        sandbox.write("old.gltf", json.to_string());
        sandbox.refused(
            "info old.gltf",
            &["glTF 1.", "is not supported", "glTF 2.0"],
        );
    }
    sandbox.write("old.glb", b"glTF\x01\0\0\0\x14\0\0\0\0\0\0\0\0\0\0\0");
    sandbox.refused("info old.glb", &["glTF 1.0", "glTF 2.0"]);
}

#[test]
fn an_instance_is_edited_alone_by_request() {
    let sandbox = Sandbox::new();
    let nodes = json!([
        {"name": "pair", "children": [1, 2]},
        {"name": "left", "mesh": 0},
        {"name": "right", "mesh": 0, "translation": [3, 0, 0]},
    ]);
    tetrahedron(&sandbox, "two.gltf", &nodes, 1);
    sandbox.write("h.json", HANDLES);
    let shared = sandbox.cotan_ok("deform two.gltf --handles h.json -o both.gltf");
    assert!(shared.stderr.contains("moved wherever it is shown: mesh 0"));
    assert!(shared.stderr.contains("--make-unique"), "{shared:?}");
    sandbox.cotan_ok("convert both.gltf both.ply");
    let places = sandbox.positions("both.ply");
    assert_eq!((places[3].z, places[7].z), (2.0, 2.0));

    let line = "deform two.gltf --make-unique --handles h.json --free right -o one.gltf";
    let unique = sandbox.cotan_ok(line);
    assert!(!unique.stderr.contains("shown"), "{unique:?}");
    sandbox.cotan_ok("convert one.gltf one.ply");
    let places = sandbox.positions("one.ply");
    let tips = (places[3].z, places[7]);
    assert_eq!(tips, (2.0, nalgebra::Point3::new(3.0, 0.0, 1.0)));
    let out = sandbox.json("one.gltf");
    assert_eq!(out["nodes"][1]["mesh"], 0);
    assert_eq!(out["nodes"][2]["mesh"], 1);
    assert_eq!(out["nodes"][2]["name"], "right");
    // Where nothing moves, nothing is said.
    let still = r#"{"handles":[{"vertices":{"node":"pair"},"fixed":true}]}"#;
    sandbox.write("still.json", still);
    let outcome = sandbox.cotan_ok("deform two.gltf --handles still.json -o still.gltf");
    assert!(!outcome.stderr.contains("moved wherever"), "{outcome:?}");
}

#[test]
fn nodes_are_named_in_handles_files_and_options() {
    let sandbox = Sandbox::new();
    let nodes = json!([
        {"name": "arm", "children": [1]},
        {"name": "bones", "children": [2, 3]},
        {"name": "upper", "mesh": 0},
        {"name": "lower", "mesh": 1, "translation": [3, 0, 0]},
    ]);
    tetrahedron(&sandbox, "arm.gltf", &nodes, 2);
    let info = sandbox.cotan_ok("info arm.gltf --json").stdout;
    let info: Value = serde_json::from_str(&info).unwrap();
    let names: Vec<&Value> = info["parts"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| &p["name"])
        .collect();
    assert_eq!(names, ["upper", "lower"]);
    let lift = |node: &str| {
        let moved = r#""transform":{"translate":[0,0,1]}"#;
        let handles = format!(r#"{{"handles":[{{"vertices":{{"node":"{node}"}},{moved}}}]}}"#);
        sandbox.write("h.json", handles);
    };
    let heights = |line: &str| {
        sandbox.cotan_ok(line);
        let places = sandbox.positions_beside("out.gltf");
        [0, 4].map(|v: usize| places[v].z)
    };
    lift("upper");
    let line = "deform arm.gltf --handles h.json -o out.gltf";
    assert_eq!(heights(line), [1.0, 1.0]);
    for free in ["--free lower", "--parts only upper", "--parts still"] {
        assert_eq!(heights(&format!("{line} {free}")), [1.0, 0.0], "{free}");
    }
    let free = r#"{"handles":[{"vertices":{"node":"upper"},"transform":{"translate":[0,0,1]}}],
                   "parts":{"free":["lower"]}}"#;
    sandbox.write("h.json", free);
    assert_eq!(heights(line), [1.0, 0.0]);
    // A node without a mesh stands for those below it, in options as well.
    lift("bones");
    assert_eq!(heights(&format!("{line} --parts still")), [1.0, 1.0]);
    lift("lower");
    assert_eq!(heights(&format!("{line} --parts only bones")), [1.0, 1.0]);

    lift("leg");
    let refused = sandbox.cotan(line);
    assert_ne!(refused.code, 0);
    let words = "names the node \"leg\", which the file does not have; the names are arm, bones, \
                 upper, lower";
    assert!(refused.stderr.contains(words), "{refused:?}");
    sandbox.cotan_ok("convert arm.gltf arm.obj");
    let refused = sandbox.cotan("deform arm.obj --handles h.json -o out.obj");
    assert!(
        refused.stderr.contains("only a glTF has nodes"),
        "{refused:?}"
    );
}
