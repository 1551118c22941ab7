//! Text from files and file names on a terminal.

use std::ffi::OsString;

use cotan::shapes;
use cotan_io::Document;

use crate::sandbox::{Outcome, Sandbox, json_handles};

/// Sets the title, clears the screen, and imitates a line of our output, with C0 and C1
/// characters and with direction marks.
const HOSTILE: &str = "a\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\rb\nclosed                  maybe\u{202e}\u{2066}\u{7f}";

/// Checks that a terminal would not act on the output, and that every line is ours.
fn check(outcome: &Outcome, words: &str) {
    for text in [&outcome.stdout, &outcome.stderr] {
        let acts = |c: char| {
            (c.is_control() && c != '\n')
                || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}')
        };
        assert!(!text.contains(acts), "{words}: {text:?}");
        let is_fake = |line: &str| line.starts_with("closed   ") && line.ends_with("maybe");
        assert!(!text.lines().any(is_fake), "{words}: {text:?}");
    }
    assert!(matches!(outcome.code, 0..=2), "{words}: {outcome:?}");
}

/// The text as a name in a file whose lines and words end at white space.
fn hostile_word() -> String {
    HOSTILE.replace(['\n', '\r'], "\u{b}").replace(' ', "\u{8}")
}

fn json_string(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// A glTF of two triangles in which every name is hostile.
fn hostile_gltf() -> String {
    let name = json_string(HOSTILE);
    let attribute = json_string(&format!("_{HOSTILE}"));
    // Positions (0, 0, 0), (1, 0, 0), (0, 1, 0).
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    format!(
        r#"{{"asset": {{"version": "2.0", "generator": {name}}}, "extensionsUsed": [{name}],
        "buffers": [{{"byteLength": 36, "uri": "data:application/octet-stream;base64,{data}"}}],
        "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0]}}],
        "materials": [{{"name": {name}}}],
        "meshes": [
            {{"name": {name}, "primitives": [{{"attributes": {{"POSITION": 0, {attribute}: 0}}, "material": 0}}]}},
            {{"name": {name}, "primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
        "nodes": [{{"name": {name}, "mesh": 0}}, {{"name": {name}, "mesh": 1}}],
        "scenes": [{{"nodes": [0, 1]}}], "scene": 0}}"#
    )
}

fn hostile_ply() -> String {
    let word = hostile_word();
    format!(
        "ply\nformat ascii 1.0\ncomment {word}\nelement vertex 3\nproperty float x\nproperty float y\n\
         property float z\nproperty float {word}\nelement face 1\nproperty list uchar int vertex_indices\n\
         property uchar {word}\nelement {word} 1\nproperty float {word}\nend_header\n\
         0 0 0 1\n1 0 0 nan\n0 1 0 3\n3 0 1 2 7\n5\n"
    )
}

fn hostile_obj() -> String {
    let word = hostile_word();
    format!(
        "mtllib {word}.mtl\no {word}\ng {word}\nusemtl {word}\n{word} 1 2\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    )
}

#[test]
fn names_from_meshes_cannot_control_the_terminal() {
    let sandbox = Sandbox::new();
    sandbox.write("m.gltf", hostile_gltf());
    sandbox.write("m.ply", hostile_ply());
    sandbox.write("m.obj", hostile_obj());
    let word = hostile_word();
    sandbox.write("bad1.obj", format!("v 0 0 {word}\nf 1 1 1\n"));
    sandbox.write("bad2.ply", format!("ply\nformat {word} 1.0\nend_header\n"));
    sandbox.write(
        "bad3.ply",
        format!("ply\nformat ascii 1.0\nelement vertex {word}\nend_header\n"),
    );
    sandbox.write("bad4.off", format!("OFF\n{word} 1 2\n"));
    sandbox.write(
        "bad5.stl",
        format!("solid {word}\nfacet normal 0 0 {word}\n"),
    );
    sandbox.write(
        "bad6.gltf",
        hostile_gltf().replace("\"VEC3\"", &json_string(HOSTILE)),
    );
    sandbox.write(
        "bad7.gltf",
        hostile_gltf().replace("data:application", &json_string(HOSTILE)[1..10]),
    );
    sandbox.write(
        "bad8.gltf",
        hostile_gltf().replace("extensionsUsed", "extensionsRequired"),
    );
    sandbox.write(
        "bad9.gltf",
        format!("{{\"asset\": {}}}", json_string(HOSTILE)),
    );
    sandbox.write(
        "bad10.obj",
        format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {word}\n"),
    );
    sandbox.write("h.txt", "0 0 0 0\n");
    let names = [
        "m.gltf",
        "m.ply",
        "m.obj",
        "bad1.obj",
        "bad2.ply",
        "bad3.ply",
        "bad4.off",
        "bad5.stl",
        "bad6.gltf",
        "bad7.gltf",
        "bad8.gltf",
        "bad9.gltf",
        "bad10.obj",
    ];
    for name in names {
        let lines = [
            format!("info {name}"),
            format!("info {name} --json"),
            format!("repair {name} -o o1.ply --all --report r1.json"),
            format!("convert {name} o2.stl"),
            format!("convert {name} o3.off -vvv"),
            format!("convert {name} o4.obj"),
            format!("convert {name} o5.ply"),
            format!("convert {name} o6.glb"),
            format!("deform {name} --handles h.txt -o o7.stl -v"),
            format!("smooth {name} -o o8.stl --report /dev/stdout"),
            format!("detail {name} --field x -o o9.stl"),
            format!("sphere {name} -o o10.stl --fill-holes"),
            format!("compare {name} {name}"),
            format!("bench {name} --rounds 1"),
        ];
        for line in lines {
            check(&sandbox.cotan(&line), &line);
        }
    }
    // All of it is shown.
    let shown = sandbox.cotan_ok("info m.gltf").stdout;
    assert!(
        shown.contains(r"a\u{1b}]0;owned\u{7}\u{1b}[2J\u{9b}31m\rb\nclosed"),
        "{shown}"
    );
}

#[test]
fn escaped_json_has_the_same_meaning() {
    let sandbox = Sandbox::new();
    sandbox.write("m.gltf", hostile_gltf());
    let outcome = sandbox.cotan_ok("info m.gltf --json");
    let json: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    assert_eq!(json["parts"][0]["name"], HOSTILE);
}

#[test]
fn handles_and_landmarks_cannot_control_the_terminal() {
    let sandbox = Sandbox::with_bar();
    let ball = shapes::icosphere::<f64>(1);
    let ball = Document::from_mesh(ball.connectivity(), ball.positions()).expect("a document");
    cotan_io::save(&ball, sandbox.path("ball.obj")).expect("a mesh file");
    let (word, string) = (hostile_word(), json_string(HOSTILE));
    sandbox.write("h1.txt", format!("{word} 0 0 0\n"));
    sandbox.write("h2.txt", format!("0 0 0 {word}\n"));
    sandbox.write("h3.json", format!("{{{string}: 1}}"));
    sandbox.write(
        "h4.json",
        format!("{{\"handles\": [{{\"vertices\": {string}}}]}}"),
    );
    sandbox.write(
        "h5.json",
        format!("{{\"handles\": [{{\"vertices\": [0], {string}: 1}}]}}"),
    );
    sandbox.write("h6.sel", format!("{word}\n"));
    sandbox.write("h7.json", format!("{{\"handles\": [{HOSTILE}]}}"));
    for name in [
        "h1.txt", "h2.txt", "h3.json", "h4.json", "h5.json", "h6.sel", "h7.json",
    ] {
        let line = format!("deform bar.obj --handles {name} -o o.obj");
        let outcome = sandbox.cotan(&line);
        assert_eq!(outcome.code, 1, "{line}: {outcome:?}");
        check(&outcome, &line);
        let line = format!("sphere ball.obj --landmarks {name} -o o.obj");
        check(&sandbox.cotan(&line), &line);
        let line = format!("morph ball.obj ball.obj -t 0 --landmarks {name} -o o.obj");
        check(&sandbox.cotan(&line), &line);
    }
}

#[cfg(unix)]
#[test]
fn file_names_and_arguments_cannot_control_the_terminal() {
    use std::os::unix::ffi::OsStringExt;
    let sandbox = Sandbox::with_bar();
    let hostile = HOSTILE.replace('/', "");
    let mut latin = hostile.clone().into_bytes();
    latin.extend(b"\xff\xe9\x9b31m");
    for bytes in [hostile.into_bytes(), latin] {
        let name = |extension: &str| {
            let mut name = bytes.clone();
            name.extend(extension.as_bytes());
            OsString::from_vec(name)
        };
        let [mesh, out, handles, missing] = [".obj", ".ply", ".json", ".off"].map(name);
        std::fs::copy(sandbox.path("bar.obj"), sandbox.path(".").join(&mesh)).expect("a copy");
        std::fs::write(sandbox.path(".").join(&handles), json_handles()).expect("handles");
        let [mesh, out, handles, missing] =
            [&mesh, &out, &handles, &missing].map(|n| n.as_os_str());
        let word = std::ffi::OsStr::new;
        let lines: Vec<Vec<&std::ffi::OsStr>> = vec![
            vec![word("info"), mesh],
            vec![word("info"), missing],
            vec![word("info"), mesh, word("--json")],
            vec![word("convert"), mesh, out, word("-v")],
            vec![word("convert"), mesh, mesh],
            vec![word("convert"), mesh, word("o.stl"), word("-vv")],
            vec![
                word("deform"),
                mesh,
                word("--handles"),
                handles,
                word("-o"),
                out,
                word("-vv"),
            ],
            vec![
                word("deform"),
                mesh,
                word("--handles"),
                mesh,
                word("-o"),
                out,
            ],
            vec![word("smooth"), mesh, word("-o"), out, word("--report"), out],
            vec![
                word("smooth"),
                mesh,
                word("-o"),
                out,
                word("--truth"),
                missing,
            ],
            vec![
                word("detail"),
                mesh,
                word("-o"),
                out,
                word("--field"),
                handles,
            ],
            vec![
                word("sphere"),
                mesh,
                word("-o"),
                out,
                word("--landmarks"),
                handles,
            ],
            vec![word("compare"), mesh, missing],
            vec![word("compare"), mesh, mesh],
            vec![word("repair"), mesh, word("-o"), out],
            vec![word("bench"), mesh, word("--rounds"), word("1")],
            vec![word("demo"), word("-o"), mesh],
            // Usage errors.
            vec![mesh],
            vec![word("info"), mesh, handles],
            vec![word("info"), word("--limit"), mesh, mesh],
            vec![word("smooth"), word("--method"), mesh],
            vec![
                word("smooth"),
                mesh,
                word("-o"),
                out,
                word("--anchor"),
                mesh,
            ],
        ];
        for words in lines {
            check(&sandbox.run(&words), &format!("{words:?}"));
        }
        let outcome = sandbox.run([word("info"), mesh, word("--json")]);
        serde_json::from_str::<serde_json::Value>(&outcome.stdout).expect("JSON");
    }
}
