//! Accessors used by several meshes, primitives and instances, and meshes shown by several nodes:
//! no use affects another, and none is mistaken for a duplicate.

use nalgebra::{Point3, Vector3};
use serde_json::{Value, json};

use super::made::{CORNERS, FACES, Made, json_of, open, volume};
use crate::attributes::LabelKind;
use crate::document::Document;
use crate::format::Format;
use crate::repair::{Change, Repair};

/// A tetrahedron that `meshes` share, shown by `nodes`; `more` adds to its data.
fn shared(nodes: &Value, meshes: &[&str], more: impl Fn(&mut Made) -> Value) -> Vec<u8> {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&FACES);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let meshes = meshes
        .iter()
        .map(|name| json!({"name": name, "primitives": [primitive]}));
    let mut members = json!({"nodes": nodes, "meshes": meshes.collect::<Vec<_>>()});
    if let Value::Object(more) = more(&mut made) {
        members.as_object_mut().unwrap().extend(more);
    }
    made.glb(&members)
}

fn two() -> Vec<u8> {
    let nodes = json!([{"mesh": 0}, {"mesh": 1, "translation": [3, 0, 0]}]);
    shared(&nodes, &["red", "blue"], |_| json!({}))
}

/// The lower corner of the bounding box of each part.
fn low(document: &Document) -> Vec<[f64; 3]> {
    let low = |positions: &[Point3<f64>]| {
        let far = Point3::from([f64::INFINITY; 3]);
        positions.iter().fold(far, |low, p| low.inf(p)).into()
    };
    let parts = document.parts().iter();
    parts
        .map(|part| low(&document.positions()[part.vertices.clone()]))
        .collect()
}

#[test]
fn a_second_use_has_vertices_of_its_own_and_is_no_duplicate() {
    let document = open(&two()).unwrap();
    assert_eq!(low(&document), [[0.0; 3], [3.0, 0.0, 0.0]]);
    assert!(document.warnings().is_empty(), "{:?}", document.warnings());
    assert_eq!(document.surface().unwrap().mesh().num_faces(), 8);
    for repair in [Repair::default(), Repair::all()] {
        let repaired = repair.apply(&document).unwrap();
        assert_eq!(repaired.changes, []);
        let again = open(&repaired.document.write(Format::Glb).unwrap()).unwrap();
        assert_eq!(again.positions(), document.positions());
    }
}

#[test]
fn a_moved_use_leaves_the_other_where_it_is() {
    for moved in [1, 5] {
        let mut document = open(&two()).unwrap();
        let to = document.positions()[moved] + Vector3::new(0.25, 0.5, 0.0);
        document.set_position(moved, to).unwrap();
        let bytes = document.write(Format::Glb).unwrap();
        let again = open(&bytes).unwrap();
        assert_eq!(again.positions(), document.positions());
        assert_eq!(again.faces(), document.faces());
        let json = json_of(&bytes);
        assert_eq!(json["nodes"], json_of(&two())["nodes"]);
        assert_eq!(json["accessors"].as_array().unwrap().len(), 3);
    }
}

#[test]
fn repairing_one_use_keeps_the_other() {
    // Mesh `blue` has an additional face without area, which is dropped.
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let right = made.indices(&FACES);
    let wrong = made.indices(&[&FACES[..], &[1, 1, 2]].concat());
    let primitive = |i: usize| json!({"attributes": {"POSITION": positions}, "indices": i});
    for [first, second] in [[right, wrong], [wrong, right], [wrong, wrong]] {
        let glb = made.glb(&json!({
            "nodes": [{"mesh": 0}, {"mesh": 1, "translation": [0, 3, 0]}],
            "meshes": [
                {"primitives": [primitive(first)]},
                {"name": "blue", "primitives": [primitive(second)]},
            ],
        }));
        let repaired = Repair::default().apply(&open(&glb).unwrap()).unwrap();
        let is_drop = |change: &Change| matches!(change, Change::DroppedDegenerate { .. });
        assert!(
            repaired.changes.iter().all(is_drop),
            "{:?}",
            repaired.changes
        );
        let bytes = repaired.document.write(Format::Glb).unwrap();
        let again = open(&bytes).unwrap();
        assert_eq!(low(&again), [[0.0; 3], [0.0, 3.0, 0.0]]);
        assert_eq!(again.surface().unwrap().mesh().num_faces(), 8);
        assert_eq!(json_of(&bytes)["nodes"][1]["mesh"], 1);
    }
}

