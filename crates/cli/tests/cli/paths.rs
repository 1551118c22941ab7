//! Named files: no output overwrites an input or another output, and only regular files are read.

use cotan::shapes;
use cotan_io::Document;

use crate::sandbox::{Sandbox, def_matrix, json_handles, sel_handles};

/// `bar.obj`, `same.obj` (the same mesh), `h.json`, `h.sel` with `h.def`, `ball.obj` and `l.txt`.
fn with_inputs() -> Sandbox {
    let sandbox = Sandbox::with_bar();
    sandbox.write("same.obj", sandbox.read("bar.obj"));
    sandbox.write("h.json", json_handles());
    sandbox.write("h.sel", sel_handles());
    sandbox.write("h.def", def_matrix());
    let ball = shapes::icosphere::<f64>(1);
    let ball = Document::from_mesh(ball.connectivity(), ball.positions()).expect("a document");
    cotan_io::save(&ball, sandbox.path("ball.obj")).expect("a mesh file");
    sandbox.write("l.txt", "0\n3\n7\n");
    std::fs::create_dir(sandbox.path("sub")).expect("a folder");
    sandbox
}

/// Each line must end with exit code 2, leave every file unchanged, and create none.
fn refuse_all(sandbox: &Sandbox, lines: &[&str]) {
    let before = sandbox.contents();
    for line in lines {
        let outcome = sandbox.cotan(line);
        assert_eq!(outcome.code, 2, "cotan {line}: {outcome:?}");
        assert!(outcome.stderr.starts_with("error: "), "{line}: {outcome:?}");
        assert!(
            outcome.stderr.contains("the same file"),
            "{line}: {outcome:?}"
        );
        assert!(outcome.stdout.is_empty(), "{line}: {outcome:?}");
        assert_eq!(sandbox.contents(), before, "cotan {line}");
    }
}

#[test]
fn an_output_that_is_an_input_is_refused() {
    let deform = "deform bar.obj --handles h.json";
    let sandbox = with_inputs();
    refuse_all(
        &sandbox,
        &[
            &format!("{deform} -o bar.obj"),
            &format!("{deform} -o o.obj --report bar.obj"),
            &format!("{deform} -o o.obj --report h.json"),
            &format!("{deform} -o o.obj --picture ./bar.obj"),
            &format!("{deform} -o sub/../bar.obj"),
            &format!("{deform} -o {}", sandbox.path("bar.obj").display()),
            "deform bar.obj --handles h.sel --def h.def -o o.obj --report h.def",
            // `h.def` is found next to `h.sel`.
            "deform bar.obj --handles h.sel -o o.obj --report h.def",
            "reconstruct bar.obj --handles h.json --iterations 2 -o o.obj --report h.json",
            "smooth bar.obj -o bar.obj",
            "smooth bar.obj -o o.obj --report bar.obj",
            "smooth bar.obj -o o.obj --truth same.obj --picture same.obj",
            "smooth bar.obj -o same.obj --truth same.obj",
            "detail bar.obj --scale 2 -o bar.obj",
            "detail bar.obj --from same.obj -o same.obj",
            "detail bar.obj --from same.obj -o o.obj --report same.obj",
            "repair bar.obj -o bar.obj",
            "repair bar.obj -o o.obj --report bar.obj",
            "convert bar.obj bar.obj",
            "convert bar.obj sub/.././bar.obj",
            "sphere ball.obj -o ball.obj",
            "sphere ball.obj -o o.obj --geometry-image ball.obj",
            "sphere ball.obj -o o.obj --picture ball.obj",
            "sphere ball.obj -o o.obj --landmarks l.txt --report l.txt",
            "resample ball.obj --level 1 -o ball.obj",
            "resample ball.obj --level 1 -o o.obj --report ball.obj",
            "resample ball.obj --level 1 -o o.obj --landmarks l.txt --report l.txt",
            "morph ball.obj bar.obj -t 0.5 -o bar.obj",
            "morph ball.obj bar.obj -t 0.5 -o ball.obj",
        ],
    );
}

#[test]
fn an_output_that_is_another_output_is_refused() {
    let deform = "deform bar.obj --handles h.json";
    let sandbox = with_inputs();
    refuse_all(
        &sandbox,
        &[
            &format!("{deform} -o o.obj --report o.obj"),
            &format!("{deform} -o o.obj --picture sub/../o.obj"),
            &format!("{deform} -o o.obj --report r --picture ./r"),
            "smooth bar.obj -o o.obj --report o.obj",
            "repair bar.obj -o o.obj --report o.obj",
            "sphere ball.obj -o o.obj --geometry-image g.png --picture g.png",
            "sphere ball.obj -o o.obj --geometry-image o.obj",
            "resample ball.obj --level 1 -o o.obj --report o.obj",
        ],
    );
    // Other files are accepted.
    sandbox.cotan_ok(&format!(
        "{deform} -o o.obj --report r.json --picture sub/r.json"
    ));
    assert!(sandbox.json("r.json")["vertices"].is_u64());
}

