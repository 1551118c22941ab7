//! Material conversion between all formats: everything that is lost was reported beforehand.

#![allow(clippy::type_complexity, reason = "looks by the places of corners")]

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind};
use std::sync::Arc;

use cotan_io::{
    Alpha, Attributes, CornerProperty, Document, FaceList, Folder, Format, Image, LabelKind,
    Labels, Limits, Material, Materials, NONE, Repair, Resolve, UV, Values, WriteOptions,
    load_with, read_with, save,
};
use nalgebra::Point3;
use proptest::prelude::*;

/// The files next to a mesh.
#[derive(Clone, Debug, Default)]
struct Files(BTreeMap<String, Vec<u8>>);

impl Resolve for Files {
    fn resolve(&self, uri: &str, _max_bytes: u64) -> Result<Vec<u8>, Error> {
        let bytes = self.0.get(uri).cloned();
        bytes.ok_or_else(|| ErrorKind::NotFound.into())
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

/// Writes a document and reads it again, with its companion files.
fn through(document: &Document, format: Format) -> Document {
    let written = document
        .write_with(format, &WriteOptions::default())
        .expect("no failure");
    let files = written.companions.iter().map(|companion| {
        let name = companion.path().to_str().expect("no failure").to_owned();
        (name, companion.bytes().expect("no failure").into_owned())
    });
    let files = Files(files.collect());
    if matches!(format, Format::Gltf | Format::Glb) {
        gltf::Gltf::from_slice(&written.bytes).expect("no failure");
    }
    read_with(written.bytes, Some(format), &Limits::default(), &files).expect("no failure")
}

/// A number that no text format shortens.
fn unit() -> impl Strategy<Value = f32> {
    prop_oneof![Just(0.0), Just(1.0), Just(0.5), 0.0f32..1.0]
}

fn alpha() -> impl Strategy<Value = Alpha> {
    prop_oneof![
        Just(Alpha::Opaque),
        Just(Alpha::Blend),
        unit().prop_map(Alpha::Mask)
    ]
}

fn image() -> impl Strategy<Value = Image> {
    let name = prop_oneof![
        Just("wood"),
        Just(""),
        Just("../a b"),
        Just("Wood"),
        Just("#\n")
    ];
    (name, any::<bool>(), any::<[u8; 3]>()).prop_map(|(name, is_png, rest)| {
        let start: &[u8] = if is_png {
            b"\x89PNG\r\n\x1a\n"
        } else {
            b"\xff\xd8\xff"
        };
        Image::new(name, [start, &rest].concat()).expect("no failure")
    })
}

fn material(num_images: usize) -> impl Strategy<Value = Material> {
    let name = prop_oneof![
        Just("red"),
        Just("blue sky"),
        Just(""),
        Just("(null)"),
        Just("red.1"),
        Just(" a\n#"),
        Just("a\\"),
        Just("\u{e9}"),
    ];
    let texture = move || {
        prop::option::of(0..num_images.max(1)).prop_map(move |i| i.filter(|_| num_images > 0))
    };
    let emission = prop_oneof![
        Just([0.0; 3]),
        prop::array::uniform3(unit()),
        prop::array::uniform3(0.0f32..300.0)
    ];
    let numbers = (
        prop::array::uniform3(unit()),
        unit(),
        unit(),
        unit(),
        emission,
    );
    let textures = (texture(), texture(), texture());
    (name, numbers, alpha(), any::<bool>(), textures).prop_map(
        |(name, numbers, alpha, is_double_sided, textures)| {
            let (base_color, opacity, metallic, roughness, emission) = numbers;
            Material {
                base_color,
                opacity,
                alpha,
                metallic,
                roughness,
                emission,
                is_double_sided,
                base_color_texture: textures.0,
                emission_texture: textures.1,
                normal_texture: textures.2,
                ..Material::named(name)
            }
        },
    )
}

fn materials() -> impl Strategy<Value = Materials> {
    prop::collection::vec(image(), 0..4).prop_flat_map(|images| {
        let list = prop::collection::vec(material(images.len()), 1..5);
        list.prop_map(move |list| Materials::new(list, images.clone()))
    })
}

/// A strip of triangles, each with a material or none, and texture coordinates.
fn document() -> impl Strategy<Value = Document> {
    (materials(), 2usize..8, any::<[u8; 8]>(), any::<bool>()).prop_map(
        |(materials, num_faces, choices, has_uv)| {
            let positions: Vec<Point3<f64>> = (0..num_faces + 2)
                .map(|i| Point3::new(i as f64 / 2.0, (i % 2) as f64, (i * i) as f64 / 8.0))
                .collect();
            let corner =
                |face: usize, k: usize| (face + if face % 2 == 1 { 2 - k } else { k }) as u32;
            let faces: FaceList = (0..num_faces)
                .map(|face| [0, 1, 2].map(|k| corner(face, k)))
                .collect();
            let num_materials = materials.list.len();
            // The last choice stands for no material; some materials are not used by any face.
            let names: Vec<String> = materials.list.iter().map(|m| m.name.clone()).collect();
            let label = |face: usize| match usize::from(choices[face]) % (num_materials + 1) {
                k if k == num_materials => NONE,
                k => k as u32,
            };
            let mut attributes = Attributes::default();
            let labels: Vec<u32> = (0..num_faces).map(label).collect();
            if labels.iter().any(|&label| label != NONE) {
                attributes.labels.push(Labels {
                    kind: LabelKind::Material,
                    names,
                    faces: labels,
                });
            }
            if has_uv {
                attributes.corners.push(CornerProperty {
                    name: UV.to_owned(),
                    components: 2,
                    values: Values::F32(
                        (0..2 * (num_faces + 2)).map(|i| i as f32 / 64.0).collect(),
                    ),
                    indices: faces.corners().to_vec(),
                });
            }
            Document::new(positions, faces)
                .and_then(|document| document.with_attributes(attributes))
                .and_then(|document| document.with_materials(materials))
                .expect("no failure")
        },
    )
}

/// The appearance of a material with the images themselves instead of their indices, since two
/// lists may number them differently.
type Look = (Material, [Option<Vec<u8>>; 3]);

fn look(materials: &Materials, material: &Material) -> Look {
    let bytes = |image: Option<usize>| image.map(|image| materials.images[image].bytes().to_vec());
    let Material {
        base_color_texture,
        emission_texture,
        normal_texture,
        ..
    } = *material;
    let images = [base_color_texture, emission_texture, normal_texture].map(bytes);
    let plain = Material {
        base_color_texture: None,
        emission_texture: None,
        normal_texture: None,
        ..material.clone()
    };
    (plain, images)
}

/// The appearance of every face, by the positions of its corners, and of unused materials.
fn looks(document: &Document) -> (BTreeMap<Vec<[u64; 3]>, Option<Look>>, Vec<Look>) {
    let materials = document.materials().expect("no failure");
    let attributes = document.attributes().expect("no failure");
    let labels = attributes.label(LabelKind::Material);
    let mut of_faces = BTreeMap::new();
    let mut used = vec![false; materials.list.len()];
    for (face, corners) in document.faces().iter().enumerate() {
        let place = |&v: &u32| {
            let p = document.positions()[v as usize];
            [p.x, p.y, p.z].map(|x| (x + 0.0).to_bits())
        };
        let mut places: Vec<_> = corners.iter().map(place).collect();
        places.sort_unstable();
        let label = labels.map_or(NONE, |labels| labels.faces[face]);
        let material = materials.list.get(label as usize);
        if material.is_some() {
            used[label as usize] = true;
        }
        of_faces.insert(places, material.map(|material| look(&materials, material)));
    }
    let unused = materials.list.iter().zip(used).filter(|&(_, used)| !used);
    let unused = unused.map(|(material, _)| look(&materials, material));
    (of_faces, unused.collect())
}

/// The expected appearance after these losses.
fn expected((mut material, images): Look, losses: &[String]) -> Look {
    let is_lost = |words: &str| losses.iter().any(|loss| loss.contains(words));
    if is_lost("doubleSided") {
        material.is_double_sided = false;
    }
    if is_lost("opacity of opaque") && material.alpha == Alpha::Opaque {
        material.opacity = 1.0;
    }
    if is_lost("MASK") && matches!(material.alpha, Alpha::Mask(_)) {
        let shows = images[0].is_some() || material.opacity < 1.0;
        material.alpha = if shows { Alpha::Blend } else { Alpha::Opaque };
    }
    if is_lost("BLEND") && material.opacity >= 1.0 && images[0].is_none() {
        material.alpha = Alpha::Opaque;
    }
    if is_lost("names of materials") {
        material.name = String::new();
    }
    (material, images)
}

fn sorted(looks: Vec<Look>) -> Vec<String> {
    let mut texts: Vec<String> = looks.iter().map(|look| format!("{look:?}")).collect();
    texts.sort_unstable();
    texts
}

/// Compares a document with the one read from its file.
fn check(before: &Document, after: &Document, losses: &[String], format: Format) {
    let (faces, unused) = looks(before);
    let is_lost = |words: &str| losses.iter().any(|loss| loss.contains(words));
    if matches!(format, Format::Ply | Format::Off | Format::Stl) {
        let images = &before.materials().expect("no failure").images;
        assert!(is_lost("materials"), "{format}: {losses:?}");
        assert_eq!(is_lost("image"), !images.is_empty(), "{format}: {losses:?}");
        return;
    }
    let (new_faces, new_unused) = looks(after);
    assert_eq!(new_faces.len(), faces.len());
    let renamed =
        |look: Option<Look>| look.map(|(material, images)| expected((material, images), losses));
    for (places, look) in faces {
        let mut found = new_faces[&places].clone();
        if is_lost("names of materials") {
            found = found.map(|(material, images)| {
                (
                    Material {
                        name: String::new(),
                        ..material
                    },
                    images,
                )
            });
        }
        assert_eq!(found, renamed(look), "{format}: {losses:?}");
    }
    let unused = unused.into_iter().map(|look| expected(look, losses));
    let new_unused = new_unused.into_iter().map(|(material, images)| {
        let name = if is_lost("names of materials") {
            String::new()
        } else {
            material.name.clone()
        };
        (Material { name, ..material }, images)
    });
    assert_eq!(
        sorted(new_unused.collect()),
        sorted(unused.collect()),
        "{format}: {losses:?}"
    );
    // Texture coordinates are needed where there is a texture.
    let has_uv = |document: &Document| {
        let attributes = document.attributes().expect("no failure");
        attributes.corner(UV).is_some() || attributes.vertex(UV).is_some()
    };
    assert_eq!(has_uv(after), has_uv(before));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn every_format_keeps_materials_or_names_their_loss(document in document()) {
        for first in Format::ALL {
            let losses = document.losses(first);
            let once = through(&document, first);
            check(&document, &once, &losses, first);
            for second in [Format::Obj, Format::Gltf, Format::Glb] {
                let losses = once.losses(second);
                let twice = through(&once, second);
                if once.materials().expect("no failure").list.is_empty() {
                    continue;
                }
                check(&once, &twice, &losses, second);
            }
        }
    }

    #[test]
    fn edits_and_repairs_keep_materials(document in document(), by in prop::sample::select(vec![0.5, 2.0, 4.0])) {
        for format in [Format::Obj, Format::Gltf, Format::Glb] {
            let mut edited = through(&document, format);
            // The same file with every vertex moved.
            let surface = edited.surface().expect("no failure");
            let moved = surface.positions().map(|p| p * by);
            edited.set_positions(&surface, &moved).expect("no failure");
            let repaired = Repair::all().apply(&edited).expect("no failure").document;
            for kept in [&edited, &repaired] {
                let materials = kept.materials().expect("no failure");
                prop_assert_eq!(&materials, &through(&document, format).materials().expect("no failure"));
                for target in Format::ALL {
                    let losses = kept.losses(target);
                    // The libraries of an OBJ stay next to it unchanged.
                    let again = match target == format && format == Format::Obj {
                        true => continue,
                        false => through(kept, target),
                    };
                    check(kept, &again, &losses, target);
                }
            }
        }
    }
}

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nimage";

const MESH: &str = "mtllib my stuff.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0.25\nvt 1 0\nvt 0 1\n\
    usemtl wood\nf 1/1 3/3 2/2\nusemtl red\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 3/1 1/2 4/3\n";

const LIBRARY: &str = "newmtl red\nKa 0 0 0\nKd 0.9 0.1 0\nd 0.5\nNs 250\n\
    newmtl wood\nKd 1 1 1\nPm 0\nPr 0.75\nmap_Kd tex/oak plank.png\nmap_Bump ../outside.png\n";

/// An OBJ with its library and an image in a subfolder.
fn put(folder: &std::path::Path) {
    std::fs::create_dir_all(folder.join("tex")).expect("no failure");
    std::fs::write(folder.join("a.obj"), MESH).expect("no failure");
    std::fs::write(folder.join("my stuff.mtl"), LIBRARY).expect("no failure");
    std::fs::write(folder.join("tex/oak plank.png"), PNG).expect("no failure");
}

fn open(path: std::path::PathBuf) -> Document {
    load_with(&path, &Limits::default(), &Folder::of(&path)).expect("no failure")
}

fn names(folder: &std::path::Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("no failure");
    let mut names: Vec<String> = entries
        .map(|entry| {
            entry
                .expect("no failure")
                .file_name()
                .into_string()
                .expect("no failure")
        })
        .collect();
    names.sort_unstable();
    names
}

#[test]
fn an_obj_takes_its_materials_into_a_glb_and_out_again() {
    let folder = tempfile::tempdir().expect("no failure");
    let at = |name: &str| folder.path().join(name);
    put(&at("in"));
    let document = open(at("in/a.obj"));
    let losses = document.losses(Format::Glb);
    assert_eq!(
        losses,
        ["the MTL statements Ka and map_bump will be lost in GLB"]
    );
    save(&document, at("b.glb")).expect("no failure");
    assert_eq!(names(folder.path()), ["b.glb", "in"]);

    // An independent reader sees the same.
    let (glb, blob) = {
        let gltf = gltf::Gltf::open(at("b.glb")).expect("no failure");
        (gltf.document, gltf.blob.expect("no failure"))
    };
    let materials: Vec<_> = glb.materials().collect();
    let found: Vec<_> = materials
        .iter()
        .map(|m| {
            (
                m.name().expect("no failure"),
                m.pbr_metallic_roughness().base_color_factor(),
            )
        })
        .collect();
    let expected = [("wood", [1.0; 4]), ("red", [0.9, 0.1, 0.0, 0.5])];
    assert_eq!(found, expected);
    let texture = materials[0].pbr_metallic_roughness().base_color_texture();
    match texture.expect("no failure").texture().source().source() {
        gltf::image::Source::View { view, mime_type } => {
            assert_eq!(mime_type, "image/png");
            assert_eq!(&blob[view.offset()..view.offset() + view.length()], PNG);
        }
        gltf::image::Source::Uri { .. } => panic!("the image is not in the file"),
    }
    let roughness = |m: &gltf::Material<'_>| m.pbr_metallic_roughness().roughness_factor();
    assert_eq!(
        materials.iter().map(roughness).collect::<Vec<_>>(),
        [0.75, 0.5]
    );
    // Pointing down, as in glTF.
    let primitive = glb
        .meshes()
        .next()
        .expect("no failure")
        .primitives()
        .next()
        .expect("no failure");
    let reader = primitive.reader(|_| Some(blob.as_slice()));
    let uvs: Vec<[f32; 2]> = reader
        .read_tex_coords(0)
        .expect("no failure")
        .into_f32()
        .collect();
    assert!(
        uvs.contains(&[0.0, 0.75]) && !uvs.contains(&[0.0, 0.25]),
        "{uvs:?}"
    );

    std::fs::create_dir(at("out")).expect("no failure");
    let again = open(at("b.glb"));
    let saved = save(&again, at("out/c d.obj")).expect("no failure");
    assert_eq!(saved.left, Vec::<String>::new());
    let expected = ["c d.obj", "c_d.mtl", "c_d_oak_plank.png"];
    assert_eq!(names(&at("out")), expected);
    let last = open(at("out/c d.obj"));
    let lists =
        [&document, &again, &last].map(|document| document.materials().expect("no failure").list);
    assert_eq!(lists[0], lists[1]);
    assert_eq!(lists[0], lists[2]);
    assert_eq!(
        std::fs::read(at("out/c_d_oak_plank.png")).expect("no failure"),
        PNG
    );
    let text = std::fs::read_to_string(at("out/c d.obj")).expect("no failure");
    assert!(
        text.contains("mtllib c_d.mtl\n") && text.contains("vt 0 0.25\n"),
        "{text}"
    );
}

#[test]
fn an_obj_that_stays_one_takes_its_library_along() {
    let folder = tempfile::tempdir().expect("no failure");
    let at = |name: &str| folder.path().join(name);
    put(&at("in"));
    let document = open(at("in/a.obj"));
    // In its own folder everything is already in place.
    let saved = save(&document, at("in/b.obj")).expect("no failure");
    assert_eq!((saved.copied.len(), saved.left.len()), (0, 0));
    std::fs::create_dir(at("out")).expect("no failure");
    let saved = save(&document, at("out/b.obj")).expect("no failure");
    assert_eq!(names(&at("out")), ["b.obj", "my stuff.mtl", "tex"]);
    assert_eq!(names(&at("out/tex")), ["oak plank.png"]);
    assert_eq!(saved.copied.len(), 2);
    assert_eq!(saved.left.len(), 1, "{:?}", saved.left);
    assert!(saved.left[0].contains("../outside.png"), "{:?}", saved.left);
    assert_eq!(
        std::fs::read_to_string(at("out/b.obj")).expect("no failure"),
        MESH
    );
    assert_eq!(
        open(at("out/b.obj")).materials().expect("no failure"),
        document.materials().expect("no failure")
    );

    // The same with other attributes, which require a new file.
    let attributes = document.attributes().expect("no failure").into_owned();
    let made = document
        .clone()
        .with_attributes(attributes)
        .expect("no failure");
    assert_eq!(made.losses(Format::Obj), Vec::<String>::new());
    std::fs::create_dir(at("made")).expect("no failure");
    save(&made, at("made/b.obj")).expect("no failure");
    assert_eq!(names(&at("made")), ["b.obj", "my stuff.mtl", "tex"]);

    // Never over another file.
    std::fs::create_dir(at("taken")).expect("no failure");
    std::fs::write(at("taken/my stuff.mtl"), "newmtl other").expect("no failure");
    let error = save(&document, at("taken/b.obj")).unwrap_err().to_string();
    assert!(error.contains("my stuff.mtl"), "{error}");
    assert_eq!(names(&at("taken")), ["my stuff.mtl"]);
    let glb = document.write(Format::Glb).expect("no failure");
    std::fs::write(at("b.glb"), glb).expect("no failure");
    std::fs::write(at("taken/b.mtl"), "newmtl other").expect("no failure");
    save(&open(at("b.glb")), at("taken/b.obj")).unwrap_err();
    assert_eq!(names(&at("taken")), ["b.mtl", "my stuff.mtl"]);
}

#[test]
fn what_is_missing_is_named_and_no_error() {
    let folder = tempfile::tempdir().expect("no failure");
    let at = |name: &str| folder.path().join(name);
    std::fs::create_dir(at("out")).expect("no failure");
    std::fs::write(at("a.obj"), MESH).expect("no failure");
    let document = open(at("a.obj"));
    let losses = document.losses(Format::Glb);
    assert_eq!(losses.len(), 1);
    assert!(
        losses[0].starts_with("the materials of `my stuff.mtl` ("),
        "{losses:?}"
    );
    assert!(document.losses(Format::Obj).is_empty());
    let saved = save(&document, at("out/a.obj")).expect("no failure");
    assert!(
        saved.left.len() == 1 && saved.left[0].contains("my stuff.mtl"),
        "{:?}",
        saved.left
    );
    save(&document, at("a.glb")).expect("no failure");
    let names: Vec<String> = open(at("a.glb"))
        .materials()
        .expect("no failure")
        .list
        .into_iter()
        .map(|m| m.name)
        .collect();
    assert_eq!(names, ["wood", "red"]);

    // A library outside the folder is not opened.
    put(&at("in"));
    let outside = MESH.replace("my stuff.mtl", "../in/my stuff.mtl");
    std::fs::write(at("out/b.obj"), outside).expect("no failure");
    let document = open(at("out/b.obj"));
    assert!(document.materials().expect("no failure").list.is_empty());
    assert!(document.losses(Format::Glb)[0].contains("only files in the folder of the mesh"));
    // Without a resolver no library is opened.
    let document = cotan_io::load(at("in/a.obj")).expect("no failure");
    assert!(document.materials().expect("no failure").list.is_empty());
    assert_eq!(document.losses(Format::Glb).len(), 1);
}