#[test]
fn the_same_faces_at_the_same_place_are_kept_apart() {
    // Two meshes, two primitives of a mesh, and two primitives with copies of the data.
    let mut made = Made::default();
    let data: Vec<(usize, usize)> = (0..2)
        .map(|_| (made.floats("VEC3", &CORNERS), made.indices(&FACES)))
        .collect();
    let primitive = |n: usize, material: usize| {
        let (positions, indices) = data[n];
        json!({"attributes": {"POSITION": positions}, "indices": indices, "material": material})
    };
    let materials = json!([{"name": "surface"}, {"name": "outline"}]);
    for meshes in [
        json!([{"primitives": [primitive(0, 0)]}, {"primitives": [primitive(0, 1)]}]),
        json!([{"primitives": [primitive(0, 0), primitive(0, 1)]}]),
        json!([{"primitives": [primitive(0, 0), primitive(1, 1)]}]),
    ] {
        let glb = made.glb(&json!({"meshes": meshes, "materials": materials}));
        let document = open(&glb).unwrap();
        assert_eq!(document.positions().len(), 8);
        let surface = document.surface().unwrap();
        assert_eq!(
            (surface.mesh().num_faces(), surface.mesh().num_vertices()),
            (8, 8)
        );
        let repaired = Repair::all().apply(&document).unwrap();
        assert_eq!(repaired.changes, [], "{meshes}");
        let mut document = repaired.document;
        for v in 0..8 {
            let p = document.positions()[v] * 2.0;
            document.set_position(v, p).unwrap();
        }
        let again = open(&document.write(Format::Gltf).unwrap()).unwrap();
        assert_eq!(again.positions(), document.positions());
        let attributes = again.attributes().unwrap();
        let labels = attributes.label(LabelKind::Material).unwrap();
        assert_eq!(labels.faces, [0, 0, 0, 0, 1, 1, 1, 1]);
        again.surface().unwrap();
    }
}

#[test]
fn layers_stay_layers_when_one_of_them_was_moved() {
    // A surface, an outline over it, and a decal over one of its faces.
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let copies = made.floats("VEC3", &CORNERS);
    let indices = [made.indices(&FACES), made.indices(&FACES[3..6])];
    let primitive = |positions: usize, indices: usize| json!({"attributes": {"POSITION": positions}, "indices": indices});
    let glb = made.glb(&json!({"meshes": [{"primitives": [
        primitive(positions, indices[0]),
        primitive(positions, indices[0]),
        primitive(copies, indices[1]),
    ]}]}));
    let document = open(&glb).unwrap();
    assert_eq!(document.positions().len(), 12);
    let warning = &document.warnings()[0].message;
    assert!(warning.contains("at the same place: 2;"), "{warning}");
    // In every case one vertex of a layer moves, and at least one face keeps its place.
    for moved in 0..8 {
        let mut document = document.clone();
        let to = document.positions()[moved] + Vector3::new(0.25, 0.5, 0.125);
        document.set_position(moved, to).unwrap();
        for format in [Format::Glb, Format::Gltf] {
            let again = open(&document.write(format).unwrap()).unwrap();
            assert_eq!(again.positions(), document.positions());
            assert_eq!(again.faces(), document.faces());
            assert_eq!(again.surface().unwrap().mesh().num_faces(), 9);
            let repaired = Repair::all().apply(&again).unwrap();
            // The accessor of the decal has a vertex that no face uses.
            let dropped = [Change::DroppedVertex { vertex: 10 }];
            assert_eq!(repaired.changes, dropped, "vertex {moved}");
        }
    }
}