#[cfg(unix)]
#[test]
fn links_are_resolved() {
    use std::os::unix::fs::symlink;
    let sandbox = with_inputs();
    symlink("bar.obj", sandbox.path("soft.obj")).expect("a link");
    symlink("sub", sandbox.path("folder")).expect("a link");
    symlink("sub/new.obj", sandbox.path("dangling.obj")).expect("a link");
    std::fs::hard_link(sandbox.path("bar.obj"), sandbox.path("hard.obj")).expect("a link");
    refuse_all(
        &sandbox,
        &[
            "convert bar.obj soft.obj",
            "convert soft.obj bar.obj",
            "convert bar.obj hard.obj",
            "convert bar.obj folder/../bar.obj",
            "smooth bar.obj -o dangling.obj --report folder/new.obj",
            "smooth soft.obj -o o.obj --report hard.obj",
        ],
    );
    sandbox.cotan_ok("convert bar.obj dangling.obj");
    let link = std::fs::symlink_metadata(sandbox.path("dangling.obj")).expect("the link");
    assert!(link.is_symlink());
    assert_eq!(sandbox.read("sub/new.obj"), sandbox.read("bar.obj"));
    // A file with two hard links: only the named one changes, and a message says so.
    std::fs::hard_link(sandbox.path("sub/new.obj"), sandbox.path("twin.obj")).expect("a link");
    let outcome = sandbox.cotan_ok("smooth bar.obj -o twin.obj");
    assert!(
        outcome.stderr.contains("2 names (hard links)"),
        "{outcome:?}"
    );
    assert_eq!(sandbox.read("sub/new.obj"), sandbox.read("bar.obj"));
    assert_ne!(sandbox.read("twin.obj"), sandbox.read("bar.obj"));
}

#[cfg(unix)]
#[test]
fn a_demo_whose_files_are_links_to_each_other_is_refused() {
    let sandbox = Sandbox::new();
    std::fs::create_dir(sandbox.path("demo")).expect("a folder");
    let link = sandbox.path("demo/report.json");
    std::os::unix::fs::symlink("before.obj", link).expect("a link");
    refuse_all(&sandbox, &["demo -o demo"]);
    assert!(!sandbox.path("demo/before.obj").exists());
}

/// A triangle whose positions and indices are in `scene.bin`.
fn with_external_buffer() -> Sandbox {
    let sandbox = Sandbox::new();
    let positions: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut bytes: Vec<u8> = positions.iter().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0u16, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
    sandbox.write("scene.bin", bytes);
    sandbox.write(
        "scene.gltf",
        r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 42, "uri": "scene.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
            "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}], "scene": 0}"#,
    );
    sandbox
}

#[test]
fn the_buffer_of_a_gltf_is_an_input_too() {
    let sandbox = with_external_buffer();
    refuse_all(
        &sandbox,
        &[
            "repair scene.gltf -o o.obj --report scene.bin",
            "smooth scene.gltf -o o.obj --report ./scene.bin",
        ],
    );
    sandbox.cotan_ok("repair scene.gltf -o o.obj --report scene.json");
}

#[cfg(unix)]
#[test]
fn the_images_of_a_mesh_are_inputs_too() {
    let sandbox = with_external_buffer();
    std::fs::create_dir(sandbox.path("sub")).expect("a folder");
    let gltf = String::from_utf8(sandbox.read("scene.gltf")).expect("text");
    let images = r#"{"images": [{"uri": "sub/a%20b.png"}, {"uri": "gone.png"}], "asset""#;
    sandbox.write("scene.gltf", gltf.replacen("{\"asset\"", images, 1));
    sandbox.write("sub/a b.png", "an image");
    sandbox.write("image.png", "another");
    sandbox.write("m.mtl", "newmtl a\nmap_Kd image.png\n");
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    sandbox.write("m.obj", obj);
    std::os::unix::fs::symlink("sub/a b.png", sandbox.path("link")).expect("a link");
    refuse_all(
        &sandbox,
        &[
            "repair scene.gltf -o o.obj --report link",
            "smooth scene.gltf -o o.obj --picture link",
            "repair m.obj -o o.obj --report m.mtl",
            "repair m.obj -o o.ply --report image.png",
            "smooth m.obj -o o.ply --picture sub/../image.png",
        ],
    );
    // A missing image is not an input.
    sandbox.cotan_ok("repair scene.gltf -o o.obj --report gone.png");
}

