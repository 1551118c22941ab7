//! Tests of files made of another's vertices and faces.

use super::*;
use crate::attributes::{NONE, UV};
use crate::document::Document;
use crate::faces::FaceList;

fn parse(bytes: impl AsRef<[u8]>) -> Document {
    open(bytes.as_ref().to_vec(), &Limits::default()).unwrap()
}

fn rebuilt(document: &Document, remap: &Remap) -> String {
    let written = document.remapped(remap, Vec::new()).unwrap();
    String::from_utf8(written.write(Format::Ply).unwrap()).unwrap()
}

fn list(faces: &[&[u32]]) -> FaceList {
    faces.iter().collect()
}

const HEADER: &str = "ply\r\nformat ascii 1.0\r\ncomment kept  as it is\r\nelement camera 1\r\n\
    property float f\r\nelement  vertex 5\r\nproperty float x\r\nproperty float y\r\n\
    property float z\r\nproperty uchar q\r\nelement face 2\r\nproperty uchar flag\r\n\
    property list uchar uchar vertex_indices\r\nproperty list uchar float texcoord\r\n\
    property list uchar int tags\r\nelement edge 3\r\nproperty int vertex1\r\nproperty int w\r\n\
    property int vertex2\r\nobj_info kept too\r\nend_header\r\n";
const CAMERA: &str = "45.0\r\n";
const ROWS: &str = "0 0 0 10 extra\r\n9 9 9 11\r\n1.00 0 0 12\r\n\r\n1 1 0 13\r\n0 1 0 14\r\n\
    7 4 0 2 3 4 8 .0 0 1 0 1 1 0 1 2 5 6 and more\r\n8 3 2 3 1 6 1 0 1 1 5 5 1 9\r\n\
    0 100 2\r\n1 101 3\r\n3 102 4\r\nbehind the end";

#[test]
fn rows_follow_vertices_faces_and_corners() {
    let document = parse(format!("{HEADER}{CAMERA}{ROWS}"));
    // Vertex 1 is dropped and 2 duplicated; face 0 is cut in two, and a third closes a hole.
    let remap = Remap {
        vertices: vec![4, 0, 2, 3, 2],
        faces: list(&[&[1, 2, 3], &[0, 3, 1], &[4, 0, 1]]),
        face_sources: vec![0, 0, NONE],
        corner_sources: vec![0, 1, 2, 3, 2, 0, 6, 3, 0],
    };
    let header = HEADER
        .replace("face 2", "face 3")
        .replace("edge 3", "edge 2");
    let rows = "0 1 0 14\r\n0 0 0 10 extra\r\n1.00 0 0 12\r\n1 1 0 13\r\n1.00 0 0 12\r\n\
        7 3 1 2 3 6 .0 0 1 0 1 1 2 5 6 and more\r\n7 3 0 3 1 6 0 1 1 1 .0 0 2 5 6 and more\r\n\
        0 3 4 0 1 6 5 5 0 1 .0 0 0\r\n1 100 2\r\n3 102 0\r\nbehind the end\r\n";
    assert_eq!(
        rebuilt(&document, &remap),
        format!("{header}{CAMERA}{rows}")
    );
}

#[test]
fn what_does_not_fit_the_types_of_the_file_is_refused() {
    let document = parse(format!("{HEADER}{CAMERA}{ROWS}"));
    let refusal = |remap: &Remap| {
        let error = document.remapped(remap, Vec::new()).unwrap_err();
        error.to_string()
    };
    let many = Remap {
        vertices: vec![0; 257],
        faces: list(&[&[0, 1, 256]]),
        face_sources: vec![0],
        corner_sources: vec![0, 1, 2],
    };
    assert_eq!(
        refusal(&many),
        "vertex 256 in a file whose indices have the type `uchar` is not supported; save in \
         another format"
    );
    let round = Remap {
        faces: list(&[&[0; 300]]),
        corner_sources: vec![0; 300],
        ..many.clone()
    };
    assert!(refusal(&round).starts_with("a list of 300 numbers in a file whose lists"));
    let beyond = Remap {
        vertices: vec![5],
        ..Remap::default()
    };
    assert!(refusal(&beyond).starts_with("there is no vertex 5"));
}