#[test]
fn a_repair_of_layers_leaves_them_layers() {
    // Each layer is a bow-tie: two tetrahedra that meet in a vertex, which is split.
    let far = CORNERS.map(|x| -x);
    let mut made = Made::default();
    let positions = made.floats("VEC3", &[&CORNERS[..], &far[3..]].concat());
    let turned = FACES.chunks(3).flat_map(|f| [f[0], f[2], f[1]]);
    let second = turned.map(|i| if i == 0 { 0 } else { i + 3 });
    let indices: Vec<u16> = FACES.into_iter().chain(second).collect();
    let indices = made.indices(&indices);
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let glb = made.glb(&json!({"meshes": [{"primitives": [primitive, primitive]}]}));
    let document = open(&glb).unwrap();
    assert_eq!(document.positions().len(), 14);
    let repaired = Repair::default().apply(&document).unwrap();
    assert_eq!(repaired.document.positions().len(), 16);
    assert_eq!(repaired.document.surface().unwrap().mesh().num_faces(), 16);
    let again = open(&repaired.document.write(Format::Glb).unwrap()).unwrap();
    assert_eq!(again.positions(), repaired.document.positions());
    assert_eq!(again.faces(), repaired.document.faces());
    // Positions do not record that the vertex was split, but there are still two layers.
    let again = Repair::default().apply(&again).unwrap();
    assert_eq!(again.document.surface().unwrap().mesh().num_faces(), 16);
}

#[test]
fn nodes_that_share_a_mesh_stay_instances_and_are_all_converted() {
    let nodes = json!([
        {"name": "a", "mesh": 0, "translation": [1, 0, 0]},
        {"name": "b", "mesh": 0, "translation": [0, 5, 0], "scale": [-1, 1, 1]},
        {"name": "c", "children": [3], "translation": [0, 0, 9]},
        {"name": "d", "mesh": 0, "scale": [2, 2, 2]},
        {"name": "the same place again", "mesh": 0, "translation": [1, 0, 0]},
    ]);
    let glb = shared(&nodes, &["thing"], |_| json!({}));
    let mut document = open(&glb).unwrap();
    assert_eq!(document.positions().len(), 4);
    let warning = &document.warnings()[0].message;
    assert!(warning.starts_with("mesh 0 is shown 4 times"), "{warning}");
    for step in 0..2 {
        for format in [Format::Obj, Format::Ply, Format::Off, Format::Stl] {
            let other = crate::read(document.write(format).unwrap(), None, &Default::default());
            let other = other.unwrap();
            assert_eq!(other.faces().len(), 12, "{format}");
            if format == Format::Stl {
                continue;
            }
            assert_eq!(other.positions().len(), 12, "{format}");
            let p = document.positions()[3] - Vector3::x();
            let places = [3, 7, 11].map(|v| other.positions()[v]);
            let expected = [
                Point3::new(1.0 + p.x, p.y, p.z),
                Point3::new(-p.x, 5.0 + p.y, p.z),
                Point3::new(2.0 * p.x, 2.0 * p.y, 9.0 + 2.0 * p.z),
            ];
            assert_eq!(places, expected, "{format}");
            // Mirrored copies are reversed, so that all point outward.
            let one = volume(&document);
            assert!((volume(&other) - 10.0 * one).abs() < 1e-12, "{format}");
        }
        if step == 0 {
            document
                .set_position(3, Point3::new(1.0, 0.0, 2.0))
                .unwrap();
        }
    }
    // After an edit they are still instances of one mesh.
    let bytes = document.write(Format::Glb).unwrap();
    assert_eq!(json_of(&bytes)["nodes"], nodes);
    assert_eq!(open(&bytes).unwrap().positions(), document.positions());
}

