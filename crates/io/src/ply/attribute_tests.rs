//! Tests of attributes decoded on request, and of normals rotated with the surface.

use nalgebra::Point3;

use super::*;
use crate::attributes::{COLOR, NONE, NORMAL, Property, UV, Values};
use crate::document::Document;

fn parse(bytes: impl AsRef<[u8]>) -> Document {
    open(bytes.as_ref().to_vec(), &Limits::default()).unwrap()
}

/// Coordinates and normals interleaved and out of order, all properties with conventional names,
/// an empty texture list, Latin-1 in a comment.
pub(super) const RICH: &[u8] =
    b"ply\r\nformat ascii 1.0\r\ncomment  two  blanks \r\nobj_info caf\xe9\r\ncomment\r\n\
    element vertex 4\nproperty float nz\nproperty double x\nproperty float nx\nproperty double y\n\
    property float ny\nproperty double z\nproperty uchar red\nproperty uchar green\n\
    property uchar blue\nproperty uchar alpha\nproperty float t\nproperty float s\n\
    property float quality\nproperty list uchar short l\nproperty float normal\n\
    element face 2\nproperty int nx\nproperty list uchar int vertex_indices\n\
    property list uchar float texcoord\nproperty int ny\nproperty int nz\nproperty uchar flag\n\
    property float r\nproperty float g\nproperty float b\nelement edge 1\nproperty int vertex1\n\
    end_header\n\
    1 0 0 0 0 0 255 1 2 3 0.25 0.5 nan 0 9\n\
    1 1 0 0 0 0 255.0 1 2 3 0.25 0.5 1.#IND 2 -7 8 9\n\
    1 1 0 1 0 0 0 1 2 3 .1 1. 1e400 0 9\n\
    1 0 0 1 0 0 0 1 2 3 0.25 0.5 -inf 1 5 9 trailing\n\
    0 3 0 1 2 6 0 0 1 0 1 1 0 1 7 0.5 0 1\n\
    0 3 0 2 3 0 0 1 8 1 1 1\n\
    0\n";

fn lists(values: &Values) -> (&[usize], &Values) {
    match values {
        Values::Lists { ends, items } => (ends, items),
        _ => panic!("{values:?} are no lists"),
    }
}

#[test]
fn properties_come_in_their_own_types_under_the_names_common_to_formats() {
    let document = parse(RICH);
    let attributes = document.attributes().unwrap();
    assert_eq!(attributes.misfit(4, 2, 6), None);
    let names = |properties: &[Property]| -> Vec<(String, usize)> {
        let name = |p: &Property| (p.name.clone(), p.components);
        properties.iter().map(name).collect()
    };
    let expected = [
        (NORMAL, 3),
        (COLOR, 4),
        (UV, 2),
        ("quality", 1),
        ("l", 1),
        ("normal_", 1),
    ];
    let expected = expected.map(|(name, components)| (name.to_owned(), components));
    assert_eq!(names(&attributes.vertices), expected);
    let expected = [(NORMAL, 3), (COLOR, 3), ("flag", 1)];
    let expected = expected.map(|(name, components)| (name.to_owned(), components));
    assert_eq!(names(&attributes.faces), expected);

    let normal = attributes.vertex(NORMAL).unwrap();
    assert_eq!(normal.values, Values::F32([0.0, 0.0, 1.0].repeat(4)));
    let Values::U8(color) = &attributes.vertex(COLOR).unwrap().values else {
        panic!("colours are of type uchar");
    };
    assert_eq!(color[4..8], [255, 1, 2, 3]);
    let Values::F32(uv) = &attributes.vertex(UV).unwrap().values else {
        panic!("texture coordinates are of type float");
    };
    assert_eq!(uv[..6], [0.5, 0.25, 0.5, 0.25, 1.0, 0.1]);
    let Values::F32(quality) = &attributes.vertex("quality").unwrap().values else {
        panic!("the quality is of type float");
    };
    assert!(quality[0].is_nan() && quality[1].is_nan());
    assert_eq!(quality[2..], [f32::INFINITY, f32::NEG_INFINITY]);
    let l = lists(&attributes.vertex("l").unwrap().values);
    assert_eq!(l, (&[0, 2, 2, 3][..], &Values::I16(vec![-7, 8, 5])));

    let uv = attributes.corner(UV).unwrap();
    assert_eq!(uv.values, Values::F32(vec![0., 0., 1., 0., 1., 1.]));
    assert_eq!(uv.indices, [0, 1, 2, NONE, NONE, NONE]);
    assert_eq!(attributes.comments, [" two  blanks ", "caf\u{e9}", ""]);
    assert_eq!(
        document.losses(Format::Stl)[0],
        "the element edge will be lost in STL"
    );
}