#[test]
fn a_turned_face_takes_its_texture_along_in_binary() {
    let mut bytes = b"ply\nformat binary_big_endian 1.0\nelement face 1\n\
        property list uchar ushort vertex_index\nproperty list uchar float texcoord\n\
        element vertex 3\nproperty short x\nproperty short y\nproperty short z\nend_header\n"
        .to_vec();
    bytes.extend([3, 0, 0, 0, 1, 0, 2, 6]);
    (0u8..6).for_each(|x| bytes.extend(f32::from(x).to_be_bytes()));
    bytes.extend([0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0]);
    let document = parse(&bytes);
    let remap = Remap {
        vertices: vec![0, 1, 2],
        faces: list(&[&[2, 1, 0]]),
        face_sources: vec![0],
        corner_sources: vec![2, 1, 0],
    };
    let turned = document.remapped(&remap, Vec::new()).unwrap();
    let written = turned.write(Format::Ply).unwrap();
    assert_eq!(written.len(), bytes.len());
    let uv = |document: &Document| {
        let attributes = document.attributes().unwrap().into_owned();
        let uv = attributes.corner(UV).unwrap().clone();
        let value = |&i: &u32| uv.values.get(2 * i as usize).unwrap();
        uv.indices.iter().map(value).collect::<Vec<_>>()
    };
    assert_eq!(uv(&document), [0.0, 2.0, 4.0]);
    assert_eq!(uv(&parse(&written)), [4.0, 2.0, 0.0]);
}

const STRIPS: &str = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\n\
    property float y\nproperty float z\nelement tristrips 2\ncomment between\n\
    property list int int vertex_indices\nproperty uchar kind\nelement other 1\n\
    property int a\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";

#[test]
fn strips_are_unrolled_with_one_orientation() {
    // A restart, a strip that is too short, and a repeated corner, which keeps the alternation.
    let rows = "11 0 1 2 3 -1 4 5 -1 2 3 4 1\n6 0 1 1 2 3 5 2\n7\n";
    let text = format!("{STRIPS}{rows}");
    let mut document = parse(&text);
    let expected = [[0, 1, 2], [2, 1, 3], [2, 3, 4], [1, 2, 3], [3, 2, 5]];
    assert_eq!(document.faces().iter().collect::<Vec<_>>(), expected);
    assert_eq!(document.write(Format::Ply).unwrap(), text.as_bytes());
    assert_eq!(
        document.losses(Format::Stl)[..2],
        [
            "further properties of the element tristrips will be lost in STL",
            "the element other will be lost in STL",
        ]
    );
    document
        .set_position(5, nalgebra::Point3::new(1.0, 2.5, 0.0))
        .unwrap();
    assert_eq!(
        document.write(Format::Ply).unwrap(),
        text.replace("1 2 0\n11", "1 2.5 0\n11").as_bytes()
    );
}

#[test]
fn strips_become_faces_when_the_mesh_is_another() {
    let document = parse(format!("{STRIPS}4 0 1 2 3 1\n0 2\n7\n"));
    let remap = Remap {
        vertices: vec![3, 2, 1],
        faces: list(&[&[1, 2, 0]]),
        face_sources: vec![1],
        corner_sources: vec![3, 4, 5],
    };
    let expected = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\n\
        comment between\nelement other 1\nproperty int a\nend_header\n\
        1 1 0\n0 1 0\n1 0 0\n3 1 2 0\n7\n";
    assert_eq!(rebuilt(&document, &remap), expected);
}

#[test]
fn wrong_strips_are_refused() {
    let refusal = |rows: &str, limits: &Limits| {
        let text = format!("{STRIPS}{rows}");
        open(text.into_bytes(), limits).unwrap_err().to_string()
    };
    let all = Limits::default();
    assert_eq!(
        refusal("4 0 1 2 6 0\n", &all),
        "line 20: face 1 refers to vertex 6, but the vertices are numbered 0 to 5"
    );
    assert!(refusal("4 0 1 2 -2 0\n", &all).contains("refers to vertex -2"));
    let few = Limits {
        max_faces: 1,
        ..all
    };
    assert!(refusal("4 0 1 2 3 0\n", &few).starts_with("more than 1 faces"));
    let few = Limits {
        max_corners: 3,
        ..all
    };
    assert!(refusal("4 0 1 2 3 0\n", &few).starts_with("more than 3 face corners"));
    let text = STRIPS.replace("vertex_indices", "corners");
    let error = open(text.into_bytes(), &all).unwrap_err().to_string();
    assert!(
        error.contains("`tristrips` needs one list of integers"),
        "{error}"
    );
}

#[test]
fn faces_are_declared_where_there_were_none() {
    let text = "ply\rformat ascii 1.0\relement vertex 3\rproperty int x\rproperty int y\r\
                property int z\rend_header\r0 0 0\r1 0 0\r0 1 0";
    let remap = Remap {
        vertices: vec![0, 1, 2],
        faces: list(&[&[0, 1, 2]]),
        face_sources: vec![NONE],
        corner_sources: vec![NONE; 3],
    };
    let expected = text.replace(
        "end_header",
        "element face 1\rproperty list uchar int vertex_indices\rend_header",
    ) + "\r3 0 1 2\r";
    assert_eq!(rebuilt(&parse(text), &remap), expected);
}