#[test]
fn a_document_with_other_attributes_keeps_its_instances_and_names_what_is_lost() {
    // Each mesh has a face without area, which a repair drops.
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let indices = made.indices(&[&[1, 1, 2], &FACES[..]].concat());
    let primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
    let glb = made.glb(&json!({
        "nodes": [
            {"mesh": 0}, {"mesh": 0, "translation": [5, 0, 0]}, {"mesh": 1, "scale": [-1, 1, 1]},
            {"mesh": 1, "translation": [0, 7, 0]}, {"camera": 0},
        ],
        "meshes": [{"primitives": [primitive]}, {"primitives": [primitive]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}],
    }));
    let document = open(&glb).unwrap();
    let attributes = document.attributes().unwrap().into_owned();
    let detached = document.with_attributes(attributes).unwrap();
    let repaired = Repair::default().apply(&detached).unwrap().document;
    assert_eq!(repaired.faces().len(), 8);
    for (made, num_faces) in [(&detached, 20), (&repaired, 16)] {
        let losses = made.losses(Format::Glb).join("\n");
        assert!(losses.contains("camera"), "{losses}");
        for format in [Format::Glb, Format::Obj, Format::Ply] {
            let bytes = made.write(format).unwrap();
            let again = crate::read(bytes, None, &Default::default()).unwrap();
            assert_eq!(again.faces().len(), num_faces, "{format}");
            let volume = volume(&again);
            assert!((volume - 4.0 / 6.0).abs() < 1e-12, "{format}: {volume}");
        }
    }
}

#[test]
fn instances_of_an_extension_are_converted_and_keep_their_places() {
    // The translations are those of the vertices: one accessor for both.
    let nodes = json!([{"mesh": 0, "translation": [10, 0, 0], "extensions": {
        "EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}},
    }}]);
    let glb = shared(&nodes, &["leaf"], |_| {
        json!({
            "extensionsUsed": ["EXT_mesh_gpu_instancing"],
            "extensionsRequired": ["EXT_mesh_gpu_instancing"],
        })
    });
    let mut document = open(&glb).unwrap();
    assert_eq!(low(&document), [[10.0, 0.0, 0.0]]);
    let first = document.positions()[1];
    document.set_position(1, first + Vector3::x()).unwrap();
    let bytes = document.write(Format::Glb).unwrap();
    let again = open(&bytes).unwrap();
    assert_eq!(again.positions(), document.positions());
    // The instances stay in place: the accessor was copied before it changed.
    let obj = |document: &Document| {
        let bytes = document.write(Format::Obj).unwrap();
        crate::read(bytes, None, &Default::default()).unwrap()
    };
    let obj = obj(&again);
    assert_eq!((obj.positions().len(), obj.faces().len()), (16, 16));
    for (instance, at) in CORNERS.chunks(3).enumerate() {
        let offset = Vector3::new(f64::from(at[0]), f64::from(at[1]), f64::from(at[2]));
        for v in 0..4 {
            let expected = document.positions()[v] + offset;
            assert_eq!(obj.positions()[4 * instance + v], expected);
        }
    }
}

#[test]
fn instances_that_are_turned_and_scaled() {
    let nodes = json!([{"mesh": 0, "extensions": {
        "EXT_mesh_gpu_instancing": {"attributes": {"ROTATION": 2, "SCALE": 3, "_COLOR": 0}},
    }}]);
    let half = 0.5f32.sqrt();
    let glb = |scales: &'static [f32]| {
        shared(&nodes, &["leaf"], move |made| {
            let rotations = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, half, half]];
            made.floats("VEC4", rotations.as_flattened());
            made.floats("VEC3", scales);
            json!({})
        })
    };
    let document = open(&glb(&[1.0, 1.0, 1.0, 3.0, 3.0, 3.0])).unwrap();
    let bytes = document.write(Format::Off).unwrap();
    let off = crate::read(bytes, None, &Default::default()).unwrap();
    assert_eq!(off.positions().len(), 8);
    assert!((off.positions()[5] - Point3::new(0.0, 3.0, 0.0)).norm() < 1e-6);
    let error = open(&glb(&[1.0, 1.0, 1.0])).unwrap_err().to_string();
    assert!(
        error.contains("2 instances by one attribute and 1 by"),
        "{error}"
    );
}

