//! Tests of both forms of STL.

use nalgebra::Point3;

use super::*;
use crate::attributes::{Attributes, COLOR, LabelKind, NONE, NORMAL, Property, Values};
use crate::contents::Contents;
use crate::document::Document;
use crate::faces::FaceList;
use crate::format::Format;
use crate::remap::Remap;

/// A tetrahedron in two solids, the second with a NaN normal.
pub(super) const TEXT: &str = "solid a b \n facet normal 0 0 -1.0\n  outer loop\n   vertex 0 0 0\n   \
    vertex 0 1 0\n   vertex 1 -0 0\n  endloop\n endfacet\nfacet normal 0 -1 0 outer loop \
    vertex 0 0 0 vertex 1 0 0 vertex 0 0 1e0 endloop endfacet\nendsolid a b\n\
    Solid\r\nFACET NORMAL nan -nan(ind) 1.#QNAN\r\nOUTER LOOP\r\nVERTEX 1.0 0 0\r\n\
    Vertex 0 1 0\r\nvertex 0 0 +1\r\nendloop\r\nendfacet\r\nendsolid\r\n\n";

pub(super) fn load(bytes: impl Into<Vec<u8>>) -> Result<Document, IoError> {
    open(bytes.into(), &Limits::default())
}

fn refusal(bytes: impl Into<Vec<u8>>) -> String {
    load(bytes).unwrap_err().to_string()
}

/// Normal, corners and attribute bytes.
pub(super) type TestFacet = ([f32; 3], [[f32; 3]; 3], u16);

/// A binary file of these facets.
pub(super) fn binary(title: &str, facets: &[TestFacet]) -> Vec<u8> {
    let mut bytes = title.as_bytes().to_vec();
    bytes.resize(80, 0);
    bytes.extend((facets.len() as u32).to_le_bytes());
    for (normal, corners, attribute) in facets {
        let numbers = normal.iter().chain(corners.iter().flatten());
        bytes.extend(numbers.flat_map(|x| x.to_le_bytes()));
        bytes.extend(attribute.to_le_bytes());
    }
    bytes
}

pub(super) const O: [f32; 3] = [0.0; 3];
pub(super) const X: [f32; 3] = [1.0, 0.0, 0.0];
pub(super) const Y: [f32; 3] = [0.0, 1.0, 0.0];
pub(super) const Z: [f32; 3] = [0.0, 0.0, 1.0];

/// A tetrahedron.
pub(super) fn tetrahedron() -> Vec<u8> {
    binary(
        "solid that is binary",
        &[
            ([0.0, 0.0, -1.0], [O, Y, X], 0),
            ([0.0, -1.0, 0.0], [[-0.0; 3], X, Z], 7),
            ([-1.0, 0.0, 0.0], [O, Z, Y], 0),
            ([0.5, 0.5, 0.5], [X, Y, Z], 65535),
        ],
    )
}

pub(super) fn point(x: f64, y: f64, z: f64) -> Point3<f64> {
    Point3::new(x, y, z)
}

fn polygons(document: &Document) -> Vec<Vec<u32>> {
    document.faces().iter().map(<[u32]>::to_vec).collect()
}

#[test]
fn equal_positions_are_one_vertex() {
    for bytes in [TEXT.as_bytes().to_vec(), tetrahedron()] {
        let document = load(bytes.clone()).unwrap();
        let expected = [
            point(0.0, 0.0, 0.0),
            point(0.0, 1.0, 0.0),
            point(1.0, 0.0, 0.0),
            point(0.0, 0.0, 1.0),
        ];
        assert_eq!(document.positions(), expected);
        let faces = polygons(&document);
        assert_eq!(faces[..2], [vec![0, 1, 2], vec![0, 2, 3]]);
        assert_eq!(faces[faces.len() - 1], [2, 1, 3]);
        assert_eq!(document.write(Format::Stl).unwrap(), bytes);
        assert_eq!(document.format(), Some(Format::Stl));
        assert!(document.losses(Format::Stl).is_empty());
        assert!(document.surface().is_ok());
    }
}

#[test]
fn a_facet_with_a_corner_twice_stays_a_face() {
    let document = load(binary("", &[(Z, [O, X, X], 0), (Z, [O, O, O], 0)])).unwrap();
    assert_eq!(polygons(&document), [[0, 1, 1], [0, 0, 0]]);
}

