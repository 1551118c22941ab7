//! Input that is refused with exit code 1 and a message that says what to do.

use crate::sandbox::{Sandbox, ends, json_handles, numbers, sel_handles};

/// Runs `deform` with these handles on the bar.
fn refused(name: &str, handles: &str, words: &[&str]) {
    let sandbox = Sandbox::with_bar();
    sandbox.write(name, handles);
    let words: Vec<&str> = std::iter::once(name).chain(words.iter().copied()).collect();
    sandbox.refused(
        &format!("deform bar.obj --handles {name} -o out.obj"),
        &words,
    );
    assert!(!sandbox.path("out.obj").exists());
}

#[test]
fn missing_files_and_files_that_are_not_meshes() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.json", json_handles());
    sandbox.refused("info nix.obj", &["nix.obj", "cannot read"]);
    sandbox.refused("deform nix.obj --handles h.json -o o.obj", &["nix.obj"]);
    sandbox.refused(
        "deform bar.obj --handles nix.json -o o.obj",
        &["nix.json", "cannot read"],
    );
    sandbox.write("empty.obj", "");
    sandbox.refused("info empty.obj", &["empty.obj", "the file is empty"]);
    sandbox.write("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.refused("info nan.obj", &["nan.obj", "line 2", "vertex 1"]);
    sandbox.write("mesh.xyz", "0 0 0\n");
    sandbox.refused("info mesh.xyz", &["mesh.xyz", ".obj, .ply, .off, .stl"]);
    sandbox.write(
        "fan.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n",
    );
    let words = [
        "fan.obj",
        "faces 0 and 1",
        "oriented against each other",
        "--orient`",
    ];
    let offered = [words.as_slice(), &["or pass --repair"]].concat();
    sandbox.refused("deform fan.obj --handles h.json -o o.obj", &offered);
    sandbox.refused("compare fan.obj fan.obj", &words);
}

#[test]
fn outputs_that_cannot_be_written() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.json", json_handles());
    let deform = "deform bar.obj --handles h.json";
    sandbox.refused(
        &format!("{deform} -o out.xyz"),
        &["out.xyz", ".obj, .ply, .off, .stl"],
    );
    sandbox.refused(
        &format!("{deform} -o no/out.obj"),
        &["no/out.obj", "does not exist"],
    );
    sandbox.refused(
        &format!("{deform} -o o.obj --report no/r.json"),
        &["no/r.json"],
    );
    sandbox.refused(
        &format!("{deform} -o o.obj --picture no/p.png"),
        &["no/p.png"],
    );
    assert!(!sandbox.path("o.obj").exists());
    sandbox.refused("convert bar.obj bar.xyz", &["bar.xyz"]);
    sandbox.write("file", "");
    sandbox.refused("demo -o file/demo", &["file/demo"]);
}

