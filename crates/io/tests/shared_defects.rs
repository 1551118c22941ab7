//! Defects of the real and broken files that developers have in a folder beside the workspace,
//! against the tables there; the folder need not exist.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::Path;

use cotan_io::{Defect, DefectKind, Folder, Format, Inspection, IoError, Limits, Weld, load_with};
use serde_json::Value;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared");

fn table(name: &str) -> Option<Value> {
    let path = Path::new(FOLDER).join(name);
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: there is no file {}", path.display());
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

/// `None` for a format that is not read, said aloud.
fn inspect(path: &Path) -> Option<Inspection> {
    match load_with(path, &Limits::default(), &Folder::of(path)) {
        Ok(document) => Some(document.inspect(Weld::AsFormat).unwrap()),
        Err(IoError::InFile { source, .. }) if matches!(*source, IoError::UnknownFormat) => {
            eprintln!(
                "skipped: {} is of a format that is not read",
                path.display()
            );
            None
        }
        Err(error) => panic!("{error}"),
    }
}

/// What the tables name, and the count of it here.
fn counts(inspection: &Inspection) -> [(&'static str, usize); 9] {
    let count = |kind| inspection.count(kind);
    let one_sided = |defect: &&Defect| defect.kind() == DefectKind::NotOrientable;
    [
        ("bE", inspection.num_boundary_edges),
        ("nmE", count(DefectKind::NonManifoldEdge)),
        ("nmV", count(DefectKind::SeveralFans)),
        ("incons_E", count(DefectKind::InconsistentOrientation)),
        ("comp_face", inspection.components.len()),
        ("dupF", count(DefectKind::DuplicateFace)),
        ("unref", count(DefectKind::UnreferencedVertex)),
        ("zero_area", count(DefectKind::ZeroArea)),
        (
            "nonorientable_comp",
            inspection.defects.iter().filter(one_sided).count(),
        ),
    ]
}

#[test]
fn real_meshes_have_the_defects_of_the_table() {
    let Some(facts) = table("meshes/facts.json") else {
        return;
    };
    for (name, fact) in facts.as_object().unwrap() {
        let path = Path::new(FOLDER).join("meshes").join(name);
        if !path.is_file() {
            continue;
        }
        let clock = std::time::Instant::now();
        let Some(found) = inspect(&path) else {
            continue;
        };
        eprintln!("{name}: {:.0} ms", clock.elapsed().as_secs_f64() * 1e3);
        for (what, count) in counts(&found) {
            let expected = fact[what].as_u64().unwrap() as usize;
            if count != expected {
                eprintln!("{name}: {what} {count} {expected}");
            }
        }
        let (loops, doubled) = (found.num_holes(), found.count(DefectKind::DuplicateVertex));
        eprintln!(
            "{name}: loops {loops} {} dup {doubled} {}",
            fact["bloops"], fact["dupV"]
        );
    }
}

#[test]
fn broken_files_have_the_defects_of_the_table() {
    let Some(files) = table("malformed/expect.json") else {
        return;
    };
    for file in files.as_array().unwrap() {
        let name = file["file"].as_str().unwrap();
        let path = Path::new(FOLDER).join("malformed").join(name);
        if !file["expect"].as_str().unwrap().starts_with("LOAD")
            || Format::from_path(&path).is_none()
        {
            continue;
        }
        let Some(found) = inspect(&path) else {
            continue;
        };
        for (what, count) in counts(&found) {
            let expected = file["defects"][what].as_u64().unwrap_or(0) as usize;
            if count != expected {
                eprintln!("{name}: {what} {count} {expected}");
            }
        }
    }
}