#[test]
fn normals_attribute_bytes_and_solids_are_attributes() {
    let attributes = load(TEXT).unwrap().attributes().unwrap().into_owned();
    let normal = attributes.face(NORMAL).unwrap();
    assert_eq!(normal.values.get(2), Some(-1.0));
    assert!((6..9).all(|k| normal.values.get(k).unwrap().is_nan()));
    let labels = attributes.label(LabelKind::Object).unwrap();
    assert_eq!(labels.names, ["a b"]);
    assert_eq!(labels.faces, [0, 0, NONE]);

    let attributes = load(tetrahedron())
        .unwrap()
        .attributes()
        .unwrap()
        .into_owned();
    assert_eq!(attributes.faces.len(), 2);
    assert_eq!(
        attributes.face("attribute").unwrap().values,
        Values::U16(vec![0, 7, 0, 65535])
    );
    let without = load(binary("", &[(O, [O, X, Y], 0)])).unwrap();
    assert!(without.attributes().unwrap().is_empty());
    assert!(
        !without
            .losses(Format::Obj)
            .iter()
            .any(|l| l.contains("normal"))
    );
}

#[test]
fn the_form_is_told_by_size_and_content() {
    assert!(is_stl(&tetrahedron()));
    assert!(is_stl(TEXT.as_bytes()));
    for text in [
        "solid\nendsolid",
        "\u{feff}\n SOLID x\r\n\r\nFacet",
        "solid one line facet normal 0 0 0 outer",
    ] {
        assert!(is_stl(text.as_bytes()), "{text}");
    }
    let mut long = tetrahedron();
    long.extend([0; 37]);
    assert!(!is_stl(&long), "only its name tells");
    let document = load(long.clone()).unwrap();
    assert_eq!(
        document.warnings()[0].to_string(),
        "byte 284: 37 bytes follow the 4 facets that the header promises; they are kept but not read"
    );
    assert_eq!(document.write(Format::Stl).unwrap(), long);
    for other in [
        "",
        "solid",
        "solid\nv 0 0 0\n",
        "solids\nfacet",
        "# solid\nv 0 0 0\n",
        "OFF\n3 1 0\n",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# a comment that makes this file longer than a header\n",
    ] {
        assert!(!is_stl(other.as_bytes()), "{other}");
    }
    // A binary OFF: its zeros and small numbers could be any count.
    let mut off = b"OFF BINARY\n".to_vec();
    off.resize(80, 0);
    off.extend(1u32.to_le_bytes());
    off.resize(200, 0);
    assert!(!is_stl(&off));
}

#[test]
fn what_is_called_stl_is_read_as_one() {
    // A junk line after the name keeps the text from being recognized; a truncated binary has
    // another length.
    assert!(refusal("solid a\njunk\n").starts_with("line 2: found `junk` where `facet`"));
    assert!(
        refusal("<html></html>")
            .starts_with("byte 13: this is not an STL file: a text starts with")
    );
    let bytes = tetrahedron();
    assert!(!is_stl(&bytes[..200]));
    assert_eq!(
        refusal(&bytes[..200]),
        "byte 200: the file ends at facet 2, but 4 were promised; it was cut short"
    );
    let mut huge = bytes.clone();
    huge[80..84].copy_from_slice(&[255; 4]);
    assert_eq!(
        refusal(huge),
        "byte 284: the file ends at facet 4, but 4294967295 were promised; it was cut short"
    );
}

