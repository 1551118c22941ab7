//! Tests on real files that developers have in a folder next to the workspace; it need not exist.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::{Path, PathBuf};

use cotan_io::{DefectKind, Document, Format, IoError, Limits, Weld, load, read};
use cotan_testing::shared;
use nalgebra::Point3;
use serde_json::Value;

/// The models with their known facts, or nothing (with a message) without the folder.
fn models() -> Vec<(PathBuf, Value)> {
    let Some(folder) = shared("meshes") else {
        return Vec::new();
    };
    let text = std::fs::read_to_string(folder.join("facts.json")).unwrap();
    let facts: Value = serde_json::from_str(&text).unwrap();
    let mut models: Vec<_> = [folder.join("bend_benchmark"), folder]
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flatten()
        .map(|entry| entry.unwrap().path())
        .filter(|path| Format::from_path(path).is_some())
        .map(|path| {
            let fact = facts[name(&path)].clone();
            (path, fact)
        })
        .collect();
    models.sort_by(|a, b| a.0.cmp(&b.0));
    models
}

fn name(path: &Path) -> &str {
    path.file_name().unwrap().to_str().unwrap()
}

#[test]
fn real_meshes_are_what_is_known_of_them() {
    for (path, fact) in models() {
        let document = load(&path).unwrap();
        let name = name(&path);
        let known = |key: &str| fact[key].as_u64().unwrap() as usize;
        assert_eq!(document.faces().num_triangles(), known("F"), "{name}");
        let inspection = document.inspect(Weld::AsFormat).unwrap();
        assert_eq!(inspection.components.len(), known("comp_face"), "{name}");
        assert_eq!(
            inspection.count(DefectKind::UnreferencedVertex),
            known("unref"),
            "{name}"
        );
        if !fact["manifold"].as_bool().unwrap() {
            assert_eq!(document.positions().len(), known("V"), "{name}");
            let error = document.surface().unwrap_err();
            assert!(matches!(error, IoError::NotManifold { .. }), "{error}");
            continue;
        }
        assert_eq!(inspection.num_holes(), known("bloops"), "{name}");
        let surface = document.surface().unwrap();
        let mesh = surface.mesh();
        assert_eq!(mesh.num_vertices() + known("unref"), known("V"), "{name}");
        assert_eq!(mesh.num_faces(), known("F"), "{name}");
        assert_eq!(mesh.components().count(), known("comp_face"), "{name}");
        assert_eq!(mesh.boundary_loops().len(), known("bloops"), "{name}");
        let genus: usize = mesh.topology().iter().map(|part| part.genus()).sum();
        assert_eq!(genus, known("genus"), "{name}");
        if document.format() != Some(Format::Glb) {
            assert_eq!(document.positions().len(), known("V"), "{name}");
        }
    }
}

#[test]
fn real_meshes_are_written_back_byte_by_byte() {
    for (path, _) in models() {
        let document = load(&path).unwrap();
        let format = document.format().unwrap();
        let bytes = std::fs::read(&path).unwrap();
        assert!(document.write(format).unwrap() == bytes, "{}", name(&path));
        // The same holds for a vertex that is moved there and back, and for a file that is read
        // again.
        let mut moved = document.clone();
        let first = moved.positions()[0];
        moved
            .set_position(0, first * 2.0 + nalgebra::Vector3::x())
            .unwrap();
        let written = moved.write(format).unwrap();
        assert!(written != bytes, "{}", name(&path));
        moved.set_position(0, first).unwrap();
        assert!(moved.write(format).unwrap() == bytes, "{}", name(&path));
        let again = read(written, Some(format), &Limits::default()).unwrap();
        assert!(
            again.positions()[1..] == document.positions()[1..],
            "{}",
            name(&path)
        );
        assert_eq!(again.faces(), document.faces(), "{}", name(&path));
        assert_eq!(
            without_normals(&again),
            without_normals(&document),
            "{}",
            name(&path)
        );
    }
}

fn without_normals(document: &Document) -> cotan_io::Attributes {
    let mut attributes = document.attributes().unwrap().into_owned();
    attributes.vertices.retain(|p| p.name != cotan_io::NORMAL);
    attributes.corners.retain(|p| p.name != cotan_io::NORMAL);
    attributes.faces.retain(|p| p.name != cotan_io::NORMAL);
    attributes
}

#[test]
fn real_meshes_convert_to_every_format_with_positions_and_topology() {
    for (path, fact) in models() {
        let document = load(&path).unwrap();
        for format in Format::ALL {
            let what = format!("{} as {format}", name(&path));
            let bytes = document.write(format).unwrap();
            let again = read(bytes, Some(format), &Limits::default()).unwrap();
            // STL and glTF store 32 bits, and glTF sorts faces by material.
            let is_single = matches!(format, Format::Stl | Format::Gltf | Format::Glb);
            let corners = |document: &Document| -> Vec<Point3<f64>> {
                let corners = document.faces().corners().iter();
                corners.map(|&v| document.positions()[v as usize]).collect()
            };
            let (mut before, mut after) = (corners(&document), corners(&again));
            if is_single {
                for p in before.iter_mut().chain(&mut after) {
                    *p = p.map(|x| f64::from(x as f32) + 0.0);
                }
                if document.faces().num_corners() != again.faces().num_corners() {
                    before.clear();
                    after.clear();
                }
                before.sort_by(|a, b| {
                    a.coords
                        .as_slice()
                        .partial_cmp(b.coords.as_slice())
                        .unwrap()
                });
                after.sort_by(|a, b| {
                    a.coords
                        .as_slice()
                        .partial_cmp(b.coords.as_slice())
                        .unwrap()
                });
            }
            assert!(before == after, "{what}: positions");
            assert_eq!(
                again.faces().num_triangles(),
                document.faces().num_triangles(),
                "{what}"
            );
            if !fact["manifold"].as_bool().unwrap() {
                continue;
            }
            let (before, after) = (document.surface().unwrap(), again.surface().unwrap());
            let (before, after) = (before.mesh(), after.mesh());
            assert_eq!(after.num_vertices(), before.num_vertices(), "{what}");
            assert_eq!(after.num_edges(), before.num_edges(), "{what}");
            assert_eq!(
                after.components().count(),
                before.components().count(),
                "{what}"
            );
            assert_eq!(
                after.boundary_loops().len(),
                before.boundary_loops().len(),
                "{what}"
            );
        }
    }
}
