//! Defects of real and broken files that developers have in a folder next to the workspace,
//! compared with the tables there; the folder need not exist.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::Path;

use cotan_io::{
    Defect, DefectKind, Folder, Format, Inspection, IoError, Limits, Repair, Weld, load_with,
    read_with,
};
use cotan_testing::{SHARED, shared};
use serde_json::Value;

fn table(name: &str) -> Option<Value> {
    let text = std::fs::read_to_string(shared(name)?).unwrap();
    Some(serde_json::from_str(&text).unwrap())
}

/// Returns `None`, with a message, for an unsupported format.
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

/// The quantities named in the tables, with their counts here.
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
        let path = Path::new(SHARED).join("meshes").join(name);
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
            assert_eq!(count, expected, "{name}: {what}");
        }
        let number = |what: &str| fact[what].as_u64().unwrap() as usize;
        let loops = found.num_boundaries;
        assert_eq!(loops, number("bloops"), "{name}: boundary loops");
        // Two holes of the ogre touch at a vertex with several fans: one boundary in the table.
        let touching = usize::from(name == "ogre.obj");
        assert_eq!(found.num_holes(), loops + touching, "{name}: holes");
        let doubled = found.count(DefectKind::DuplicateVertex);
        assert_eq!(doubled, number("dupV"), "{name}: duplicate vertices");
    }
}

#[test]
fn broken_files_have_the_defects_of_the_table() {
    let Some(files) = table("malformed/expect.json") else {
        return;
    };
    for file in files.as_array().unwrap() {
        let name = file["file"].as_str().unwrap();
        let path = Path::new(SHARED).join("malformed").join(name);
        // An empty list carries no information.
        let is_described = !file["defects"].as_object().unwrap().is_empty();
        if !is_described || Format::from_path(&path).is_none() {
            continue;
        }
        let Some(found) = inspect(&path) else {
            continue;
        };
        for (what, count) in counts(&found) {
            let of_triangles = file["defects"][what].as_u64().unwrap_or(0) as usize;
            // The table counts on polygons cut into fans, we count on polygons. The table
            // compares the vertices of faces, we compare outlines. For triangles this is
            // equivalent, except for two closed ones back to back, which are not duplicates here.
            let expected = match (name, what) {
                // The quad has the triangles of two other faces; as a polygon, it repeats
                // neither.
                ("obj_mixed_formats.obj", "dupF") => 1,
                // One polygon with hundreds of repeated corners.
                ("obj_backslash_longline.obj", "nmE") => 4,
                ("obj_backslash_longline.obj", "dupF") => 0,
                ("obj_backslash_longline.obj", "zero_area") => 1,
                // Faces that pass twice through a vertex are listed only as such, not also as
                // duplicates and faces without area.
                ("stl_spider_degenerate.stl", "dupF" | "zero_area") => 0,
                ("stl_zero_area_facet.stl", "zero_area") => 1,
                _ => of_triangles,
            };
            assert_eq!(count, expected, "{name}: {what}");
        }
    }
}

#[test]
fn broken_files_are_repaired_written_and_read_again() {
    let Some(files) = table("malformed/expect.json") else {
        return;
    };
    for file in files.as_array().unwrap() {
        let name = file["file"].as_str().unwrap();
        let path = Path::new(SHARED).join("malformed").join(name);
        if !file["expect"].as_str().unwrap().starts_with("LOAD") {
            continue;
        }
        let Ok(document) = load_with(&path, &Limits::default(), &Folder::of(&path)) else {
            continue;
        };
        let repaired = Repair::all()
            .apply(&document)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let document = repaired.document;
        if document.faces().is_empty() {
            eprintln!("{name}: no face is left");
            continue;
        }
        let surface = document.surface().unwrap_or_else(|e| panic!("{name}: {e}"));
        let format = document.format().unwrap();
        let bytes = document
            .write(format)
            .unwrap_or_else(|e| panic!("{name}: {e}"));
        let again = read_with(bytes, Some(format), &Limits::default(), &Folder::of(&path));
        let again = again.unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(again.faces().len(), document.faces().len(), "{name}");
        eprintln!("{name}: {} changes", repaired.changes.len());
        // Vertices separated at one position meet again in formats that store only positions.
        if matches!(format, Format::Obj | Format::Ply | Format::Off) {
            assert_eq!(again.faces(), document.faces(), "{name}");
            assert_eq!(again.positions(), document.positions(), "{name}");
            let built = again.surface().unwrap_or_else(|e| panic!("{name}: {e}"));
            assert_eq!(
                built.mesh().num_faces(),
                surface.mesh().num_faces(),
                "{name}"
            );
        }
    }
}
