//! Materials of files from other programs: the supported data is read, and the rest is reported
//! as lost.

use proptest::prelude::*;
use serde_json::{Value, json};

use super::made::{CORNERS, FACES, Made, One, open, open_with};
use crate::format::Format;
use crate::material::{Alpha, Image, Material};

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nimage";
const JPEG: &[u8] = b"\xff\xd8\xff\xe0image";

/// A tetrahedron whose faces use these materials in turn; images are in its data.
fn tetrahedron(members: &Value, images: &[&[u8]]) -> Vec<u8> {
    let mut made = Made::default();
    let positions = made.floats("VEC3", &CORNERS);
    let num_materials = members["materials"].as_array().map_or(0, Vec::len);
    let primitives: Vec<Value> = FACES
        .chunks(3)
        .enumerate()
        .map(|(face, corners)| {
            let indices = made.indices(corners);
            let mut primitive = json!({"attributes": {"POSITION": positions}, "indices": indices});
            if num_materials > 0 {
                // In reverse, so that labels and materials have different indices.
                primitive["material"] = json!(num_materials - 1 - face % num_materials);
            }
            primitive
        })
        .collect();
    let mut root = json!({"nodes": [{"mesh": 0}], "meshes": [{"primitives": primitives}]});
    let images: Vec<Value> = images
        .iter()
        .map(|bytes| json!({"bufferView": made.view(bytes)}))
        .collect();
    if !images.is_empty() {
        root["images"] = images.into();
    }
    for (key, value) in members.as_object().unwrap() {
        match (root.get_mut(key), value) {
            (Some(Value::Array(list)), Value::Array(more)) => list.extend(more.iter().cloned()),
            _ => root[key] = value.clone(),
        }
    }
    made.glb(&root)
}

#[test]
fn everything_that_the_model_holds_is_read() {
    let glb = tetrahedron(
        &json!({
            "materials": [
                {"name": "plain"},
                {
                    "name": "rich",
                    "pbrMetallicRoughness": {
                        "baseColorFactor": [0.1, 0.2, 0.3, 0.4],
                        "baseColorTexture": {"index": 1},
                        "metallicFactor": 0.5,
                        "roughnessFactor": 0.25,
                    },
                    "alphaMode": "MASK",
                    "emissiveFactor": [1.0, 0.5, 0.0],
                    "emissiveTexture": {"index": 0},
                    "normalTexture": {"index": 1},
                    "doubleSided": true,
                    "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}},
                },
            ],
            "textures": [{"source": 1}, {"source": 0}],
        }),
        &[PNG, JPEG],
    );
    let found = open(&glb).unwrap().materials().unwrap();
    let rich = Material {
        base_color: [0.1, 0.2, 0.3],
        opacity: 0.4,
        alpha: Alpha::Mask(0.5),
        metallic: 0.5,
        roughness: 0.25,
        emission: [3.0, 1.5, 0.0],
        is_double_sided: true,
        base_color_texture: Some(0),
        emission_texture: Some(1),
        normal_texture: Some(0),
        ..Material::named("rich")
    };
    let plain = Material {
        metallic: 1.0,
        ..Material::named("plain")
    };
    assert_eq!(found.list, [rich, plain]);
    let images = [PNG, JPEG].map(|bytes| Image::new("", bytes.to_vec()).unwrap());
    assert_eq!(found.images, images);
    assert_eq!(found.others().count(), 0);
}

#[test]
fn images_come_from_data_uris_and_files_too() {
    let uri = format!("data:image/png;base64,{}", "iVBORw0KGgo=");
    let members = json!({
        "materials": [
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 1}}},
        ],
        "textures": [{"source": 0}, {"source": 1}],
        "images": [{"uri": uri}, {"uri": "my%20sky.jpg"}],
    });
    let glb = tetrahedron(&members, &[]);
    let document = open_with(&glb, &One("my sky.jpg", JPEG.to_vec())).unwrap();
    let found = document.materials().unwrap();
    assert_eq!(found.images.len(), 2);
    // The labels are in face order.
    assert_eq!(found.list[0].name, "material 1");
    let first = &found.images[found.list[0].base_color_texture.unwrap()];
    assert_eq!(first.bytes(), JPEG);
    let second = &found.images[found.list[1].base_color_texture.unwrap()];
    assert_eq!((second.bytes(), second.name.as_str()), (&PNG[..8], ""));

    let found = open(&glb).unwrap().materials().unwrap();
    assert_eq!((found.list.len(), found.images.len()), (2, 1));
    let others: Vec<&str> = found.others().collect();
    assert!(
        others.len() == 1 && others[0].starts_with("image 1 ("),
        "{others:?}"
    );
}

/// Something that OBJ cannot represent, its location in the JSON, and the message for its loss.
type Feature = (&'static str, Value, &'static str);