#[test]
fn what_is_not_converted_is_named() {
    let nodes = json!([
        {"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}, {"mesh": 0, "scale": [0, 1, 1]},
    ]);
    let glb = shared(
        &nodes,
        &["thing"],
        |_| json!({"scenes": [{"nodes": [0, 2]}, {"nodes": [1]}]}),
    );
    let document = open(&glb).unwrap();
    let losses = document.losses(Format::Ply).join("\n");
    assert!(
        losses.contains("1 instance of meshes that another scene shows"),
        "{losses}"
    );
    assert!(
        losses.contains("1 instance of meshes whose transform"),
        "{losses}"
    );
    let ply = crate::read(
        document.write(Format::Ply).unwrap(),
        None,
        &Default::default(),
    );
    assert_eq!(ply.unwrap().faces().len(), 4);
}

#[test]
fn more_instances_than_the_limits_allow_are_refused() {
    let nodes = json!([{"mesh": 0}, {"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}]);
    let glb = shared(&nodes, &["thing"], |_| json!({}));
    let limits = crate::Limits {
        max_faces: 11,
        ..Default::default()
    };
    let document = crate::read(glb, None, &limits).unwrap();
    let error = document.write(Format::Obj).unwrap_err().to_string();
    assert!(error.starts_with("more than 11 faces"), "{error}");
    document.write(Format::Gltf).unwrap();
}

#[test]
fn instances_become_meshes_that_are_edited_alone() {
    let nodes = json!([
        {"name": "cart", "children": [1, 2]},
        {"name": "left", "mesh": 0},
        {"name": "right", "mesh": 0, "translation": [3, 0, 0]},
        {"name": "third", "mesh": 1, "translation": [6, 0, 0]},
    ]);
    let document = open(&shared(&nodes, &["wheel", "hub"], |_| json!({}))).unwrap();
    assert_eq!(
        (document.num_instances(0), document.num_instances(1)),
        (2, 1)
    );
    let names: Vec<&str> = document.nodes().iter().map(|n| n.name.as_str()).collect();
    assert_eq!(names, ["cart", "left", "right", "third"]);
    assert_eq!(document.nodes()[2].parent, Some(0));
    assert_eq!(document.nodes()[2].part, Some(0));
    // An edit before is kept, and is that of both.
    let mut document = document;
    document
        .set_position(3, Point3::new(0.0, 0.0, 2.0))
        .unwrap();
    let mut unique = document.with_unique_meshes().unwrap();
    assert!(unique.warnings().is_empty(), "{:?}", unique.warnings());
    let x = [[0.0; 3], [6.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
    assert_eq!(low(&unique), x);
    assert_eq!(unique.positions()[3].z, 2.0);
    assert_eq!(unique.positions()[11], Point3::new(3.0, 0.0, 2.0));
    assert_eq!(unique.nodes()[2].part, Some(2));
    assert!((0..3).all(|part| unique.num_instances(part) == 1));
    // One is moved and the others are not, also in the file.
    unique.set_position(11, Point3::new(3.0, 0.0, 5.0)).unwrap();
    let written = unique.write(Format::Glb).unwrap();
    let again = open(&written).unwrap();
    assert_eq!(again.positions(), unique.positions());
    assert_eq!(again.faces(), unique.faces());
    let names: Vec<Value> = json_of(&written)["nodes"].as_array().unwrap().to_vec();
    assert_eq!(names[2]["translation"], json!([3, 0, 0]));
    // Without shared meshes nothing changes.
    let same = again.with_unique_meshes().unwrap();
    assert_eq!(same.write(Format::Glb).unwrap(), written);
}

#[test]
fn a_mesh_with_a_skin_is_read_in_its_bind_pose() {
    let nodes = json!([{"mesh": 0, "skin": 0, "translation": [3, 0, 0]}, {}]);
    let skins = json!({"skins": [{"joints": [1]}]});
    let document = open(&shared(&nodes, &["body"], |_| skins.clone())).unwrap();
    assert_eq!(low(&document), [[0.0; 3]]);
    let warnings = document.warnings();
    assert!(warnings[0].message.contains("bind pose"), "{warnings:?}");
}
