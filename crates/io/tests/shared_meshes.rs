//! Real and broken files that developers have in a folder beside the workspace; it need not exist.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};
use std::time::Instant;

use cotan_io::{Document, Format, IoError, load};
use serde_json::Value;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared");

/// The files of our formats in a subfolder, or `None` (said aloud) if it does not exist.
fn files(subfolder: &str) -> Option<Vec<PathBuf>> {
    let folder = Path::new(FOLDER).join(subfolder);
    let Ok(entries) = std::fs::read_dir(&folder) else {
        eprintln!("skipped: there is no folder {}", folder.display());
        return None;
    };
    let mut files: Vec<_> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| Format::from_path(path).is_some())
        .collect();
    files.sort();
    Some(files)
}

fn table(name: &str) -> Value {
    let text = std::fs::read_to_string(Path::new(FOLDER).join(name)).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

/// Vertices and triangles, as the tables count them.
fn counts(document: &Document) -> (u64, u64) {
    (
        document.positions().len() as u64,
        document.faces().num_triangles() as u64,
    )
}

#[test]
fn real_meshes_are_read_and_written_back_byte_by_byte() {
    let Some(paths) = files("meshes") else { return };
    let facts = table("meshes/facts.json");
    for path in paths {
        let clock = Instant::now();
        let document = load(&path).unwrap();
        eprintln!(
            "{}: {:.1} ms",
            name(&path),
            clock.elapsed().as_secs_f64() * 1e3
        );
        let fact = &facts[name(&path)];
        let expected = (fact["V"].as_u64().unwrap(), fact["F"].as_u64().unwrap());
        assert_eq!(counts(&document), expected, "{}", name(&path));

        let written = document.write(document.format().unwrap()).unwrap();
        assert!(
            written == std::fs::read(&path).unwrap(),
            "{} was changed",
            name(&path)
        );

        let processing = document.surface();
        if fact["manifold"].as_bool().unwrap() {
            let processing = processing.unwrap();
            let used = expected.0 - fact["unref"].as_u64().unwrap();
            assert_eq!(
                processing.mesh().num_vertices() as u64,
                used,
                "{}",
                name(&path)
            );
            assert_eq!(
                processing.mesh().num_faces() as u64,
                expected.1,
                "{}",
                name(&path)
            );
        } else {
            let error = processing.unwrap_err();
            assert!(matches!(error, IoError::NotManifold(_)), "{error}");
        }
    }
}

#[test]
fn real_meshes_convert_to_every_format_without_loss() {
    let Some(paths) = files("meshes") else { return };
    for path in paths {
        let document = load(&path).unwrap();
        for format in [Format::Obj, Format::Ply, Format::Off] {
            let bytes = document.write(format).unwrap();
            let again = cotan_io::read(bytes, Some(format), &Default::default()).unwrap();
            assert!(
                again.positions() == document.positions(),
                "{} as {format}",
                name(&path)
            );
            assert!(
                again.faces() == document.faces(),
                "{} as {format}",
                name(&path)
            );
        }
    }
}
