//! Saving of the files that a glTF refers to: next to the new file or inside it, and never over
//! another file.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::fs;
use std::path::{Path, PathBuf};

use cotan_io::{
    Companions, Document, Folder, Format, IoError, Limits, Repair, load, load_with, save, save_with,
};
use nalgebra::Point3;
use serde_json::{Value, json};

/// Two folders: `a` contains a glTF with its files.
struct Folders(tempfile::TempDir);

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nno pixels";
const CORNERS: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
const FACES: [u16; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

impl Folders {
    fn new() -> Self {
        let folders = Self(tempfile::tempdir().unwrap());
        for folder in ["a/textures", "b"] {
            fs::create_dir_all(folders.path(folder)).unwrap();
        }
        let bytes: Vec<u8> = CORNERS.iter().flat_map(|x| x.to_le_bytes()).collect();
        folders.write("a/points.bin", &bytes);
        let bytes: Vec<u8> = FACES.iter().flat_map(|x| x.to_le_bytes()).collect();
        folders.write("a/faces.bin", &bytes);
        folders.write("a/textures/a b.png", PNG);
        folders.write("a/m.gltf", tetrahedron().to_string().as_bytes());
        folders
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: &[u8]) {
        fs::write(self.path(name), bytes).unwrap();
    }

    fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    fn load(&self, name: &str) -> Document {
        let path = self.path(name);
        load_with(&path, &Limits::default(), &Folder::of(&path)).unwrap()
    }

    /// All files below a folder, sorted.
    fn files(&self, folder: &str) -> Vec<String> {
        fn walk(root: &Path, folder: &Path, files: &mut Vec<String>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                let name = path.strip_prefix(root).unwrap().display().to_string();
                if path.is_dir() {
                    files.push(format!("{name}/"));
                    walk(root, &path, files);
                } else {
                    files.push(name);
                }
            }
        }
        let (root, mut files) = (self.path(folder), Vec::new());
        walk(&root, &root, &mut files);
        files.sort();
        files
    }
}

fn tetrahedron() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 1, "byteLength": 24},
        ],
        "buffers": [
            {"uri": "points.bin", "byteLength": 48},
            {"uri": "./faces.bin", "byteLength": 24},
        ],
        "images": [{"uri": "textures/a%20b.png", "name": "wood"}, {"uri": "data:,x"}],
    })
}

/// The tetrahedron with its images replaced.
fn with_images(images: &Value) -> Value {
    let mut root = tetrahedron();
    root["images"] = images.clone();
    root
}

fn same_mesh(a: &Document, b: &Document) {
    assert_eq!(a.positions(), b.positions());
    assert_eq!(a.faces(), b.faces());
}

#[test]
fn a_file_saved_elsewhere_has_its_files_with_it() {
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    let saved = save(&document, folders.path("b/m.gltf")).unwrap();
    let copied = ["b/points.bin", "b/faces.bin", "b/textures/a b.png"];
    assert_eq!(saved.copied, copied.map(|name| folders.path(name)));
    assert!(saved.left.is_empty(), "{saved:?}");
    assert_eq!(
        folders.files("b"),
        [
            "faces.bin",
            "m.gltf",
            "points.bin",
            "textures/",
            "textures/a b.png"
        ]
    );
    for file in ["points.bin", "faces.bin", "textures/a b.png", "m.gltf"] {
        let [a, b] = ["a", "b"].map(|folder| folders.read(&format!("{folder}/{file}")));
        assert_eq!(a, b, "{file}");
    }
    same_mesh(&folders.load("b/m.gltf"), &document);
    // The second time the same bytes exist already, and nothing is copied.
    let saved = save(&document, folders.path("b/m.gltf")).unwrap();
    assert!(saved.copied.is_empty(), "{saved:?}");
}

#[test]
fn an_edited_or_repaired_file_has_its_files_with_it() {
    let folders = Folders::new();
    let mut document = folders.load("a/m.gltf");
    document
        .set_position(3, Point3::new(0.0, 0.0, 2.0))
        .unwrap();
    save(&document, folders.path("b/edited.gltf")).unwrap();
    same_mesh(&folders.load("b/edited.gltf"), &document);
    // The changed data is in the file; the rest is next to it.
    assert_eq!(
        folders.files("b"),
        ["edited.gltf", "faces.bin", "textures/", "textures/a b.png"]
    );
    let repaired = Repair::default().apply(&document).unwrap().document;
    save(&repaired, folders.path("b/repaired.gltf")).unwrap();
    same_mesh(&folders.load("b/repaired.gltf"), &document);
}