#[test]
fn what_is_wrong_is_named_when_it_is_needed() {
    let text = String::from_utf8_lossy(RICH).replace("255.0 1 2 3", "256 1 2 3");
    let error = parse(&text).attributes().unwrap_err().to_string();
    assert_eq!(
        error,
        "line 36: vertex 1 has `256` where a number of type `uchar` is expected"
    );
    let text = String::from_utf8_lossy(RICH).replace("3 0 1 2 6 0 0", "3 0 1 2 6 0 zero");
    let error = parse(&text).attributes().unwrap_err().to_string();
    assert_eq!(
        error,
        "line 39: face 0 has `zero` where a number of type `float` is expected"
    );
    // It is preserved nevertheless.
    assert_eq!(parse(&text).write(Format::Ply).unwrap(), text.as_bytes());
}

#[test]
fn lists_that_are_not_two_numbers_a_corner_stay_lists() {
    let text = String::from_utf8_lossy(RICH).replace("3 0 2 3 0 0", "3 0 2 3 1 9 0");
    let document = parse(&text);
    let attributes = document.attributes().unwrap();
    assert!(attributes.corners.is_empty());
    let (ends, _) = lists(&attributes.face("texcoord").unwrap().values);
    assert_eq!(ends, [6, 7]);
}

#[test]
fn normals_turn_where_they_stand() {
    // Turn the square upright about the y axis.
    let mut document = parse(RICH);
    for vertex in [1, 2] {
        let p = document.positions()[vertex];
        document
            .set_position(vertex, Point3::new(0.0, p.y, -1.0))
            .unwrap();
    }
    assert!(document.losses(Format::Ply).is_empty());
    let written = document.write(Format::Ply).unwrap();
    let expected = String::from_utf8_lossy(RICH)
        .replace("1 0 0 0 0 0 255", "0 0 1 0 0 0 255")
        .replace("1 1 0 0 0 0 255.0", "0 0 1 0 0 -1 255.0")
        .replace("1 1 0 1 0 0 0 1 2 3 .1", "0 0 1 1 0 -1 0 1 2 3 .1")
        .replace("1 0 0 1 0 0 0 1 2 3 0.25", "0 0 1 1 0 0 0 1 2 3 0.25")
        .replace(
            "0 3 0 1 2 6 0 0 1 0 1 1 0 1 7",
            "1 3 0 1 2 6 0 0 1 0 1 1 0 0 7",
        )
        .replace("0 3 0 2 3 0 0 1 8", "1 3 0 2 3 0 0 0 8");
    let found = String::from_utf8_lossy(&written);
    let rounded = found.lines().zip(expected.lines()).skip(30);
    for (found, expected) in rounded {
        for (a, b) in found.split(' ').zip(expected.split(' ')) {
            let close = match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(a), Ok(b)) if a.is_finite() => (a - b).abs() < 1e-6,
                _ => a == b,
            };
            assert!(close, "{found}\n{expected}");
        }
    }
}

/// A square with `float` normals and coordinates, interleaved, and faces with `short` normals.
fn binary(encoding: &str, number: impl Fn([u8; 4]) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat {encoding} 1.0\nelement vertex 4\nproperty float x\nproperty float nz\n\
         property float y\nproperty float ny\nproperty float z\nproperty float nx\n\
         property uchar q\nelement face 2\nproperty list uchar int vertex_index\n\
         property float nx\nproperty float ny\nproperty float nz\nend_header\n"
    )
    .into_bytes();
    for [x, y] in [[0.0f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]] {
        for value in [x, 1.0, y, 0.0, 0.0, 0.0] {
            bytes.extend(number(value.to_le_bytes()));
        }
        bytes.push(77);
    }
    for face in [[0i32, 1, 2], [0, 2, 3]] {
        bytes.push(3);
        for v in face {
            bytes.extend(number(v.to_le_bytes()));
        }
        for value in [0.0f32, 0.0, 1.0] {
            bytes.extend(number(value.to_le_bytes()));
        }
    }
    bytes
}

#[test]
fn normals_turn_in_both_byte_orders() {
    let reversed = |mut b: [u8; 4]| {
        b.reverse();
        b
    };
    for bytes in [
        binary("binary_little_endian", |b| b),
        binary("binary_big_endian", reversed),
    ] {
        let mut document = parse(&bytes);
        assert_eq!(document.write(Format::Ply).unwrap(), bytes);
        for vertex in [1, 2] {
            let p = document.positions()[vertex];
            document
                .set_position(vertex, Point3::new(0.0, p.y, -1.0))
                .unwrap();
        }
        let written = document.write(Format::Ply).unwrap();
        assert_eq!(written.len(), bytes.len());
        let again = parse(&written);
        assert_eq!(again.positions(), document.positions());
        let (found, expected) = (again.attributes().unwrap(), document.attributes().unwrap());
        assert_eq!(found.vertices, expected.vertices);
        assert_eq!(found.faces, expected.faces);
        let normals = &found.vertex(NORMAL).unwrap().values;
        assert!((normals.get(0).unwrap() - 1.0).abs() < 1e-6);
        assert!((found.face(NORMAL).unwrap().values.get(3).unwrap() - 1.0).abs() < 1e-6);
        assert_eq!(found.vertex("q").unwrap().values, Values::U8(vec![77; 4]));
    }
}
