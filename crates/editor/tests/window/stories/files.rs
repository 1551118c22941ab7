//! Files that are closed with changes, changed on disk, read-only, or not meshes.

use std::path::Path;

use super::{bend, open, save, start};
use crate::harness::{Display, Start, Window, bytes, text};
use crate::models::{Place, autosaves};

#[test]
fn unsaved_changes_are_asked_about_before_the_window_closes() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let first = bytes(&place.mesh);
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    bend(&mut window, &place);
    window.ask_to_close();
    window.wait_for_dialog("unsaved");
    window.click_on("answer-2");
    let line = window.wait_for_no_dialog();
    assert_eq!(line["is_changed"], true);
    // The answer was to cancel: the window stays open and usable.
    window.key("F1");
    window.wait_for_dialog("help");
    window.key("Escape");
    window.wait_for_no_dialog();
    window.ask_to_close();
    window.wait_for_dialog("unsaved");
    window.click_on("answer-1");
    let status = window.wait_for_end();
    assert_eq!(status.code(), Some(0), "{}", window.errors());
    drop(window);
    assert_eq!(bytes(&place.mesh), first);
    assert!(autosaves(place.path()).is_empty());

    // After saving, the window closes; without changes, it closes without a question.
    let mut window = open(&mut display, &place);
    bend(&mut window, &place);
    window.ask_to_close();
    window.wait_for_dialog("unsaved");
    window.click_on("answer-0");
    assert_eq!(window.wait_for_end().code(), Some(0));
    drop(window);
    assert_ne!(bytes(&place.mesh), first);
    let mut window = open(&mut display, &place);
    window.ask_to_close();
    assert_eq!(window.wait_for_end().code(), Some(0));
}

#[test]
fn a_file_that_another_program_changed_is_replaced_only_if_that_is_wanted() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    bend(&mut window, &place);
    let mut others = bytes(&place.mesh);
    others.extend(b"# by another program\n");
    std::fs::write(&place.mesh, &others).unwrap();
    for answer in ["answer-2", "answer-0"] {
        assert_eq!(bytes(&place.mesh), others);
        window.key("ctrl+s");
        window.wait_for_dialog("changed by another program");
        window.click_on(answer);
        window.wait_for_no_dialog();
    }
    window.wait("the save", |line| line["is_changed"] == false);
    let bent = cotan_io::load(&place.mesh).unwrap();
    assert_ne!(bent.positions(), place.document.positions());
    let found = bytes(&place.mesh);
    assert!(!found.ends_with(b"# by another program\n"));
}

#[cfg(unix)]
#[test]
fn a_file_that_may_not_be_written_is_not() {
    use std::os::unix::fs::PermissionsExt;

    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let first = bytes(&place.mesh);
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    bend(&mut window, &place);
    let allow = |mode| {
        let permissions = std::fs::Permissions::from_mode(mode);
        std::fs::set_permissions(&place.mesh, permissions).unwrap();
    };
    allow(0o444);
    window.key("ctrl+s");
    let line = window.wait_for_dialog("the file is read-only");
    assert!(text(&line, "dialog").contains("creature.obj"));
    window.click_on("ok");
    let line = window.wait_for_no_dialog();
    assert_eq!(line["is_changed"], true);
    assert_eq!(bytes(&place.mesh), first);
    allow(0o644);
    save(&mut window);
    assert_ne!(bytes(&place.mesh), first);
}

/// Two tetrahedra that share their vertex 3, and a face that passes twice through a vertex.
const TOUCHING: &str = "\
v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 0 2\nv 1 0 2\nv 0 1 2
f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4
f 5 6 7\nf 5 4 6\nf 6 4 7\nf 7 4 5
f 1 2 1
";

#[test]
fn a_mesh_with_a_defect_is_named_and_opened_repaired() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("touching.obj");
    std::fs::write(&path, TOUCHING).unwrap();
    let mut display = Display::start();
    let mut window = start_on(&mut display, folder.path(), &path);
    let line = window.wait_for_dialog("touching.obj");
    assert!(text(&line, "dialog").contains("face 8"), "{line}");
    window.click_on("answer-0");
    let line = window.wait_for_mesh();
    // The shared vertex was split.
    assert_eq!(line["size"], serde_json::json!([8, 8]));
    let line = window.wait_for_dialog("vertex 3");
    assert!(!text(&line, "dialog").contains("repair it"), "{line}");
    window.click_on("ok");
    window.wait_for_no_dialog();
    assert_eq!(bytes(&path), TOUCHING.as_bytes());
}

#[test]
fn after_a_failed_open_recent_files_are_offered() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = open(&mut display, &place);
    window.ask_to_close();
    window.wait_for_end();
    drop(window);
    let mut window = start_on(&mut display, place.path(), &place.path().join("none.obj"));
    window.wait_for_dialog("none.obj");
    window.click_on("ok");
    window.wait_for_no_dialog();
    window.rect("start-open");
    window.rect("start-sample");
    window.click_on("recent-0");
    let line = window.wait_for_mesh();
    assert!(text(&line, "path").ends_with("creature.obj"), "{line}");
}

fn start_on<'d>(display: &'d mut Display, data: &Path, mesh: &Path) -> Window<'d> {
    let start = Start {
        program: crate::program(),
        data,
        arguments: vec![mesh.display().to_string()],
    };
    Window::open(display, &start)
}

/// Checks that the window reports the error with the file's name and stays usable.
///
/// Returns the peak memory.
fn refuses(display: &mut Display, path: &Path) -> Option<u64> {
    let data = tempfile::tempdir().unwrap();
    let mut window = start_on(display, data.path(), path);
    let name = path.file_name().unwrap().to_string_lossy();
    let line = window.wait_for_dialog(&name);
    assert!(line["path"].is_null(), "{line}");
    window.click_on("ok");
    window.wait_for_no_dialog();
    window.key("F1");
    window.wait_for_dialog("help");
    window.peak_memory()
}

#[test]
fn a_file_that_is_no_mesh_is_told_of_and_claims_no_memory() {
    let Some(_turn) = crate::turn() else {
        return;
    };
    let place = Place::with_creature();
    let mut display = Display::start();
    let mut window = start(&mut display, &place, &[]);
    window.wait_for_mesh();
    let usual = window.peak_memory();
    drop(window);

    let text = place.path().join("letter.obj");
    std::fs::write(&text, "Dear reader,\nthis is no mesh.\n").unwrap();
    // A header that promises four thousand million vertices.
    let huge = place.path().join("huge.ply");
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n\
                  property float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(&huge, header).unwrap();
    let mut all = vec![text, huge, place.path().join("absent.ply")];
    let odd = [
        "ply_huge_counts.ply",
        "off_huge_count.off",
        "stl_huge_count.stl",
        "glb_chunk_too_big.glb",
        "obj_html_instead.obj",
        "obj_coordinate_overflow.obj",
        "gltf_path_traversal_uri.gltf",
        "gltf_recursive_nodes.gltf",
    ];
    if let Some(folder) = cotan_testing::shared("malformed") {
        all.extend(odd.iter().map(|name| folder.join(name)));
    }
    for path in all {
        let peak = refuses(&mut display, &path);
        if let Some((peak, usual)) = peak.zip(usual) {
            let path = path.display();
            assert!(
                peak <= usual + MOST_MORE,
                "{path}: {peak} bytes, not {usual}"
            );
        }
    }
}

/// The variation in the sizes of a driver's buffers.
const MOST_MORE: u64 = 64 << 20;
