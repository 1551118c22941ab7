use super::*;

fn refused(path: &Path) -> (OpenError, String) {
    let error = open(path).unwrap_err();
    let text = error.to_string();
    let name = path.file_name().unwrap().to_str().unwrap();
    assert!(text.contains(name), "{text}");
    assert!(!text.contains('\n'), "{text}");
    (error, text)
}

struct Sandbox(tempfile::TempDir);

impl Sandbox {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn write(&self, name: &str, contents: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::write(&path, contents).unwrap();
        path
    }
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const AGAINST: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\nf 2 3 4\n";
const BOW_TIE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv -1 0 0\nv 0 -1 0\nf 1 2 3\nf 1 4 5\n";
const THREE_AT_AN_EDGE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 -1 0\n\
                                f 1 2 3\nf 2 1 4\nf 1 2 5\n";

#[test]
fn a_sound_mesh_is_opened_as_it_is() {
    let sandbox = Sandbox::new();
    let path = sandbox.write("a.obj", TRIANGLE);
    for opened in [open(&path).unwrap(), open_repaired(&path).unwrap()] {
        assert_eq!(opened.processing.mesh().num_vertices(), 3);
        assert_eq!(opened.fingerprint, Fingerprint::of(&path).unwrap());
        assert!(opened.warnings.is_empty() && opened.changes.is_empty());
        assert!(opened.file_vertices.is_none());
    }
}

#[test]
fn a_defect_is_named_with_the_repair_that_helps() {
    let sandbox = Sandbox::new();
    let spike = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 1\nf 1 2 3\n";
    let path = sandbox.write("spike.obj", spike);
    let (error, text) = refused(&path);
    assert!(error.is_repairable(), "{text}");
    assert!(
        text.contains("face 0") && text.contains("--drop-degenerate"),
        "{text}"
    );
    assert!(text.contains("open it repaired"), "{text}");
    let opened = open_repaired(&path).unwrap();
    assert!(!opened.changes.is_empty() && opened.before_repair.is_some());
    assert_eq!(std::fs::read_to_string(&path).unwrap(), spike);
}

#[test]
fn faces_that_are_no_manifold_are_opened_in_pieces_or_repaired() {
    let sandbox = Sandbox::new();
    for (name, contents, defect, [rows, vertices]) in [
        ("turned.obj", AGAINST, "faces 0 and 1", [4, 4]),
        ("bow.obj", BOW_TIE, "vertex 0", [5, 6]),
        ("three.obj", THREE_AT_AN_EDGE, "3 faces", [5, 9]),
    ] {
        let path = sandbox.write(name, contents);
        let opened = open(&path).unwrap();
        let mesh = opened.processing.mesh();
        assert_eq!([mesh.num_rows(), mesh.num_vertices()], [rows, vertices]);
        assert_eq!(mesh.components().count(), 1);
        let note = opened.warnings.join("\n");
        assert!(note.contains(defect), "{note}");
        assert!(opened.changes.is_empty() && opened.before_repair.is_none());
        open_repaired(&path).unwrap();
        assert_eq!(std::fs::read_to_string(&path).unwrap(), contents);
    }
    let bow_tie = open_repaired(&sandbox.write("bow.obj", BOW_TIE)).unwrap();
    assert_eq!(bow_tie.processing.mesh().components().count(), 2);
    let file_vertices = bow_tie.file_vertices.unwrap();
    assert_eq!(file_vertices.num_vertices(), 5);
    assert_eq!(file_vertices.in_document(0).collect::<Vec<_>>(), [0, 5]);
    assert!(bow_tie.changes[0].to_string().contains("split vertex 0"));
}

#[test]
fn what_is_no_mesh_file_is_refused() {
    let sandbox = Sandbox::new();
    let (_, text) = refused(&sandbox.0.path().join("none.obj"));
    assert!(text.contains("cannot read"), "{text}");
    let folder = sandbox.0.path().join("folder.obj");
    std::fs::create_dir(&folder).unwrap();
    assert!(matches!(refused(&folder).0, OpenError::NotAFile { .. }));
    let (_, text) = refused(&sandbox.write("notes.txt", "hello"));
    assert!(text.contains(".obj, .ply"), "{text}");
    refused(&sandbox.write("empty.obj", ""));
    refused(&sandbox.write("points.obj", "v 0 0 0\n"));
    // The size in a forged header is not allocated.
    refused(&sandbox.write(
        "huge.ply",
        "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n\
         property float y\nproperty float z\nend_header\n",
    ));
    #[cfg(unix)]
    if Path::new("/dev/zero").exists() {
        let (error, text) = refused(Path::new("/dev/zero"));
        assert!(matches!(error, OpenError::NotAFile { .. }), "{text}");
    }
}

#[test]
fn a_file_beyond_the_limits_is_refused_unread() {
    let sandbox = Sandbox::new();
    let path = sandbox.write("sparse.stl", "solid");
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    if file.set_len(3 << 30).is_err() {
        cotan_testing::skip("no room for a sparse file");
        return;
    }
    let (_, text) = refused(&path);
    assert!(text.contains("bytes"), "{text}");
}

#[test]
fn nothing_outside_of_the_folder_is_opened() {
    let sandbox = Sandbox::new();
    let folder = sandbox.0.path().join("a/b");
    std::fs::create_dir_all(&folder).unwrap();
    let gltf = |uri: &str| {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"uri": "{uri}", "byteLength": 36}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
              "min": [0, 0, 0], "max": [1, 1, 0]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
            "nodes": [{{"mesh": 0}}], "scenes": [{{"nodes": [0]}}], "scene": 0}}"#
        )
    };
    let numbers = [0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let buffer: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    sandbox.write("outside.bin", &buffer);
    let path = sandbox.write("a/b/out.gltf", gltf("../../outside.bin"));
    let (_, text) = refused(&path);
    assert!(
        text.contains("../../outside.bin") && text.contains("outside the folder"),
        "{text}"
    );
    sandbox.write("a/b/inside.bin", &buffer);
    open(&sandbox.write("a/b/in.gltf", gltf("inside.bin"))).unwrap();
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("../../outside.bin", folder.join("link.bin")).unwrap();
        refused(&sandbox.write("a/b/link.gltf", gltf("link.bin")));
    }
}

/// Broken and odd files in an optional folder next to the workspace.
#[test]
fn every_broken_file_ends_in_a_mesh_or_one_sentence() {
    let mut folders: Vec<PathBuf> = cotan_testing::shared("malformed").into_iter().collect();
    let mut count = 0;
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            for result in [open(&path), open_repaired(&path)] {
                if let Err(error) = result {
                    let text = error.to_string();
                    let name = path.file_name().unwrap().to_string_lossy().into_owned();
                    assert!(text.contains(&name) && text.lines().count() == 1, "{text}");
                }
            }
            count += 1;
        }
    }
    println!("{count} files");
}
