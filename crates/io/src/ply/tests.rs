//! Tests of reading and of patching in place.

use super::*;
use crate::attributes::Values;
use crate::document::Document;
use crate::faces::FaceList;
use nalgebra::Point3;
use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Property};

fn parse(bytes: impl AsRef<[u8]>) -> Result<Document, IoError> {
    open(bytes.as_ref().to_vec(), &Limits::default())
}

fn refusal(bytes: impl AsRef<[u8]>) -> String {
    parse(bytes).unwrap_err().to_string()
}

const HEADER: &str = "comment made by hand\nelement camera 1\nproperty list uchar short k\n\
    element vertex 3\nproperty list uchar int neighbours\nproperty float y\n\
    property uchar red\nproperty double x\nproperty short z\n\
    element face 1\nproperty uchar flag\nproperty list int uint vertex_index\nend_header\n";

fn text() -> String {
    format!(
        "ply\nformat ascii 1.0\n{HEADER}2 7 -8\n\n0 0.5 255 0 0\n2 1 2 0 0 1 0\r\n \
         1 0 1.5 0 0 -3\n1 3 0 1 2\n"
    )
}

/// The rows of `text` as binary; `swap` produces the byte order.
fn binary(encoding: &str, swap: fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = format!("ply\nformat {encoding} 1.0\n{HEADER}").into_bytes();
    let mut push = |number: &[u8]| {
        let mut number = number.to_vec();
        swap(&mut number);
        bytes.extend(number);
    };
    push(&[2]);
    push(&7i16.to_le_bytes());
    push(&(-8i16).to_le_bytes());
    let rows: [(&[i32], f32, u8, f64, i16); 3] = [
        (&[], 0.5, 255, 0.0, 0),
        (&[1, 2], 0.0, 0, 1.0, 0),
        (&[0], 1.5, 0, 0.0, -3),
    ];
    for (neighbours, y, red, x, z) in rows {
        push(&[neighbours.len() as u8]);
        neighbours.iter().for_each(|v| push(&v.to_le_bytes()));
        push(&y.to_le_bytes());
        push(&[red]);
        push(&x.to_le_bytes());
        push(&z.to_le_bytes());
    }
    push(&[1]);
    push(&3i32.to_le_bytes());
    (0u32..3).for_each(|v| push(&v.to_le_bytes()));
    bytes
}

fn all() -> [Vec<u8>; 3] {
    [
        text().into_bytes(),
        binary("binary_little_endian", |_| {}),
        binary("binary_big_endian", <[u8]>::reverse),
    ]
}

#[test]
fn odd_layouts_read_alike_in_every_encoding() {
    for bytes in all() {
        let document = parse(&bytes).unwrap();
        let expected = [[0.0, 0.5, 0.0], [1.0, 0.0, 0.0], [0.0, 1.5, -3.0]].map(Point3::from);
        assert_eq!(document.positions(), expected);
        assert_eq!(document.faces().iter().collect::<Vec<_>>(), [[0, 1, 2]]);
        let losses = document.losses(Format::Obj);
        assert!(losses[0].starts_with("the element camera"), "{losses:?}");
        let attributes = document.attributes().unwrap();
        assert_eq!(attributes.vertices.len(), 2);
        assert_eq!(
            attributes.vertex("red").unwrap().values,
            Values::U8(vec![255, 0, 0])
        );
        assert_eq!(attributes.face("flag").unwrap().values, Values::U8(vec![1]));
        assert_eq!(document.write(Format::Ply).unwrap(), bytes);
    }
}

#[test]
fn a_rewrite_changes_coordinates_alone_and_keeps_their_types() {
    let position = Point3::new(0.1, 0.1, -32768.0);
    for bytes in all() {
        let mut document = parse(&bytes).unwrap();
        document.set_position(1, position).unwrap();
        let written = document.write(Format::Ply).unwrap();
        let again = parse(&written).unwrap();
        assert_eq!(again.positions()[1].x, 0.1);
        assert_eq!(again.positions()[1].y as f32, 0.1f32);
        assert_eq!(again.positions()[1].z, -32768.0);

        document
            .set_position(1, Point3::new(0.0, 1e39, 0.0))
            .unwrap();
        let error = document.write(Format::Ply).unwrap_err().to_string();
        assert!(
            error.starts_with("vertex 1: ") && error.contains("`float`"),
            "{error}"
        );
        for z in [0.5, 32768.0, 1e300] {
            document.set_position(1, Point3::new(0.0, 0.0, z)).unwrap();
            let error = document.write(Format::Ply).unwrap_err().to_string();
            assert!(error.contains("`short`"), "{error}");
            assert!(document.write(Format::Off).is_ok());
        }
    }
    let mut document = parse(text()).unwrap();
    document.set_position(1, position).unwrap();
    let written = String::from_utf8(document.write(Format::Ply).unwrap()).unwrap();
    assert_eq!(
        written,
        text().replace("2 1 2 0 0 1 0\r\n", "2 1 2 0.1 0 0.1 -32768\r\n")
    );
}