#[test]
fn json_that_is_not_a_handles_file() {
    refused("h.json", "{", &["not a handles file", "line 1"]);
    refused("h.json", "[]", &["not a handles file"]);
    refused("h.json", "{\"handles\": []}", &["no handle"]);
    refused(
        "h.json",
        "{\"handles\": [], \"version\": 2}",
        &["version", "expected `handles`"],
    );
    let entry = |entry: &str| {
        format!("{{\"handles\": [{{\"vertices\": [0], \"fixed\": true}},\n{entry}]}}")
    };
    let cases: [(&str, &[&str]); 18] = [
        (
            r#"{"vertices": [0], "fixd": true}"#,
            &["handle 1", "unknown field `fixd`", "line 2"],
        ),
        (
            r#"{"vertices": {"cube": 1}, "fixed": true}"#,
            &["handle 1", "unknown field `cube`"],
        ),
        (
            r#"{"vertices": {"sphere": {"centre": [0, 0, 0], "radius": 1}}, "fixed": true}"#,
            &["unknown field `centre`", "`center`"],
        ),
        (
            r#"{"vertices": [0], "transform": {"shear": 1}}"#,
            &["handle 1", "unknown field `shear`"],
        ),
        (
            r#"{"vertices": [0.5], "fixed": true}"#,
            &["handle 1", "0.5"],
        ),
        (r#"{"vertices": [-1], "fixed": true}"#, &["handle 1", "-1"]),
        (
            r#"{"vertices": "all", "fixed": true}"#,
            &["handle 1", "a list of vertex indices"],
        ),
        (r#"{"vertices": [], "fixed": true}"#, &["handle 1", "empty"]),
        (
            r#"{"vertices": [0], "to": [[0, 1]]}"#,
            &["handle 1", "found 2", "[x, y, z]"],
        ),
        (
            r#"{"vertices": [0, 1], "to": [[0, 1, 2]]}"#,
            &["handle 1", "2 vertices", "1 positions"],
        ),
        (
            r#"{"vertices": [0], "to": [[0, 1, 1e999]]}"#,
            &["handle 1", "out of range"],
        ),
        (
            r#"{"vertices": [1]}"#,
            &["handle 1", "\"to\", \"transform\" or \"fixed\""],
        ),
        (
            r#"{"vertices": [1], "fixed": false}"#,
            &["handle 1", "has no goal"],
        ),
        (
            r#"{"vertices": [1], "fixed": true, "to": [[0, 0, 0]]}"#,
            &["handle 1", "more than one goal"],
        ),
        (
            r#"{"vertices": [1], "fixed": true, "weight": 0}"#,
            &["handle 1", "weight 0"],
        ),
        (
            r#"{"vertices": [1], "transform": {}}"#,
            &["handle 1", "empty transform"],
        ),
        (
            r#"{"vertices": [1], "transform": {"matrix": [[1, 0, 0, 0]]}}"#,
            &["handle 1", "1 rows"],
        ),
        (
            r#"{"vertices": {"box": {"min": [1, 0, 0], "max": [0, 1, 1]}}, "fixed": true}"#,
            &["handle 1", "min is above its max"],
        ),
    ];
    for (text, words) in cases {
        refused("h.json", &entry(text), words);
    }
}

#[test]
fn handles_without_vertices() {
    let region =
        |region: &str| format!(r#"{{"handles": [{{"vertices": {region}, "fixed": true}}]}}"#);
    let far = r#"{"box": {"min": [50, 50, 50], "max": [60, 60, 60]}}"#;
    refused(
        "h.json",
        &region(far),
        &["handle 0", "no vertex of the mesh lies in its box"],
    );
    let far = r#"{"sphere": {"center": [50, 50, 50], "radius": 1}}"#;
    refused(
        "h.json",
        &region(far),
        &["handle 0", "no vertex of the mesh lies in its sphere"],
    );
    refused("h.txt", "# nothing\n\n", &["no handle"]);
}

#[test]
fn handles_of_missing_vertices() {
    let out = r#"{"handles": [{"vertices": [0, 99999], "fixed": true}]}"#;
    refused(
        "h.json",
        out,
        &["handle 0", "no vertex 99999", "numbered from 0"],
    );
    refused(
        "h.txt",
        "0 0 0 0\n\n99999 0 0 0\n",
        &["line 3", "no vertex 99999"],
    );

    let sandbox = Sandbox::new();
    sandbox.write("mesh.obj", "v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 2 3 4\n");
    sandbox.write("h.txt", "0 1 2 3\n");
    let line = "deform mesh.obj --handles h.txt -o o.obj";
    sandbox.refused(line, &["h.txt", "line 1", "vertex 0 belongs to no face"]);
}

#[test]
fn lines_that_are_not_handles() {
    refused("h.txt", "0 0 0\n", &["line 1", "vertex x y z"]);
    refused("h.txt", "0 0 0 0\n# c\nx 0 0 0\n", &["line 3", "`x`"]);
    refused("h.txt", "-1 0 0 0\n", &["line 1", "`-1`"]);
    refused(
        "h.txt",
        "0 0 nan 0\n",
        &["line 1", "vertex 0", "`nan` is not a finite number"],
    );
    refused("h.txt", "0 0 1e999 0\n", &["line 1", "1e999"]);
    refused(
        "h.txt",
        "0 0 zero 0\n",
        &["line 1", "`zero` is not a number"],
    );
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.txt", [0xff, 0xfe, 0x00]);
    sandbox.refused(
        "deform bar.obj --handles h.txt -o o.obj",
        &["h.txt", "not a text file"],
    );
}

#[test]
fn handles_that_contradict_each_other() {
    let [left, right] = ends().map(|end| numbers(&end));
    let both = format!(
        r#"{{"handles": [{{"vertices": {left:?}, "fixed": true}}, {{"vertices": {right:?},
            "fixed": true}}, {{"vertices": [{}], "transform": {{"translate": [0, 0, 1]}}}}]}}"#,
        right[0]
    );
    let vertex = format!("vertex {} to different positions", right[0]);
    refused("h.json", &both, &["handle 1 and handle 2", &vertex]);
    refused(
        "h.txt",
        "3 0 0 0\n4 1 1 1\n3 0 0 1\n",
        &["line 1 and line 3", "vertex 3"],
    );
}

#[test]
fn components_without_a_handle() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "two.obj",
        "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 4\nv 1 0 4\nv 0 1 4\nf 2 3 4\nf 5 6 7\n",
    );
    sandbox.write("h.txt", "1 0 0 0\n");
    // Vertex 4 of the file is vertex 3 of the surface; the error uses the index of the file.
    sandbox.refused(
        "reconstruct two.obj --handles h.txt --iterations 5 -o o.obj",
        &["two.obj", "with vertex 4 (3 vertices) has no handle"],
    );
}

#[test]
fn statuses_and_matrices() {
    refused("h.sel", "0\n1\n2\n", &["3 lines of status"]);
    refused(
        "h.sel",
        &sel_handles().replacen("2\n", "7\n", 1),
        &["`7` is not a status"],
    );
    refused("h.sel", &sel_handles(), &["h.def", "--def"]);
    let sandbox = Sandbox::with_bar();
    sandbox.write("h.sel", sel_handles());
    let line = "deform bar.obj --handles h.sel -o o.obj";
    sandbox.write("h.def", "1 0 0 0\n0 1 0 0\n");
    sandbox.refused(line, &["h.def", "2 rows"]);
    sandbox.write("h.def", "1 0 0 0\n0 1 0 0\n0 0 1 0\n5 0 0 1\n");
    sandbox.refused(line, &["h.def", "last column"]);
    sandbox.write("h.def", "1 0 0 x\n");
    sandbox.refused(line, &["h.def", "line 1", "`x`"]);
    sandbox.refused(
        &format!("{line} --def nix.def"),
        &["nix.def", "cannot read"],
    );
}

#[test]
fn meshes_that_cannot_be_compared() {
    let sandbox = Sandbox::with_bar();
    sandbox.write("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    sandbox.write("turned.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 3 2\n");
    // Other faces are compared by their surfaces, but have no vertices in common with a shape.
    sandbox.refused(
        "compare bar.obj tri.obj --distance-to bar.obj",
        &["bar.obj", "tri.obj", "3 vertices and 1 faces"],
    );
    sandbox.refused(
        "compare tri.obj turned.obj --distance-to tri.obj",
        &["face 0", "different corners"],
    );
}
