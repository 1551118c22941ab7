//! Tests on real and broken glTF files that developers have in a folder next to the workspace; it
//! need not exist.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use std::path::Path;

use cotan_io::{Document, Folder, Format, IoError, Limits, load_with, read};
use cotan_testing::{SHARED, shared};
use nalgebra::Point3;
use serde_json::Value;

fn load(path: &Path) -> Result<Document, IoError> {
    load_with(path, &Limits::default(), &Folder::of(path))
}

#[test]
fn broken_files_do_what_is_expected() {
    let Some(table) = shared("malformed/expect.json") else {
        return;
    };
    let table: Value = serde_json::from_str(&std::fs::read_to_string(&table).unwrap()).unwrap();
    // A word that each error message must contain.
    let words = |file: &str| match file {
        "gltf_index_out_of_range/IndexOutOfRange.gltf" => "refers to vertex",
        "gltf_missing_bin/BoxTextured.gltf" => ".bin",
        "gltf_recursive_nodes.gltf" => "ancestors",
        "glb_draco_compressed.glb" => "KHR_draco_mesh_compression",
        "gltf_external_http_uri.gltf" => "only files in the folder",
        "gltf_invalid_base64.gltf" => "base64",
        "gltf_index_oob_validator/index_buffer_oob.gltf" => "refers to vertex",
        "gltf_bufferview_1e300/integer-out-of-bounds.gltf" => "expected u64",
        "gltf_version_1.gltf" => "glTF 1.0",
        "glb_truncated_chunk.glb" => "cut short",
        "glb_chunk_too_big.glb" => "too few for a JSON chunk",
        "glb_infinities.glb" | "gltf_nan_position.gltf" => "not a finite number",
        "gltf_accessor_past_buffer.gltf" => "exceed",
        "gltf_path_traversal_uri.gltf" => "folder",
        "gltf_points_only/points.gltf" => "triangles",
        _ => "",
    };
    let mut count = 0;
    for row in table.as_array().unwrap() {
        let file = row["file"].as_str().unwrap();
        if !(file.ends_with(".gltf") || file.ends_with(".glb")) {
            continue;
        }
        count += 1;
        let path = Path::new(SHARED).join("malformed").join(file);
        let result = load(&path);
        let expect = row["expect"].as_str().unwrap();
        match &result {
            Ok(document) => {
                assert_ne!(expect, "ERROR", "{file} was read");
                let counts = (document.positions().len(), document.faces().num_triangles());
                for (key, found) in [("V", counts.0), ("F", counts.1)] {
                    if let Some(expected) = row[key].as_u64() {
                        assert_eq!(found as u64, expected, "{file}: {key}");
                    }
                }
                let written = document.write(document.format().unwrap()).unwrap();
                assert!(
                    written == std::fs::read(&path).unwrap(),
                    "{file} was changed"
                );
                for warning in document.warnings() {
                    eprintln!("{file}: {warning}");
                }
            }
            Err(error) => {
                assert!(!expect.starts_with("LOAD"), "{file}: {error}");
                let message = error.to_string();
                assert!(message.contains(words(file)), "{message}");
                eprintln!("{message}");
            }
        }
    }
    assert!(count > 20, "{count} files");
}

fn volume(document: &Document) -> f64 {
    let p = |v: u32| document.positions()[v as usize].coords;
    let triple = |f: &[u32]| p(f[0]).dot(&p(f[1]).cross(&p(f[2])));
    document.faces().iter().map(triple).sum::<f64>() / 6.0
}

#[test]
fn a_mirrored_node_turns_faces_round() {
    let Some(path) = shared("malformed/gltf_mirrored_node.gltf") else {
        return;
    };
    let document = load(&path).unwrap();
    assert!((volume(&document) - 1.0 / 6.0).abs() < 1e-12);
}