#[test]
fn ply_rs_reads_the_same_numbers() {
    for bytes in all().into_iter().skip(1) {
        let ply = Parser::<DefaultElement>::new()
            .read_ply(&mut bytes.as_slice())
            .unwrap();
        let document = parse(&bytes).unwrap();
        for (vertex, p) in ply.payload["vertex"].iter().zip(document.positions()) {
            assert_eq!(vertex["x"], Property::Double(p.x));
            assert_eq!(vertex["y"], Property::Float(p.y as f32));
            assert_eq!(vertex["z"], Property::Short(p.z as i16));
        }
    }
}

#[test]
fn ply_rs_reads_what_is_written_anew() {
    let mut points = vec![Point3::new(0.1, -2.0, 1e-300); 300];
    points[7].x = f64::MAX;
    let long: Vec<u32> = (0..300).collect();
    for faces in [
        vec![vec![0, 1, 2], vec![3, 2, 1, 0]],
        vec![vec![0, 1, 2], long],
    ] {
        let faces: FaceList = faces.iter().collect();
        let made = Document::new(points.clone(), faces.clone()).unwrap();
        let bytes = made.write(Format::Ply).unwrap();
        let ply = Parser::<DefaultElement>::new()
            .read_ply(&mut bytes.as_slice())
            .unwrap();
        for (vertex, p) in ply.payload["vertex"].iter().zip(&points) {
            assert_eq!(vertex["x"], Property::Double(p.x));
        }
        for (face, polygon) in ply.payload["face"].iter().zip(faces.iter()) {
            assert_eq!(face["vertex_indices"].to_u32_list().unwrap(), polygon);
        }
        let document = parse(bytes).unwrap();
        assert_eq!(
            (document.positions(), document.faces()),
            (&points[..], &faces)
        );
    }
}

#[test]
fn a_line_feed_behind_a_header_of_carriage_returns_is_data() {
    let header = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\r\
                  property uchar y\rproperty uchar z\rend_header\r";
    let document = parse([header.as_bytes(), &[10, 11, 12]].concat()).unwrap();
    assert_eq!(document.positions(), [Point3::new(10.0, 11.0, 12.0)]);
}

#[test]
fn refusals_name_line_element_and_trouble() {
    let vertex = "property float x\nproperty float y\nproperty float z\n";
    let with = |header: &str, rows: &str| {
        refusal(format!("ply\nformat ascii 1.0\n{header}end_header\n{rows}"))
    };
    let three = format!(
        "element vertex 3\n{vertex}element face 1\nproperty list uchar int vertex_indices\n"
    );
    let points = "0 0 0\n1 0 0\n0 1 0\n";
    let face = |row: &str| with(&three, &format!("{points}{row}"));
    assert_eq!(
        face("3 0 1 3"),
        "line 13: face 0 refers to vertex 3, but the vertices are numbered 0 to 2"
    );
    assert_eq!(
        face("3 0 1 -1"),
        "line 13: face 0 refers to vertex -1, but the vertices are numbered 0 to 2"
    );
    assert_eq!(
        face("2 0 1"),
        "line 13: face 0 has 2 corners; a face needs three or more"
    );
    assert_eq!(
        face("-3 0 1 2"),
        "line 13: face 0 has `-3` where the length of a list is expected"
    );
    assert_eq!(face("3 0 1"), "line 13: face 0 has 3 numbers; it needs 4");
    assert_eq!(
        face("\n\n"),
        "line 14: the file ends at face 0, but 1 were promised; it was cut short"
    );
    assert!(
        with(&three, "0 0 0\n1 nan 0\n0 0 0\n3 0 1 2")
            .starts_with("line 11: vertex 1 has the coordinate nan")
    );
    assert!(with("element vertex 4000000000\n", "").contains("x, y and z"));
    assert!(
        with(&format!("element x 9\n{three}"), points)
            .contains("9 of element `x` have no properties")
    );
    assert!(
        with(
            &format!("{three}property float x\nproperty float x\n"),
            points
        )
        .contains("declared twice")
    );
    assert!(with(&format!("{three}element face 2\n"), points).contains("declared twice"));
    assert!(
        with("element vertex 99999999999999999999999\n", "")
            .starts_with("line 3: `element vertex 9999")
    );
    assert!(
        with("element vertex 1\nproperty real x\n", "")
            .starts_with("line 4: `property real x` is not understood")
    );
    assert!(with("property float x\n", "").starts_with("line 3: `property float x`"));
    assert!(with("", "").contains("no element `vertex`"));
    assert!(with(&format!("element vertex 0\n{vertex}"), "").starts_with("no vertices"));
    assert!(refusal("ply\nend_header\n").contains("format"));
    assert!(refusal("ply\nformat ascii 1.0\n").contains("cut short"));
    assert!(refusal("ply\nvertices 3\n").starts_with("line 2: `vertices 3` does not belong"));
    let [_, little, big] = all();
    for bytes in [little, big] {
        assert!(refusal(&bytes[..bytes.len() - 1]).contains("the file ends at face 0"));
    }
}