#[test]
fn refusals_name_line_facet_and_trouble() {
    let with = |old: &str, new: &str| refusal(TEXT.replacen(old, new, 1));
    assert_eq!(
        with("vertex 0 1 0", "vertex 0 blah 0"),
        "line 5: facet 0 has `blah` where a number is expected"
    );
    assert_eq!(
        with("normal 0 0 -1.0", "normal 0 x -1"),
        "line 2: facet 0 has `x` where a number is expected"
    );
    assert_eq!(
        with("vertex 0 0 +1", "vertex 0 0 +1 vertex 1 1 1"),
        "line 16: facet 2 has `vertex` where `endloop` is expected; a facet has three vertices"
    );
    assert_eq!(
        with("vertex 0 0 1e0", ""),
        "line 9: facet 1 has `endloop` where `vertex` is expected; a facet has three vertices"
    );
    assert_eq!(
        with("VERTEX 1.0 0", "vertex inf 0"),
        "line 14: vertex 4 has the coordinate inf, which is not a finite number"
    );
    assert_eq!(
        with("VERTEX 1.0 0", "vertex 1e999 0"),
        "line 14: vertex 4 has the coordinate 1e999, which is not a finite number"
    );
    assert_eq!(
        with("endsolid a b\n", "endsolid solid b facet normal"),
        "line 10: facets follow an `endsolid` on its line; start them on a new line"
    );
    assert!(with("Solid", "solo").starts_with("line 11: found `solo` where `solid`"));
    for (length, message) in [
        (150, "line 9: the file ends in facet 1"),
        (100, "line 7: the file ends in facet 0"),
        (128, "line 9: the file ends in facet 1"),
        (
            115,
            "line 8: the file ends after 1 facets without an `endsolid`",
        ),
    ] {
        let error = refusal(&TEXT[..length]);
        assert!(error.starts_with(message), "{length}: {error}");
    }
    for empty in ["solid\nendsolid\n".to_owned(), "\0".repeat(84)] {
        assert!(refusal(empty).starts_with("no vertices: this is an empty mesh"));
    }
    let mut nan = tetrahedron();
    nan[84 + 50 + 12 + 16..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(
        refusal(nan),
        "byte 162: vertex 3 has the coordinate NaN, which is not a finite number"
    );
}

#[test]
fn every_prefix_is_read_or_refused() {
    for bytes in [TEXT.as_bytes(), &tetrahedron()] {
        for length in 0..bytes.len() {
            let _ = is_stl(&bytes[..length]);
            if let Ok(document) = load(&bytes[..length]) {
                // Between two solids the end cannot be foreseen.
                assert!(
                    length + 40 > bytes.len() || document.faces().len() == 2,
                    "{length}"
                );
            }
        }
    }
}

#[test]
fn limits_hold_in_both_forms() {
    for bytes in [TEXT.as_bytes().to_vec(), tetrahedron()] {
        let faces = load(bytes.clone()).unwrap().faces().len();
        let with = |change: fn(&mut Limits)| {
            let mut limits = Limits {
                max_vertices: 4,
                max_faces: faces,
                max_corners: 3 * faces,
                max_degree: 3,
                ..Limits::default()
            };
            change(&mut limits);
            open(bytes.clone(), &limits).map_err(|error| error.to_string())
        };
        assert!(with(|_| {}).is_ok());
        let over = |change| with(change).unwrap_err();
        assert!(over(|l| l.max_vertices -= 1).starts_with("more than 3 vertices"));
        assert!(over(|l| l.max_faces -= 1).contains(" faces"));
        assert!(over(|l| l.max_corners -= 1).contains(" face corners"));
        assert!(over(|l| l.max_degree = 2).contains("corners of a face"));
        assert!(over(|l| l.max_memory = 400).contains("bytes of memory"));
    }
    let limits = Limits {
        max_line: 30,
        ..Limits::default()
    };
    let error = open(TEXT.into(), &limits).unwrap_err().to_string();
    assert!(error.starts_with("more than 30 bytes in a line"), "{error}");
}

#[test]
fn moved_vertices_are_replaced_in_every_facet() {
    let mut document = load(TEXT).unwrap();
    document.set_position(3, point(0.0, 0.0, 2.5)).unwrap();
    let written = String::from_utf8(document.write(Format::Stl).unwrap()).unwrap();
    let expected = TEXT
        .replace("vertex 0 0 1e0", "vertex 0 0 2.5")
        .replace("vertex 0 0 +1", "vertex 0 0 2.5");
    assert_eq!(written, expected);

    let bytes = tetrahedron();
    let mut document = load(bytes.clone()).unwrap();
    document.set_position(2, point(1.0, 1.0, 0.0)).unwrap();
    let written = document.write(Format::Stl).unwrap();
    let again = load(written.clone()).unwrap();
    assert_eq!(again.positions(), document.positions());
    assert_eq!(again.faces(), document.faces());
    // The facet without the vertex is unchanged, and so are title and attribute bytes.
    assert_eq!(written[184..234], bytes[184..234]);
    assert_eq!(written[..84], bytes[..84]);
    assert_eq!(written[282..], bytes[282..]);
    // The second facet is rotated from −y by an eighth of a turn, and its normal too.
    let normal = again
        .attributes()
        .unwrap()
        .face(NORMAL)
        .unwrap()
        .values
        .clone();
    let half = 0.5f64.sqrt();
    for (k, expected) in [half, -half, 0.0].into_iter().enumerate() {
        assert!((normal.get(3 + k).unwrap() - expected).abs() < 1e-6);
    }

    document.set_position(2, point(1e39, 1.0, 0.0)).unwrap();
    let error = document.write(Format::Stl).unwrap_err().to_string();
    assert!(
        error.starts_with("vertex 2: 1") && error.contains("does not fit the file's type `float`"),
        "{error}"
    );
}

/// The first facet reversed, the second dropped, vertex 1 a copy, and a new facet.
fn remap(document: &Document) -> Remap {
    let last = document.faces().len() as u32 - 1;
    Remap {
        vertices: vec![0, 1, 2, 3, 1],
        faces: [[2, 1, 0], [2, 4, 3], [3, 1, 2]].iter().collect(),
        face_sources: vec![0, last, NONE],
        corner_sources: vec![2, 1, 0, 3 * last, 3 * last + 1, 3 * last + 2, 5, 1, 3],
    }
}

#[test]
fn facets_are_gathered_with_what_they_have() {
    let document = load(TEXT).unwrap();
    let again = document.remapped(&remap(&document), Vec::new()).unwrap();
    let written = String::from_utf8(again.write(Format::Stl).unwrap()).unwrap();
    let expected = "solid a b \n facet normal 0 0 1.0\n  outer loop\n   vertex 1 -0 0\n   \
        vertex 0 1 0\n   vertex 0 0 0\n  endloop\n endfacet\nendsolid a b\n\
        Solid\r\nFACET NORMAL nan -nan(ind) 1.#QNAN\r\nOUTER LOOP\r\nVERTEX 1.0 0 0\r\n\
        Vertex 0 1 0\r\nvertex 0 0 +1\r\nendloop\r\nendfacet\r\nendsolid\r\n\
        solid a b \nfacet normal -0.5773502691896258 -0.5773502691896258 -0.5773502691896258\n\
        outer loop\nvertex 0 0 1\nvertex 0 1 0\nvertex 1 -0 0\nendloop\nendfacet\nendsolid a b\n\n";
    assert_eq!(written, expected);
    let attributes = again.attributes().unwrap();
    assert_eq!(
        attributes.label(LabelKind::Object).unwrap().faces,
        [0, NONE, 0]
    );
    // Moves work on the rebuilt file; the copy moves independently.
    let mut again = again.clone();
    again.set_position(4, point(0.0, 1.5, 0.0)).unwrap();
    let moved = String::from_utf8(again.write(Format::Stl).unwrap()).unwrap();
    assert_eq!(moved, written.replace("Vertex 0 1 0", "Vertex 0 1.5 0"));

    let document = load(tetrahedron()).unwrap();
    let again = document.remapped(&remap(&document), Vec::new()).unwrap();
    let third = -(1.0f32 / 3.0).sqrt();
    let expected = binary(
        "solid that is binary",
        &[
            ([0.0, 0.0, 1.0], [X, Y, O], 0),
            ([0.5, 0.5, 0.5], [X, Y, Z], 65535),
            ([third; 3], [Z, Y, X], 0),
        ],
    );
    assert_eq!(again.write(Format::Stl).unwrap(), expected);
    assert_eq!(again.attributes().unwrap().faces.len(), 2);

    let mut quad = remap(&document);
    quad.faces = [&[2, 1, 0][..], &[2, 4, 3, 0]].into_iter().collect();
    let error = document
        .remapped(&quad, Vec::new())
        .unwrap_err()
        .to_string();
    assert!(
        error.starts_with("a face of 4 corners in an STL is not supported"),
        "{error}"
    );
}

#[test]
fn a_remap_that_keeps_everything_keeps_every_byte() {
    for bytes in [TEXT.as_bytes().to_vec(), tetrahedron()] {
        let document = load(bytes.clone()).unwrap();
        let remap = Remap::identity(document.positions().len(), document.faces());
        let again = document.remapped(&remap, Vec::new()).unwrap();
        assert_eq!(again.write(Format::Stl).unwrap(), bytes);
    }
    // Empty solids are kept too, and a file without line endings stays readable.
    for text in [
        "solid x\nendsolid\nsolid a facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 \
         vertex 0 1 0 endloop endfacet endsolid a\nsolid z\nendsolid z",
        "solid a facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop \
         endfacet endsolid a",
    ] {
        let document = load(text).unwrap();
        let remap = Remap::identity(3, document.faces());
        let again = document.remapped(&remap, Vec::new()).unwrap();
        assert_eq!(again.write(Format::Stl).unwrap(), text.as_bytes());
    }
}

#[test]
fn a_vertex_that_was_welded_away_takes_its_new_position() {
    let document = load(TEXT).unwrap();
    let mut remap = Remap::identity(4, document.faces());
    remap.faces = [[0, 1, 2], [0, 2, 1], [2, 1, 3]].iter().collect();
    let again = document.remapped(&remap, Vec::new()).unwrap();
    let written = String::from_utf8(again.write(Format::Stl).unwrap()).unwrap();
    assert_eq!(written, TEXT.replace("vertex 0 0 1e0", "vertex 0 1 0"));
}

#[test]
fn a_new_file_is_binary_and_says_what_is_lost() {
    let file =
        "# c\no part\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0.1 2 0\nv 9 9 9\nvt 0 0\nf 1/1 2/1 3/1 4/1\n";
    let document = crate::read(file, None, &Limits::default()).unwrap();
    let written = document.write(Format::Stl).unwrap();
    assert_eq!(written.len(), 84 + 2 * 50);
    assert!(written.starts_with(b"cotan\0"));
    assert!(is_stl(&written));
    let again = load(written).unwrap();
    assert_eq!((again.positions().len(), again.faces().len()), (4, 2));
    assert_eq!(again.positions()[3].x, f64::from(0.1f32));
    let normals = again
        .attributes()
        .unwrap()
        .face(NORMAL)
        .unwrap()
        .values
        .clone();
    assert_eq!(normals, Values::F32(vec![0.0, 0.0, 1.0, 0.0, 0.0, 1.0]));
    let losses = document.losses(Format::Stl);
    for expected in [
        "a vertex that no face uses",
        "digits of coordinates",
        "a polygon (it becomes",
    ] {
        assert!(
            losses.iter().any(|l| l.starts_with(expected)),
            "{expected}: {losses:?}"
        );
    }
    let far = Document::new(
        vec![
            point(0.0, 0.0, 0.0),
            point(1e39, 0.0, 0.0),
            point(0.0, 1.0, 0.0),
        ],
        [[0u32, 1, 2]].iter().collect(),
    )
    .unwrap();
    let error = far.write(Format::Stl).unwrap_err().to_string();
    assert!(error.starts_with("vertex 1: 1"), "{error}");
}

#[test]
fn losses_name_the_attributes() {
    let property = |name: &str, components, values| Property {
        name: name.into(),
        components,
        values,
    };
    let attributes = Attributes {
        vertices: vec![property("quality", 1, Values::F32(vec![0.0; 3]))],
        faces: vec![
            property(NORMAL, 3, Values::F64(vec![1.0, 0.0, 0.0])),
            property(COLOR, 3, Values::U8(vec![1, 2, 3])),
            property("attribute", 1, Values::U16(vec![1])),
        ],
        comments: vec!["c".into()],
        ..Attributes::default()
    };
    let positions = vec![
        point(0.0, 0.0, 0.0),
        point(1.0, 0.0, 0.0),
        point(0.0, 1.0, 0.0),
    ];
    let faces: FaceList = [[0u32, 1, 2]].iter().collect();
    let contents = Contents {
        materials: crate::material::Materials::default(),
        positions: positions.into(),
        faces: std::borrow::Cow::Owned(faces),
        attributes: std::borrow::Cow::Owned(attributes),
    };
    assert_eq!(
        losses(&contents),
        [
            "the vertex property quality",
            "the face property color",
            "a comment"
        ]
    );
    let again = load(write_new(&contents).unwrap()).unwrap();
    let attributes = again.attributes().unwrap();
    assert_eq!(
        attributes.face(NORMAL).unwrap().values,
        Values::F32(vec![1.0, 0.0, 0.0])
    );
    assert_eq!(
        attributes.face("attribute").unwrap().values,
        Values::U16(vec![1])
    );
}