#[test]
fn copies_of_a_long_row_are_bounded() {
    let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 3\n\
        property float x\nproperty float y\nproperty float z\nproperty list int uchar junk\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        .to_vec();
    for (vertex, length) in [(0u8, 100_000u32), (1, 0), (2, 0)] {
        bytes.extend([f32::from(vertex), 0.0, 0.0].map(f32::to_le_bytes).concat());
        bytes.extend(length.to_le_bytes());
        bytes.resize(bytes.len() + length as usize, 7);
    }
    bytes.push(3);
    (0u32..3).for_each(|v| bytes.extend(v.to_le_bytes()));
    let remap = Remap {
        vertices: vec![0; 5000],
        faces: list(&[&[0, 1, 2]]),
        face_sources: vec![0],
        corner_sources: vec![0; 3],
    };
    let refused = parse(&bytes).remapped(&remap, Vec::new()).unwrap_err();
    let refused = refused.to_string();
    assert!(refused.starts_with("a PLY of more than 67"), "{refused}");
}

#[test]
fn empty_lists_of_large_faces_are_bounded() {
    // One face with many corners whose lists are empty, and one whose lists are not.
    let (lists, degree) = (2000, 10_000);
    let mut text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nelement face 2\n\
        property list uint int vertex_indices\n"
        .to_owned();
    (0..lists).for_each(|i| text += &format!("property list uchar uchar l{i}\n"));
    text += "end_header\n0 0 0\n1 0 0\n0 1 0\n";
    text += &format!(
        "{degree}{}{}\n",
        " 0 1 2 1".repeat(degree / 4),
        " 0".repeat(lists)
    );
    let full = format!("{text}3 0 1 2{}\n", " 3 1 2 3".repeat(lists));
    let empty = format!("{text}3 0 1 2{}\n", " 0".repeat(lists));
    let remap = Remap {
        vertices: vec![0, 1, 2],
        faces: list(&[&[2, 1, 0]]),
        face_sources: vec![1],
        corner_sources: [2, 1, 0].map(|c| c + degree as u32).to_vec(),
    };
    let refused = parse(full).remapped(&remap, Vec::new()).unwrap_err();
    let refused = refused.to_string();
    assert!(refused.starts_with("more than 8"), "{refused}");
    assert!(rebuilt(&parse(empty), &remap).contains("\n3 2 1 0 0 0"));
}

#[test]
fn edges_follow_welded_vertices() {
    let text = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\n\
        property float y\nproperty float z\nelement face 1\n\
        property list uchar int vertex_indices\nelement edge 2\nproperty int vertex1\n\
        property int vertex2\nend_header\n0 0 0\n0 0 0\n1 0 0\n0 1 0\n3 1 2 3\n1 2\n0 3\n";
    // Vertex 1 is welded to vertex 0.
    let remap = Remap {
        vertices: vec![0, 2, 3],
        faces: list(&[&[0, 1, 2]]),
        face_sources: vec![0],
        corner_sources: vec![0, 1, 2],
    };
    let written = rebuilt(&parse(text), &remap);
    assert!(written.ends_with("\n3 0 1 2\n0 1\n0 2\n"), "{written}");
}

#[test]
fn a_rebuild_that_is_read_otherwise_is_refused() {
    // The same vertices, but the rebuilt mesh has other positions.
    let text = format!("{HEADER}{CAMERA}{ROWS}");
    let (parsed, file) = super::parse(text.into_bytes(), &Limits::NONE).unwrap();
    let positions = vec![nalgebra::Point3::new(7.0, 7.0, 7.0); parsed.positions.len()];
    let mesh = Mesh {
        positions: &positions,
        faces: &parsed.faces,
    };
    let remap = Remap::identity(positions.len(), &parsed.faces);
    let refused = file.rebuild(&remap, mesh).unwrap_err().to_string();
    assert!(
        refused.starts_with("this change of vertices and faces in this PLY is not supported"),
        "{refused}"
    );
}

#[test]
fn faces_without_texture_coordinates_lose_nothing() {
    use crate::attributes::{Attributes, CornerProperty, LabelKind, Labels, Values};
    let faces = list(&[&[0, 1, 2], &[0, 2, 1]]);
    let losses = |indices: Vec<u32>| {
        losses(&crate::contents::Contents {
            positions: vec![nalgebra::Point3::origin(); 3].into(),
            materials: crate::material::Materials::default(),
            faces: std::borrow::Cow::Borrowed(&faces),
            attributes: std::borrow::Cow::Owned(Attributes {
                corners: vec![CornerProperty {
                    name: UV.to_owned(),
                    components: 2,
                    values: Values::F32(vec![0.0; 2]),
                    indices,
                }],
                labels: vec![Labels {
                    kind: LabelKind::Object,
                    names: vec!["a".to_owned()],
                    faces: vec![0, 0],
                }],
                ..Attributes::default()
            }),
        })
    };
    let names = "the names of objects";
    assert_eq!(losses(vec![0, 0, 0, NONE, NONE, NONE]), [names]);
    assert_eq!(losses(vec![0, 0, 0, 0, NONE, NONE]).len(), 2);
}