#[test]
fn a_report_does_not_overwrite_files_copied_with_the_mesh() {
    let sandbox = Sandbox::new();
    std::fs::create_dir_all(sandbox.path("in")).expect("a folder");
    sandbox.write("in/m.mtl", "newmtl a\nKd 1 0 0\n");
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    sandbox.write("in/m.obj", obj);
    let outcome = sandbox.cotan("repair in/m.obj -o o.obj --report m.mtl");
    assert_eq!(outcome.code, 2, "{outcome:?}");
    assert!(outcome.stderr.contains("--report m.mtl"), "{outcome:?}");
    assert_eq!(sandbox.read("m.mtl"), sandbox.read("in/m.mtl"));
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_not_read() {
    let sandbox = with_inputs();
    let made = std::process::Command::new("mkfifo")
        .arg(sandbox.path("pipe"))
        .status();
    assert!(made.expect("mkfifo runs").success());
    std::os::unix::fs::symlink("/dev/zero", sandbox.path("zero")).expect("a link");
    std::os::unix::fs::symlink("pipe", sandbox.path("pipe.obj")).expect("a link");
    for name in ["pipe", "pipe.obj", "zero", "/dev/zero", "/dev/stdin"] {
        let lines = [
            format!("info {name}"),
            format!("bench {name}"),
            format!("convert {name} o.obj"),
            format!("repair {name} -o o.obj"),
            format!("compare bar.obj {name}"),
            format!("compare {name} bar.obj"),
            format!("smooth bar.obj -o o.obj --truth {name}"),
            format!("detail bar.obj -o o.obj --from {name}"),
            format!("deform {name} --handles h.json -o o.obj"),
            format!("deform bar.obj --handles {name} -o o.obj"),
            format!("deform bar.obj --handles h.sel --def {name} -o o.obj"),
            format!("sphere ball.obj -o o.obj --landmarks {name}"),
            format!("morph ball.obj ball.obj -t 0.5 -o o.obj --landmarks {name}"),
        ];
        for line in lines {
            sandbox.refused(&line, &["a pipe or a device, not a regular file"]);
            assert!(!sandbox.path("o.obj").exists(), "{line}");
        }
    }
}

#[cfg(unix)]
#[test]
fn the_buffer_of_a_gltf_must_not_be_a_pipe() {
    let sandbox = with_external_buffer();
    std::fs::remove_file(sandbox.path("scene.bin")).expect("the buffer goes");
    let made = std::process::Command::new("mkfifo")
        .arg(sandbox.path("scene.bin"))
        .status();
    assert!(made.expect("mkfifo runs").success());
    sandbox.refused("info scene.gltf", &["scene.bin", "not a regular file"]);
}

#[cfg(unix)]
#[test]
fn reports_go_to_files_and_to_the_streams_by_name() {
    let sandbox = with_inputs();
    let smooth = "smooth bar.obj -o o.obj --iterations 1 --report";
    let outcome = sandbox.cotan_ok(&format!("{smooth} /dev/stdout"));
    let report: serde_json::Value = serde_json::from_str(&outcome.stdout).expect("JSON");
    assert!(report["vertices"].is_u64());
    sandbox.cotan_ok(&format!("{smooth} /dev/null --picture /dev/null"));
    std::os::unix::fs::symlink("/dev/null", sandbox.path("device")).expect("a link");
    let made = std::process::Command::new("mkfifo")
        .arg(sandbox.path("pipe"))
        .status();
    assert!(made.expect("mkfifo runs").success());
    std::fs::remove_file(sandbox.path("o.obj")).expect("the output goes");
    for name in [
        "device",
        "pipe",
        "sub",
        "new/",
        "no/new",
        "h.json/new",
        &"n".repeat(300),
    ] {
        sandbox.refused(&format!("{smooth} {name}"), &["error: "]);
        assert!(!sandbox.path("o.obj").exists(), "{name}");
    }
}

#[cfg(unix)]
#[test]
fn a_private_mesh_stays_private() {
    use std::os::unix::fs::PermissionsExt;
    let sandbox = with_inputs();
    sandbox.write("private.obj", "old");
    let mode = |mode| std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(sandbox.path("private.obj"), mode(0o600)).expect("rights");
    sandbox.cotan_ok("convert bar.obj private.obj");
    let metadata = std::fs::metadata(sandbox.path("private.obj")).expect("the file");
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    // A new file has default permissions.
    sandbox.cotan_ok("convert bar.obj new.obj");
    sandbox.write("usual", "");
    let [new, usual] = ["new.obj", "usual"].map(|name| {
        let metadata = std::fs::metadata(sandbox.path(name)).expect("the file");
        metadata.permissions().mode() & 0o777
    });
    assert_eq!(new, usual);
}
