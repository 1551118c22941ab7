//! Tests of all kinds of libraries, found by a resolver in memory.

use std::collections::BTreeMap;
use std::io::{Error, ErrorKind};
use std::sync::Arc;

use super::*;
use crate::attributes::{LabelKind, Labels};
use crate::limits::Limits;
use crate::material::{Alpha, Image, Material, Materials};
use crate::resolve::Resolve;

/// Files by name.
#[derive(Clone, Debug, Default)]
struct Files(BTreeMap<String, Vec<u8>>);

impl Files {
    fn new(files: &[(&str, &[u8])]) -> Self {
        let files = files.iter();
        Self(
            files
                .map(|&(name, bytes)| (name.to_owned(), bytes.to_vec()))
                .collect(),
        )
    }
}

impl Resolve for Files {
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let bytes = self.0.get(uri).ok_or(ErrorKind::NotFound)?;
        if bytes.len() as u64 > max_bytes {
            return Err(ErrorKind::FileTooLarge.into());
        }
        Ok(bytes.clone())
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

const PNG: &[u8] = b"\x89PNG\r\n\x1a\nimage";
const JPEG: &[u8] = b"\xff\xd8\xff\xe0image";

fn read_from(lines: &[&str], names: &[&str], files: &Files) -> Materials {
    let lines: Vec<String> = lines.iter().map(|&line| line.to_owned()).collect();
    let limits = Limits::default();
    let libraries = Libraries::read(&lines, files, &limits);
    let labels = Labels {
        kind: LabelKind::Material,
        names: names.iter().map(|&name| name.to_owned()).collect(),
        faces: Vec::new(),
    };
    materials(&libraries, Some(&labels), files, &limits)
}

/// The materials of a library, in its order.
fn read(text: &[u8]) -> Materials {
    read_from(
        &["a.mtl"],
        &[],
        &Files::new(&[("a.mtl", text), ("wood.png", PNG), ("sub/sky.jpg", JPEG)]),
    )
}

fn others(materials: &Materials) -> Vec<&str> {
    materials.others.iter().map(String::as_str).collect()
}

#[test]
fn everything_that_the_model_holds_is_read() {
    let found = read(
        b"# by hand\r\nnewmtl blue sky #2\r\nKd 0.1 0.2 0.3 # colour\r\nKe 0.5 0 2\r\nd 0.25\r\n\
          Pr 0.75\r\nPm 1\r\nmap_Kd -s 1 1 1 wood.png\r\nmap_Ke .\\sub\\sky.jpg\r\nnorm wood.png\r\n\
          illum 2\r\nnewmtl plain",
    );
    let expected = Material {
        base_color: [0.1, 0.2, 0.3],
        opacity: 0.25,
        alpha: Alpha::Blend,
        metallic: 1.0,
        roughness: 0.75,
        emission: [0.5, 0.0, 2.0],
        base_color_texture: Some(0),
        emission_texture: Some(1),
        normal_texture: Some(0),
        ..Material::named("blue sky #2")
    };
    assert_eq!(found.list, [expected, Material::named("plain")]);
    let images = [("wood", PNG), ("sky", JPEG)];
    let images = images.map(|(name, bytes)| Image::new(name, bytes.to_vec()).unwrap());
    assert_eq!(found.images, images);
    assert_eq!(others(&found), Vec::<&str>::new());
}

#[test]
fn highlights_and_transparency_have_their_usual_meaning() {
    let found = read(
        b"newmtl a\nNs 1000\nTr 0.75\nnewmtl b\nNs 0\nd 1\nnewmtl c\nNs 250\nd 0.5\nTr 0.9\n\
          newmtl d\nmap_Kd wood.png\nmap_d wood.png\nnewmtl e\nmap_Ke wood.png\nKd 0.5\n",
    );
    let of = |k: usize| &found.list[k];
    assert_eq!((of(0).roughness, of(0).opacity), (0.0, 0.25));
    assert_eq!((of(1).roughness, of(1).alpha), (1.0, Alpha::Opaque));
    assert_eq!((of(2).roughness, of(2).opacity), (0.5, 0.5));
    assert_eq!((of(3).alpha, of(3).opacity), (Alpha::Blend, 1.0));
    assert_eq!((of(4).emission, of(4).base_color), ([1.0; 3], [0.5; 3]));
    assert_eq!(others(&found), Vec::<&str>::new());
    let found = read(b"newmtl a\nTr 1\nmap_Kd wood.png\n");
    assert_eq!(
        (found.list[0].opacity, found.list[0].alpha),
        (1.0, Alpha::Opaque)
    );
    assert_eq!(others(&found), ["the MTL statements Tr"]);
}

/// tobj panics on the first of these and rejects the library for the others.
#[test]
fn wrong_statements_cost_nothing_but_themselves() {
    for wrong in [
        "Kd 1 1",
        "Kd",
        "Kd 1 x 1",
        "Kd nan 0 0",
        "Kd spectral a.rfl",
        "Ke 1e99 0 0",
        "Ns",
        "Ns -",
        "d -halo 0.5",
        "d",
        "illum",
        "illum 256",
        "illum x",
        "map_Kd",
        "map_Kd   ",
        "norm",
        "bump",
        "map_Ns",
        "Pr x",
    ] {
        let text = format!("newmtl a\n{wrong}\nPm 0.5\nnewmtl b\nKd 0 0 1\n");
        let found = read(text.as_bytes());
        let numbers: Vec<_> = found
            .list
            .iter()
            .map(|m| (m.metallic, m.base_color))
            .collect();
        assert_eq!(
            numbers,
            [(0.5, [1.0; 3]), (0.0, [0.0, 0.0, 1.0])],
            "{wrong}"
        );
        let text = format!("line 2 of `a.mtl`, which is wrong (`{}`),", wrong.trim());
        assert_eq!(others(&found), [text], "{wrong}");
    }
    let found = read(b"Kd 1 1\nnewmtl\nKd 1 0 0\nnewmtl a\nKd 0 1\nKd\n\xff\xfe\x00 1\n");
    assert_eq!(found.list.len(), 2);
    assert!(others(&found)[0].starts_with("3 lines of `a.mtl` that are wrong, first line 2"));
}

#[test]
fn what_is_not_carried_over_is_named_once() {
    let found = read(
        b"newmtl a\nKa 1 1 1\nKs 0 0 0\nillum 4\nmap_Bump -bm 0.5 wood.png\nmap_Kd -clamp on wood.png\n\
          newmtl b\nKa 0 0 0\nmap_d other.png\nNs 20\nPr 0.1\nKd 2 0 0\nmap_Kd -o 0.5 ../wood.png\n\
          newmtl b\nmap_Kd a.txt\n",
    );
    assert_eq!(
        others(&found),
        [
            "all materials but the last of the same name `b`",
            "numbers of materials beyond 0 to 1 (Kd)",
            "the MTL statements Ka, Ks, Ns, illum, map_bump and map_d",
            "the image `../wood.png` (only files in the folder of the mesh are opened) and \
             the image `a.txt` (there is no such file)",
            "the texture options -clamp and -o",
        ]
    );
}

#[test]
fn images_that_no_material_shows_are_left_out() {
    let found = read(
        b"newmtl a\nmap_Kd sub/sky.jpg\nnewmtl b\nnorm wood.png\nmap_d sub/sky.jpg\nnewmtl a\nPm 1\n",
    );
    let textures: Vec<_> = found
        .list
        .iter()
        .map(|m| m.textures().collect::<Vec<_>>())
        .collect();
    assert_eq!(textures, [vec![], vec![0]]);
    assert_eq!(found.images.len(), 1);
    assert_eq!(found.images[0].name, "wood");
}

#[test]
fn only_images_are_taken_for_images() {
    let files = Files::new(&[
        ("a.mtl", b"newmtl a\nmap_Kd a.png\nmap_Ke a.png\n"),
        ("a.png", b"GIF89a"),
    ]);
    let found = read_from(&["a.mtl"], &[], &files);
    assert_eq!(found.list[0].base_color_texture, None);
    assert!(found.images.is_empty());
    assert_eq!(
        others(&found),
        ["the image `a.png` (it is neither a PNG nor a JPEG)"]
    );
}

#[test]
fn libraries_are_found_by_every_way_of_naming_them() {
    let files = Files::new(&[
        ("a b.mtl", b"newmtl a\nKd 1 0 0"),
        ("c.mtl", b"newmtl c\nKd 0 0 1"),
        (
            "sub/d.mtl",
            b"newmtl d\nmap_Kd wood.png\nmap_Ke ../top.png\nnorm top.png",
        ),
        ("sub/wood.png", PNG),
        ("top.png", JPEG),
    ]);
    let names = |lines: &[&str]| -> Vec<String> {
        let found = read_from(lines, &[], &files);
        assert_eq!(others(&found), Vec::<&str>::new(), "{lines:?}");
        found.list.into_iter().map(|m| m.name).collect()
    };
    assert_eq!(names(&["a b.mtl"]), ["a"]);
    assert_eq!(names(&["a b.mtl c.mtl"]), ["a", "c"]);
    assert_eq!(names(&["c.mtl a b.mtl"]), ["c", "a"]);
    assert_eq!(names(&["c.mtl sub/d.mtl", "c.mtl"]), ["c", "d"]);
    assert_eq!(names(&["./c.mtl", "sub\\d.mtl"]), ["c", "d"]);
    let found = read_from(&["sub/d.mtl"], &[], &files);
    assert_eq!(found.images.len(), 2);
    assert_eq!(found.list[0].normal_texture, found.list[0].emission_texture);

    let found = read_from(&["c.mtl missing.mtl", "../c.mtl"], &["c"], &files);
    assert_eq!(found.list.len(), 1);
    assert_eq!(
        others(&found),
        [
            "the materials of `../c.mtl` (only files in the folder of the mesh are opened)",
            "the materials of `missing.mtl` (there is no such file)",
        ]
    );
}

#[test]
fn materials_stand_in_the_order_of_the_labels() {
    let files = Files::new(&[(
        "a.mtl",
        b"newmtl a\nPm 1\nnewmtl b\nPm 0.5\nnewmtl c\nPm 0.25",
    )]);
    let found = read_from(&["a.mtl"], &["c", "unknown", "a"], &files);
    let found: Vec<_> = found
        .list
        .iter()
        .map(|m| (m.name.as_str(), m.metallic))
        .collect();
    let expected = [("c", 0.25), ("unknown", 0.0), ("a", 1.0), ("b", 0.5)];
    assert_eq!(found, expected);
    assert!(read_from(&["b.mtl"], &["c"], &files).list.is_empty());
}

#[test]
fn libraries_and_images_keep_within_the_limits() {
    let text = b"newmtl a\nmap_Kd wood.png\n".repeat(40);
    let files = Files::new(&[("a.mtl", &text), ("wood.png", PNG)]);
    let read = |limits: Limits| {
        let libraries = Libraries::read(&["a.mtl".to_owned()], &files, &limits);
        materials(&libraries, None, &files, &limits)
    };
    let limits = Limits::default();
    assert_eq!(read(limits).images.len(), 1);
    let few = Limits {
        max_memory: 1 << 10,
        ..limits
    };
    assert!(read(few).list.is_empty() && !read(few).others.is_empty());
    let files_only = Files::new(&[
        ("a.mtl", b"newmtl a\nmap_Kd big.png\n"),
        ("big.png", &PNG.repeat(9)),
    ]);
    let limits = Limits {
        max_bytes: 40,
        ..limits
    };
    let libraries = Libraries::read(&["a.mtl".to_owned()], &files_only, &limits);
    let found = materials(&libraries, None, &files_only, &limits);
    assert_eq!((found.list.len(), found.images.len()), (1, 0));
    assert!(others(&found)[0].starts_with("the image `big.png`"));
}

#[test]
fn a_written_library_reads_back_the_same() {
    let image = |name: &str| Image::new(name, PNG.to_vec()).unwrap();
    let written = Materials {
        list: vec![
            Material {
                base_color: [0.1, 1.0, 1e-20],
                opacity: 0.3,
                alpha: Alpha::Blend,
                metallic: 0.7,
                roughness: 0.123_456_79,
                emission: [0.0, 30.5, 0.25],
                base_color_texture: Some(0),
                emission_texture: Some(1),
                normal_texture: Some(1),
                ..Material::named("blue sky #2\\")
            },
            Material::named("plain"),
            Material {
                alpha: Alpha::Blend,
                base_color_texture: Some(1),
                ..Material::named("cut out")
            },
        ],
        images: vec![image("x_a"), image("x_b")],
        ..Materials::default()
    };
    assert_eq!(losses(&written), Vec::<String>::new());
    let files = ["x_a.png".to_owned(), "x_b.png".to_owned()];
    let text = write(&written, &material_names(&written), &files);
    let files = Files::new(&[
        ("a.mtl", text.as_bytes()),
        ("x_a.png", PNG),
        ("x_b.png", PNG),
    ]);
    assert_eq!(read_from(&["a.mtl"], &[], &files), written);
}

#[test]
fn what_an_mtl_cannot_say_is_named() {
    let of = |material: Material| {
        losses(&Materials {
            list: vec![material],
            ..Materials::default()
        })
    };
    let plain = || Material::named("a");
    assert!(of(plain()).is_empty());
    let found = of(Material {
        is_double_sided: true,
        ..plain()
    });
    assert_eq!(found, ["the display of back faces (doubleSided)"]);
    let found = of(Material {
        alpha: Alpha::Mask(0.5),
        ..plain()
    });
    assert_eq!(found, ["the alpha cutoffs of materials (alphaMode MASK)"]);
    let found = of(Material {
        alpha: Alpha::Blend,
        ..plain()
    });
    assert_eq!(found.len(), 1);
    let found = of(Material {
        opacity: 0.5,
        ..plain()
    });
    assert_eq!(found, ["the opacity of opaque materials"]);
    for name in ["", " a", "(null)", "a\nb"] {
        assert_eq!(of(Material::named(name)).len(), 1, "{name:?}");
    }
}