#[test]
fn a_box_with_split_corners_is_closed() {
    let Some(path) = shared("malformed/gltf_uv_seams_box/Box.gltf") else {
        return;
    };
    let document = load(&path).unwrap();
    let surface = document.surface().unwrap();
    assert_eq!(surface.mesh().num_vertices(), 8);
    assert_eq!(surface.mesh().boundary_loops().len(), 0);
}

#[test]
fn sparse_positions_are_replaced() {
    let Some(path) = shared("malformed/gltf_sparse_accessor/SimpleSparseAccessor.gltf") else {
        return;
    };
    let document = load(&path).unwrap();
    let y = |v: usize| document.positions()[v].y;
    assert_eq!([y(8), y(10), y(12)], [2.0, 3.0, 4.0]);
}

/// The positions, UVs, indices and image of each primitive of a GLB, as found by an independent
/// reader.
fn second_reader(bytes: &[u8]) -> (gltf::Document, Vec<u8>) {
    let gltf = gltf::Gltf::from_slice(bytes).unwrap();
    (gltf.document, gltf.blob.unwrap())
}

#[test]
fn a_moved_duck_keeps_everything_else() {
    let Some(path) = shared("meshes/duck.glb") else {
        return;
    };
    let bytes = std::fs::read(&path).unwrap();
    let mut document = load(&path).unwrap();
    assert_eq!(document.positions().len(), 2399);
    assert_eq!(document.faces().len(), 4212);
    let surface = document.surface().unwrap();
    let mesh = surface.mesh();
    assert_eq!((mesh.num_vertices(), mesh.num_faces()), (2108, 4212));
    assert_eq!(mesh.boundary_loops().len(), 0);
    assert_eq!(
        mesh.num_vertices() as i64 - mesh.num_edges() as i64 + mesh.num_faces() as i64,
        2
    );
    let (low, high) = document.positions().iter().fold(
        (Point3::from([f64::MAX; 3]), Point3::from([f64::MIN; 3])),
        |(low, high), p| (low.inf(p), high.sup(p)),
    );
    assert!(((high - low).norm() - 2.5376).abs() < 1e-4);
    assert!(volume(&document) > 0.0);

    // Bend the upper half.
    let moved = surface.positions().map(|p| {
        let lift = (p.y - 0.9).max(0.0);
        Point3::new(p.x + 0.3 * lift * lift, p.y, p.z - 0.1 * lift)
    });
    document.set_positions(&surface, &moved).unwrap();
    let written = document.write(Format::Glb).unwrap();
    assert_eq!(document.losses(Format::Glb), Vec::<String>::new());
    // Kept on request, to be checked by another reader.
    if let Some(folder) = std::env::var_os("COTAN_KEEP") {
        std::fs::write(Path::new(&folder).join("duck.glb"), &written).unwrap();
        let new = Document::new(document.positions().to_vec(), document.faces().clone())
            .unwrap()
            .with_attributes(document.attributes().unwrap().into_owned())
            .unwrap();
        let bytes = new.write(Format::Glb).unwrap();
        std::fs::write(Path::new(&folder).join("new.glb"), bytes).unwrap();
    }

    let again = read(written.clone(), None, &Limits::default()).unwrap();
    assert_eq!(again.faces(), document.faces());
    for (a, b) in again.positions().iter().zip(document.positions()) {
        assert!((a - b).norm() < 1e-6);
    }
    let closed = again.surface().unwrap();
    assert_eq!(
        (
            closed.mesh().num_vertices(),
            closed.mesh().boundary_loops().len()
        ),
        (2108, 0)
    );

    let ((old, old_blob), (new, new_blob)) = (second_reader(&bytes), second_reader(&written));
    assert_eq!(new_blob.len(), old_blob.len());
    let scale = |document: &gltf::Document| document.nodes().next().unwrap().transform().matrix();
    assert_eq!(scale(&old), scale(&new));
    let json = |bytes: &[u8]| -> Value {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[20..20 + length]).unwrap()
    };
    let (mut a, mut b) = (json(&bytes), json(&written));
    assert_ne!(a["accessors"][2]["max"], b["accessors"][2]["max"]);
    for json in [&mut a, &mut b] {
        for accessor in [1, 2] {
            json["accessors"][accessor]["min"].take();
            json["accessors"][accessor]["max"].take();
        }
    }
    assert_eq!(a, b, "the JSON differs in bounds only");

    let primitive = |document: &gltf::Document| {
        let mesh = document.meshes().next().unwrap();
        mesh.primitives().next().unwrap().index()
    };
    assert_eq!(primitive(&old), primitive(&new));
    let new_mesh = new.meshes().next().unwrap();
    let new_primitive = new_mesh.primitives().next().unwrap();
    let reader = new_primitive.reader(|_| Some(&new_blob));
    let old_mesh = old.meshes().next().unwrap();
    let old_primitive = old_mesh.primitives().next().unwrap();
    let old_reader = old_primitive.reader(|_| Some(&old_blob));
    let uvs = |reader: gltf::mesh::util::ReadTexCoords<'_>| reader.into_f32().collect::<Vec<_>>();
    assert_eq!(
        uvs(reader.read_tex_coords(0).unwrap()),
        uvs(old_reader.read_tex_coords(0).unwrap())
    );
    assert_eq!(
        new_primitive.material().name(),
        old_primitive.material().name()
    );
    let positions: Vec<[f32; 3]> = reader.read_positions().unwrap().collect();
    let olds: Vec<[f32; 3]> = old_reader.read_positions().unwrap().collect();
    let mut num_moved = 0;
    for (v, p) in positions.iter().enumerate() {
        let world = document.positions()[v];
        for k in 0..3 {
            assert!((f64::from(p[k]) * 0.009999999776482582 - world[k]).abs() < 1e-6);
        }
        if world.y <= 0.9 {
            assert_eq!(*p, olds[v], "vertex {v} did not move");
        } else {
            num_moved += 1;
        }
    }
    assert!(num_moved > 100);
    let bounds = new_primitive.bounding_box();
    for k in 0..3 {
        let column = || positions.iter().map(|p| p[k]);
        assert_eq!(bounds.min[k], column().fold(f32::MAX, f32::min));
        assert_eq!(bounds.max[k], column().fold(f32::MIN, f32::max));
    }
    // Normals above the bend have rotated and have unit length; those far below are unchanged.
    let normals: Vec<[f32; 3]> = reader.read_normals().unwrap().collect();
    let old_normals: Vec<[f32; 3]> = old_reader.read_normals().unwrap().collect();
    assert_ne!(normals, old_normals);
    for (v, (n, old)) in normals.iter().zip(&old_normals).enumerate() {
        let length = |n: &[f32; 3]| n.iter().map(|x| x * x).sum::<f32>().sqrt();
        assert!((length(n) - length(old)).abs() < 1e-5);
        if document.positions()[v].y < 0.7 {
            assert_eq!(n, old, "normal {v}");
        }
    }
    // The image bytes are preserved.
    let image =
        |document: &gltf::Document, blob: &[u8]| match document.images().next().unwrap().source() {
            gltf::image::Source::View { view, .. } => {
                blob[view.offset()..][..view.length()].to_vec()
            }
            gltf::image::Source::Uri { .. } => Vec::new(),
        };
    assert_eq!(image(&old, &old_blob), image(&new, &new_blob));

    // To the other container and back: the same mesh, and the same data bytes.
    let text = document.write(Format::Gltf).unwrap();
    let other = read(text, None, &Limits::default()).unwrap();
    assert_eq!(other.format(), Some(Format::Gltf));
    assert_eq!(other.positions(), again.positions());
    let (_, blob) = second_reader(&other.write(Format::Glb).unwrap());
    assert_eq!(blob, new_blob);
}
