use proptest::prelude::*;
use serde_json::json;

use super::made::no_files;
use super::made::{CORNERS, FACES, Made, json_of};
use crate::attributes::NONE;
use crate::error::IoError;
use crate::faces::FaceList;
use crate::format::Format;
use crate::gltf::GltfFile;
use crate::limits::Limits;
use crate::normals::Normals;
use crate::parsed::Parsed;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, SourceFile};

/// A mesh of two primitives with separate vertices, a mirrored mesh, and one that shares the
/// vertices of the first.
fn several() -> Vec<u8> {
    let mut made = Made::default();
    let mut vertices = |shift: f32| {
        let moved: Vec<f32> = CORNERS.iter().map(|x| x + shift).collect();
        made.floats("VEC3", &moved)
    };
    let (a, b, c) = (vertices(0.0), vertices(5.0), vertices(9.0));
    let targets = made.floats("VEC3", &[0.5; 12]);
    let uvs: Vec<f32> = (0..8u8).map(|i| f32::from(i) / 8.0).collect();
    let uvs = made.floats("VEC2", &uvs);
    let weights = made.floats("SCALAR", &[1.0, 2.0, 3.0, 4.0]);
    let view = made.view(&[1, 2, 3, 99, 4, 5, 6, 99, 7, 8, 9, 99, 10, 11, 12, 99]);
    made.views[view]["byteStride"] = 4.into();
    let colors = made.accessor(json!({
        "bufferView": view, "componentType": 5121, "count": 4, "type": "VEC3", "normalized": true,
    }));
    let faces = made.indices(&FACES);
    // The fan has the remaining faces of a tetrahedron.
    let others = made.indices(&[0, 1, 3, 1, 2, 3, 0, 1, 3, 1, 2, 3]);
    made.glb(&json!({
        "nodes": [{"mesh": 0}, {"mesh": 1, "scale": [1, -1, 1]}, {"mesh": 2, "scale": [1, -1, 1]}],
        "meshes": [
            {"primitives": [
                {"attributes": {"POSITION": a, "TEXCOORD_0": uvs, "COLOR_0": colors},
                    "indices": faces, "targets": [{"POSITION": targets}]},
                {"attributes": {"POSITION": b, "_W": weights}, "mode": 5,
                    "targets": [{"POSITION": targets}]},
                {"attributes": {"POSITION": b}, "mode": 0},
            ]},
            {"primitives": [{"attributes": {"POSITION": c, "TEXCOORD_0": uvs}, "indices": others}]},
            {"primitives": [{"attributes": {"POSITION": c, "_W": weights}, "mode": 6}]},
        ],
    }))
}

fn open(bytes: &[u8]) -> (GltfFile, Parsed) {
    GltfFile::read(bytes.to_vec(), &Limits::default(), no_files()).unwrap()
}

fn mesh(parsed: &Parsed) -> Mesh<'_> {
    Mesh {
        positions: &parsed.positions,
        faces: &parsed.faces,
    }
}

fn written(file: &dyn SourceFile, parsed: &Parsed) -> Vec<u8> {
    let moves = Moves {
        mesh: mesh(parsed),
        moved: &[],
        normals: &Normals::default(),
    };
    file.write(Format::Glb, &moves).unwrap()
}

/// Rebuilds the file, checks that all data moved with the vertices, and returns the new bytes.
fn rebuilt(bytes: &[u8], remap: &Remap) -> Result<Vec<u8>, IoError> {
    let (file, parsed) = open(bytes);
    let old = file.attributes(mesh(&parsed))?.remapped(remap);
    let new = file.rebuild(remap, mesh(&parsed))?;
    let bytes = written(new.as_ref(), &parsed);
    let (again, parsed) = open(&bytes);
    assert_eq!(parsed.faces, remap.faces);
    let new = again.attributes(mesh(&parsed))?;
    for property in &new.vertices {
        let expected = old.vertex(&property.name).unwrap();
        let semantic = match property.name.as_str() {
            "uv" => "TEXCOORD_0",
            "color" => "COLOR_0",
            _ => "_W",
        };
        let k = property.components;
        for (face, &source) in remap.face_sources.iter().enumerate() {
            // A face has the attributes of its own primitive, whatever others have at its
            // vertices.
            let mut pieces = file.geometry.pieces.iter();
            let piece = pieces.find(|piece| piece.faces.contains(&(source as usize)));
            let primitive = piece.and_then(|piece| file.primitive(piece));
            if !primitive.is_some_and(|p| p.attributes.contains_key(semantic)) {
                continue;
            }
            for &v in remap.faces.get(face).unwrap() {
                for i in k * v as usize..k * (v as usize + 1) {
                    let expected = expected.values.get(i);
                    assert_eq!(property.values.get(i), expected, "{}", property.name);
                }
            }
        }
    }
    gltf::Gltf::from_slice_without_validation(&bytes).unwrap();
    Ok(bytes)
}