fn features() -> Vec<Feature> {
    vec![
        (
            "/materials/0/occlusionTexture",
            json!({"index": 0}),
            "occlusion textures",
        ),
        (
            "/materials/0/pbrMetallicRoughness/metallicRoughnessTexture",
            json!({"index": 0}),
            "metallic-roughness textures",
        ),
        (
            "/materials/0/normalTexture",
            json!({"index": 0, "scale": 0.5}),
            "the scales of normal textures",
        ),
        (
            "/materials/1/doubleSided",
            json!(true),
            "the display of back faces (doubleSided)",
        ),
        (
            "/materials/1/alphaMode",
            json!("MASK"),
            "the alpha cutoffs of materials (alphaMode MASK)",
        ),
        (
            "/materials/0/extras",
            json!({"a": [1]}),
            "application data (`extras`) of materials",
        ),
        (
            "/materials/0/emissiveTexture",
            json!({"index": 0, "texCoord": 1}),
            "textures on a further set of texture coordinates",
        ),
        (
            "/materials/1/pbrMetallicRoughness/baseColorFactor",
            json!([2.0, 0.0, -1.0, 1.0]),
            "numbers of materials beyond 0 to 1",
        ),
        ("/textures/0/name", json!("a"), "names of textures"),
        (
            "/textures/0/extras",
            json!(1),
            "application data (`extras`) of textures",
        ),
        (
            "/samplers/0/wrapS",
            json!(33071),
            "the wrapping of textures (samplers)",
        ),
        (
            "/samplers/0/minFilter",
            json!(9987),
            "the filters of textures (samplers)",
        ),
        (
            "/images/0/extras",
            json!({}),
            "application data (`extras`) of images",
        ),
        (
            "/materials/1/emissiveTexture",
            json!({"index": 1}),
            "image 1 (it is neither a PNG nor a JPEG)",
        ),
        (
            "/materials/1/normalTexture",
            json!({"index": 9}),
            "missing or invalid textures",
        ),
        (
            "/materials/0/extensions/KHR_materials_transmission",
            json!({"transmissionFactor": 1}),
            "the extension KHR_materials_transmission of materials",
        ),
    ]
}

/// Sets a value, creating its parents.
fn set(root: &mut Value, path: &str, value: &Value) {
    let mut at = root;
    for part in path.split('/').skip(1) {
        at = match part.parse::<usize>() {
            Ok(index) => &mut at[index],
            Err(_) => &mut at[part],
        };
    }
    *at = value.clone();
}

proptest! {
    #[test]
    fn what_obj_cannot_say_is_named_once(chosen in any::<[bool; 16]>()) {
        let mut members = json!({
            "materials": [
                {"name": "a", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}},
                {"name": "b", "pbrMetallicRoughness": {}},
            ],
            "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
            "samplers": [{}],
            "images": [],
        });
        let features = features();
        prop_assert_eq!(features.len(), chosen.len());
        let mut expected = vec!["1 node"];
        let mut images = json!([{}, {}]);
        for ((path, value, loss), _) in features.iter().zip(chosen).filter(|(_, chosen)| *chosen) {
            match path.strip_prefix("/images") {
                Some(path) => set(&mut images, path, value),
                None => set(&mut members, path, value),
            }
            expected.push(loss);
        }
        if !expected.contains(&"image 1 (it is neither a PNG nor a JPEG)") {
            expected.extend(["an image of other textures", "textures that no material shows"]);
        }
        let glb = with_images(&members, &images);
        let document = open(&glb).unwrap();
        let mut losses = document.losses(Format::Obj);
        losses.sort_unstable();
        let mut expected: Vec<String> = expected
            .iter()
            .map(|loss| format!("{loss} will be lost in OBJ"))
            .collect();
        expected.sort_unstable();
        prop_assert_eq!(losses, expected);
        // Formats without materials report this with one entry.
        let losses = document.losses(Format::Stl);
        let count = |words: &str| losses.iter().filter(|loss| loss.contains(words)).count();
        prop_assert_eq!((count("materials"), count("image of a texture")), (1, 1));
    }
}

/// The tetrahedron with one image that can be converted and one that cannot.
fn with_images(members: &Value, images: &Value) -> Vec<u8> {
    let glb = tetrahedron(members, &[PNG, b"RIFF....WEBP"]);
    let mut json = super::made::json_of(&glb);
    for (index, more) in images.as_array().unwrap().iter().enumerate() {
        for (key, value) in more.as_object().unwrap() {
            json["images"][index][key] = value.clone();
        }
    }
    let container = crate::gltf::container::Container::read(&glb, &mut Vec::new()).unwrap();
    let bin = container.bin.map(|range| &glb[range]);
    crate::gltf::container::write_binary(&json.to_string(), bin, [].into_iter(), &[]).unwrap()
}

#[test]
fn a_wrong_material_costs_only_itself() {
    let glb = tetrahedron(
        &json!({
            "materials": [
                {"name": "good", "pbrMetallicRoughness": {"metallicFactor": 0.5}},
                {"name": "bad", "pbrMetallicRoughness": {"metallicFactor": "much"}},
            ],
        }),
        &[],
    );
    let document = open(&glb).unwrap();
    let found = document.materials().unwrap();
    assert_eq!(found.list[0], Material::named("bad"));
    assert_eq!(found.list[1].metallic, 0.5);
    let others: Vec<&str> = found.others().collect();
    assert!(
        others.len() == 1 && others[0].starts_with("all but the name of the material `bad`"),
        "{others:?}"
    );
    assert_eq!(document.write(Format::Glb).unwrap(), glb);
}