#[test]
fn another_file_is_never_replaced_and_nothing_is_written() {
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    for other in ["points.bin", "faces.bin", "textures"] {
        // A file with the same length as the right one, or a file instead of a folder.
        folders.write(&format!("b/{other}"), &[0; 24]);
        folders.write("b/m.gltf", b"old");
        let error = save(&document, folders.path("b/m.gltf")).unwrap_err();
        let IoError::InFile { source, .. } = &error else {
            panic!("{error}");
        };
        assert!(matches!(**source, IoError::Companion { .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains(other) && text.contains("b/m.gltf"), "{text}");
        assert_eq!(folders.read(&format!("b/{other}")), [0; 24]);
        assert_eq!(folders.read("b/m.gltf"), b"old");
        let mut left = ["m.gltf", other];
        left.sort_unstable();
        assert_eq!(folders.files("b"), left);
        fs::remove_file(folders.path(&format!("b/{other}"))).unwrap();
    }
}

#[test]
fn at_home_nothing_is_copied_and_a_changed_buffer_is_noticed() {
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    let before = folders.files("a");
    let saved = save(&document, folders.path("a/m.gltf")).unwrap();
    assert_eq!(saved, cotan_io::Saved::default());
    assert_eq!(folders.files("a"), before);
    // Another program writes a buffer: the new file would be another mesh.
    folders.write("a/faces.bin", &[1; 24]);
    let error = save(&document, folders.path("a/n.gltf")).unwrap_err();
    assert!(error.to_string().contains("faces.bin"), "{error}");
    assert_eq!(folders.files("a"), before);
}

#[test]
fn references_out_of_the_folder_are_left_and_named() {
    let folders = Folders::new();
    folders.write("secret.png", PNG);
    let images = json!([
        {"uri": "../secret.png"},
        {"uri": "missing.png"},
        {"uri": "https://example.org/a.png"},
        {"uri": "/etc/hostname"},
        {"uri": "%FF"},
    ]);
    folders.write("a/m.gltf", with_images(&images).to_string().as_bytes());
    let document = folders.load("a/m.gltf");
    for companions in [Companions::Separate, Companions::Embedded] {
        let saved = save_with(&document, folders.path("b/m.gltf"), companions).unwrap();
        assert_eq!(saved.left.len(), 4, "{saved:?}");
        for name in ["../secret.png", "missing.png", "/etc/hostname", "%FF"] {
            assert!(saved.left.iter().any(|l| l.contains(name)), "{saved:?}");
        }
        let json: Value = serde_json::from_slice(&folders.read("b/m.gltf")).unwrap();
        assert_eq!(json["images"], images);
    }
    assert_eq!(folders.files("b"), ["faces.bin", "m.gltf", "points.bin"]);
    // In the folder of the original they resolve as before.
    let saved = save(&document, folders.path("a/n.gltf")).unwrap();
    assert_eq!(saved, cotan_io::Saved::default());
}

#[test]
fn without_a_resolver_a_file_is_not_torn_from_its_images() {
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    save_with(&document, folders.path("a/one.glb"), Companions::Separate).unwrap();
    let document = load(folders.path("a/one.glb")).unwrap();
    let error = save(&document, folders.path("b/one.glb")).unwrap_err();
    let text = error.to_string();
    assert!(
        text.contains("a b.png") && text.contains("resolver"),
        "{text}"
    );
    assert!(folders.files("b").is_empty());
    // In the same folder they stay external.
    save(&document, folders.path("a/two.glb")).unwrap();
    assert_eq!(folders.read("a/one.glb"), folders.read("a/two.glb"));
}

#[test]
fn embedded_files_are_in_the_file() {
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    for name in ["b/m.gltf", "b/m.glb", "b/m.gltf.gz"] {
        let saved = save_with(&document, folders.path(name), Companions::Embedded).unwrap();
        assert_eq!(saved, cotan_io::Saved::default(), "{name}");
        let own = load(folders.path(name)).unwrap();
        same_mesh(&own, &document);
        // Nothing external is needed any more, wherever the file is moved.
        let written = own.write_with(Format::Gltf, &cotan_io::WriteOptions::default());
        assert!(written.unwrap().companions.is_empty());
    }
    assert_eq!(folders.files("b"), ["m.glb", "m.gltf", "m.gltf.gz"]);
    let bytes = folders.read("b/m.glb");
    let found = |image: &gltf::Image<'_>| match image.source() {
        gltf::image::Source::View { view, mime_type } => {
            Some((view.offset(), view.length(), mime_type.to_owned()))
        }
        gltf::image::Source::Uri { .. } => None,
    };
    let glb = gltf::Gltf::from_slice_without_validation(&bytes).unwrap();
    let image = glb.images().next().unwrap();
    let (offset, length, media_type) = found(&image).unwrap();
    assert_eq!(&glb.blob.as_ref().unwrap()[offset..offset + length], PNG);
    assert_eq!(
        (media_type.as_str(), image.name()),
        ("image/png", Some("wood"))
    );
    let json: Value = serde_json::from_slice(&folders.read("b/m.gltf")).unwrap();
    let uri = json["images"][0]["uri"].as_str().unwrap();
    assert!(
        uri.starts_with("data:image/png;base64,iVBORw0KGgp"),
        "{uri}"
    );
    assert_eq!(json["images"][0]["name"], "wood");
}

#[test]
fn images_get_a_chunk_where_a_glb_has_none() {
    let folders = Folders::new();
    let mut root = tetrahedron();
    // Without bytes: four vertices at the origin, which is odd but valid.
    root["accessors"] = json!([
        {"componentType": 5126, "count": 4, "type": "VEC3"},
        {"componentType": 5123, "count": 12, "type": "SCALAR"},
    ]);
    for key in ["bufferViews", "buffers"] {
        root.as_object_mut().unwrap().remove(key);
    }
    folders.write("a/m.gltf", root.to_string().as_bytes());
    let document = folders.load("a/m.gltf");
    save_with(&document, folders.path("b/m.glb"), Companions::Embedded).unwrap();
    assert_eq!(folders.files("b"), ["m.glb"]);
    let glb = gltf::Gltf::from_slice_without_validation(&folders.read("b/m.glb")).unwrap();
    assert_eq!(glb.blob.as_ref().unwrap().get(..PNG.len()), Some(PNG));
    load(folders.path("b/m.glb")).unwrap();
}

#[test]
fn a_file_does_not_take_the_name_of_what_it_refers_to() {
    let folders = Folders::new();
    folders.write("a/c.gltf", PNG);
    let images = json!([{"uri": "c.gltf"}]);
    folders.write("a/m.gltf", with_images(&images).to_string().as_bytes());
    let document = folders.load("a/m.gltf");
    let error = save(&document, folders.path("b/c.gltf")).unwrap_err();
    assert!(
        error.to_string().contains("the mesh file itself"),
        "{error}"
    );
    assert!(folders.files("b").is_empty());
    save(&document, folders.path("b/d.gltf")).unwrap();
    assert_eq!(folders.read("b/c.gltf"), PNG);
}

#[cfg(unix)]
#[test]
fn links_do_not_lead_a_copy_out_of_the_folder() {
    use std::os::unix::fs::symlink;
    let folders = Folders::new();
    let document = folders.load("a/m.gltf");
    fs::create_dir(folders.path("outside")).unwrap();
    symlink("../outside", folders.path("b/textures")).unwrap();
    let error = save(&document, folders.path("b/m.gltf")).unwrap_err();
    assert!(
        error.to_string().contains("points outside the folder"),
        "{error}"
    );
    fs::remove_file(folders.path("b/textures")).unwrap();
    // A dangling link is not followed either.
    symlink("../outside/new.bin", folders.path("b/points.bin")).unwrap();
    let error = save(&document, folders.path("b/m.gltf")).unwrap_err();
    assert!(error.to_string().contains("points.bin"), "{error}");
    assert!(folders.files("outside").is_empty());
    // A link to the same bytes may stay.
    fs::remove_file(folders.path("b/points.bin")).unwrap();
    symlink("../a/points.bin", folders.path("b/points.bin")).unwrap();
    let saved = save(&document, folders.path("b/m.gltf")).unwrap();
    assert_eq!(saved.copied.len(), 2, "{saved:?}");
    // The file itself may be a link: its companions are placed next to the link's target.
    symlink("../outside/real.gltf", folders.path("b/link.gltf")).unwrap();
    folders.write("outside/real.gltf", b"old");
    save(&document, folders.path("b/link.gltf")).unwrap();
    same_mesh(&folders.load("outside/real.gltf"), &document);
}