#[test]
fn what_does_not_change_keeps_its_bytes() {
    let bytes = several();
    let (_, parsed) = open(&bytes);
    assert_eq!((parsed.positions.len(), parsed.faces.len()), (12, 12));
    let remap = Remap::identity(12, &parsed.faces);
    assert_eq!(rebuilt(&bytes, &remap).unwrap(), bytes);
}

#[test]
fn a_split_vertex_changes_its_mesh_only() {
    let bytes = several();
    let (_, parsed) = open(&bytes);
    // Vertex 9 of the second mesh is duplicated for its first face.
    let mut remap = Remap::identity(12, &parsed.faces);
    remap.vertices.push(9);
    let mut faces: Vec<Vec<u32>> = parsed.faces.iter().map(<[u32]>::to_vec).collect();
    faces[6]
        .iter_mut()
        .filter(|v| **v == 9)
        .for_each(|v| *v = 12);
    remap.faces = faces.iter().collect();
    let new = rebuilt(&bytes, &remap).unwrap();
    let (old, new) = (json_of(&bytes), json_of(&new));
    assert_eq!(new["meshes"][0], old["meshes"][0]);
    let position = |mesh: usize| &new["meshes"][mesh]["primitives"][0]["attributes"]["POSITION"];
    assert_eq!(position(1), position(2));
    assert_ne!(new["meshes"][1], old["meshes"][1]);
    // A hole is closed by a face next to the others.
    let mut faces: Vec<Vec<u32>> = parsed.faces.iter().map(<[u32]>::to_vec).collect();
    faces.insert(6, vec![4, 6, 7]);
    let mut remap = Remap::identity(12, &parsed.faces);
    remap.faces = faces.iter().collect();
    remap.face_sources.insert(6, NONE);
    remap.corner_sources.splice(18..18, [15, 15, 15]);
    rebuilt(&bytes, &remap).unwrap();
}

#[test]
fn a_mesh_without_faces_is_hidden() {
    let bytes = several();
    let (_, parsed) = open(&bytes);
    // Only the strip of the first mesh is left.
    let faces: FaceList = [[0u32, 1, 2], [1, 3, 2]].iter().collect();
    assert_eq!(parsed.faces.get(4), Some(&[4u32, 5, 6][..]));
    let remap = Remap {
        vertices: (4..8).collect(),
        faces,
        face_sources: vec![4, 5],
        corner_sources: (12..18).collect(),
    };
    let new = json_of(&rebuilt(&bytes, &remap).unwrap());
    assert_eq!(new["meshes"][0]["primitives"].as_array().unwrap().len(), 2);
    assert_eq!(new["meshes"][1]["primitives"][0]["mode"], 0);
    assert_eq!(new["nodes"][1], json!({"scale": [1, -1, 1]}));
    assert_eq!(new["nodes"][0], json!({"mesh": 0}));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn everything_goes_with_the_vertices(
        kept in prop::collection::vec(0u8..4, 12),
        copies in prop::collection::vec(0u32..12, 0..6),
        faces in prop::collection::vec((0u8..4, any::<[u8; 3]>()), 12),
    ) {
        let bytes = several();
        let (_, parsed) = open(&bytes);
        // The vertices of each part in any order: the kept old ones, then copies.
        let mut vertices = Vec::new();
        for part in &parsed.parts {
            let part = part.vertices.start as u32..part.vertices.end as u32;
            vertices.extend(part.clone().filter(|&v| kept[v as usize] > 0));
            vertices.extend(copies.iter().copied().filter(|v| part.contains(v)));
        }
        let mut remap = Remap { vertices, ..Remap::default() };
        let mut polygons: Vec<[u32; 3]> = Vec::new();
        for (face, polygon) in parsed.faces.iter().enumerate() {
            let (is_kept, picks) = faces[face];
            let corners: Option<Vec<u32>> = polygon
                .iter()
                .zip(picks)
                .map(|(&old, pick)| {
                    let places: Vec<usize> =
                        (0..remap.vertices.len()).filter(|&i| remap.vertices[i] == old).collect();
                    Some(*places.get(usize::from(pick) % places.len().max(1))? as u32)
                })
                .collect();
            if let Some(corners) = corners.filter(|_| is_kept > 0) {
                polygons.push([corners[0], corners[1], corners[2]]);
                remap.face_sources.push(face as u32);
                remap.corner_sources.extend(parsed.faces.corner_range(face).map(|c| c as u32));
            }
        }
        prop_assume!(!polygons.is_empty());
        remap.faces = polygons.iter().collect();
        match rebuilt(&bytes, &remap) {
            Ok(_) => {}
            // Unused vertices may be where no primitive can have them. If the mesh that places
            // shared vertices is dropped, another node would place them.
            Err(IoError::Unsupported { .. }) => {
                let corners = remap.faces.corners();
                let unused = (0..remap.vertices.len() as u32).any(|v| !corners.contains(&v));
                let has = |faces: std::ops::Range<u32>| {
                    remap.face_sources.iter().any(|source| faces.contains(source))
                };
                prop_assert!(unused || (!has(6..10) && has(10..12)));
            }
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        }
    }
}
