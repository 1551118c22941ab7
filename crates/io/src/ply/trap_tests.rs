//! Tests of malicious files, and of names that would break a header.

use std::time::{Duration, Instant};

use nalgebra::Point3;
use ply_rs::parser::Parser;
use ply_rs::ply::DefaultElement;

use super::*;
use crate::attributes::{
    COLOR, CornerProperty, LabelKind, Labels, NONE, NORMAL, Property, UV, Values,
};
use crate::document::Document;
use crate::faces::FaceList;

fn parse(bytes: impl AsRef<[u8]>) -> Result<Document, IoError> {
    open(bytes.as_ref().to_vec(), &Limits::default())
}

fn refusal(bytes: impl AsRef<[u8]>) -> String {
    parse(bytes).unwrap_err().to_string()
}

const VERTEX: &str = "property float x\nproperty float y\nproperty float z\n";

/// Counts that no file can satisfy fail immediately, in every encoding.
#[test]
fn huge_counts_end_at_once() {
    let clock = Instant::now();
    for encoding in ["ascii", "binary_little_endian", "binary_big_endian"] {
        let header = |elements: &str| {
            let text = format!("ply\nformat {encoding} 1.0\n{elements}end_header\n");
            refusal(text + "0 0 0 0 0 0 0 0 0")
        };
        let bare = header(&format!(
            "element x 100000000000\nelement vertex 1\n{VERTEX}"
        ));
        assert!(bare.contains("100000000000 of element `x` have no properties"));
        let many = header(&format!("element vertex 4000000000\n{VERTEX}"));
        assert!(many.contains("4000000000 of element `vertex` are promised"));
        let lists = "property list uchar int vertex_indices\n";
        let many = header(&format!(
            "element vertex 1\n{VERTEX}element face 18446744073709551615\n{lists}"
        ));
        assert!(many.contains("of element `face` are promised"), "{many}");
    }
    assert!(clock.elapsed() < Duration::from_secs(1));
}

#[test]
fn list_lengths_are_bounded_before_anything_is_taken() {
    let header = |encoding: &str, length: &str| {
        format!(
            "ply\nformat {encoding} 1.0\nelement vertex 1\n{VERTEX}property list {length} double l\n\
             element face 1\nproperty list {length} int vertex_indices\nend_header\n"
        )
    };
    let text = |rows: &str| refusal(header("ascii", "int") + rows);
    assert_eq!(
        text("0 0 0 999999999999999999 1 2\n"),
        "line 11: vertex 0 has 6 numbers; it needs 7"
    );
    assert!(text("0 0 0 0\n999999999999999999 0 0 0\n").starts_with("more than 1048576 corners"));
    assert!(text("0 0 0 -1\n").starts_with("line 11: vertex 0 has `-1` where the length"));
    let binary = |length: &str, vertex: &[u8], face: &[u8]| {
        let mut bytes = header("binary_little_endian", length).into_bytes();
        bytes.extend([0; 12]);
        bytes.extend(vertex);
        bytes.extend(face);
        refusal(bytes)
    };
    let cut = binary("uint", &[255; 4], &[0; 4]);
    assert!(cut.contains("the file ends at vertex 0"), "{cut}");
    let negative = binary("int", &[255; 4], &[0; 4]);
    assert!(negative.contains("vertex 0 has `bytes ff ff ff ff` where the length of a list"));
    let degree = binary("uint", &[0; 4], &[255; 4]);
    assert!(degree.starts_with("more than 1048576 corners of a face"));
    let degree = binary("uint", &[0; 4], &[255, 0, 0, 0, 1]);
    assert!(degree.contains("refers to vertex") || degree.contains("the file ends at face 0"));
}

#[test]
fn limits_hold_for_lines_corners_degrees_and_memory() {
    let square = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    let text =
        format!("ply\nformat ascii 1.0\n{square}0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n");
    let binary = parse(&text).unwrap();
    let binary = Document::new(binary.positions().to_vec(), binary.faces().clone()).unwrap();
    let binary = binary.write(Format::Ply).unwrap();
    for bytes in [text.into_bytes(), binary] {
        let refused = |limits: Limits| open(bytes.clone(), &limits).map_err(|e| e.to_string());
        let all = Limits::default();
        assert!(refused(all).is_ok());
        for (limits, what) in [
            (
                Limits {
                    max_vertices: 3,
                    ..all
                },
                "more than 3 vertices",
            ),
            (
                Limits {
                    max_faces: 1,
                    ..all
                },
                "more than 1 faces",
            ),
            (
                Limits {
                    max_corners: 5,
                    ..all
                },
                "more than 5 face corners",
            ),
            (
                Limits {
                    max_degree: 2,
                    ..all
                },
                "more than 2 corners of a face",
            ),
            (
                Limits {
                    max_line: 37,
                    ..all
                },
                "more than 37 bytes in a line",
            ),
            (
                Limits {
                    max_memory: bytes.len() as u64 + 163,
                    ..all
                },
                "more than ",
            ),
        ] {
            let error = refused(limits).unwrap_err();
            assert!(error.starts_with(what), "{error}");
        }
    }
    let long = format!("ply\nformat ascii 1.0\n{square}0 0 0 {}\n", "1 ".repeat(50));
    let limits = Limits {
        max_line: 60,
        ..Limits::default()
    };
    let error = open(long.into_bytes(), &limits).unwrap_err().to_string();
    assert!(error.starts_with("more than 60 bytes in a line"), "{error}");
}

/// Files that exporters write but ply-rs rejects.
#[test]
fn odd_but_readable_files_are_read() {
    let text = b"ply\nformat ascii 1.0\ncomment caf\xe9 \x00\nelement vertex 3\nproperty float x\n\
        property float y\nproperty float z\nproperty float scalar_[<0.1](2)\n\
        property float 2nd#name\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n\n1. .5 -0 nan 1\n\n \t \n+1e0 0 0 -nan(ind) 2\n0 1 0 1.#QNAN 3\n\n3 0 1 2";
    let document = parse(text).unwrap();
    assert_eq!(document.positions()[0], Point3::new(1.0, 0.5, 0.0));
    let attributes = document.attributes().unwrap();
    assert_eq!(attributes.comments, ["caf\u{e9} \u{0}"]);
    let Values::F32(values) = &attributes.vertex("scalar_[<0.1](2)").unwrap().values else {
        panic!("they are of type float");
    };
    assert!(values.iter().all(|x| x.is_nan()));
    assert_eq!(
        attributes.vertex("2nd#name").unwrap().values,
        Values::F32(vec![1.0, 2.0, 3.0])
    );
    assert_eq!(document.write(Format::Ply).unwrap(), text);
}

#[test]
fn what_stands_twice_and_64_bits_are_refused() {
    let header = |elements: &str| {
        refusal(format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex 1\n{VERTEX}{elements}end_header\n"
        ))
    };
    let twice = "an element, or a property of an element, is declared twice";
    assert_eq!(header("property float x\n"), format!("line 7: {twice}"));
    assert_eq!(header("element vertex 1\n"), format!("line 7: {twice}"));
    assert_eq!(
        header("property uchar \u{e9}\nproperty char \u{e9}\n"),
        format!("line 8: {twice}")
    );
    for line in [
        "property int64 a",
        "property list uint64 int a",
        "property list uchar",
    ] {
        let error = header(&format!("{line}\n"));
        assert!(
            error.starts_with(&format!("line 7: `{line}` is not understood")),
            "{error}"
        );
    }
    assert!(
        header("element face 1\nproperty list float int vertex_indices\n")
            .ends_with("the length of list `vertex_indices` is not of an integer type")
    );
}

#[test]
fn a_wide_header_takes_time_in_proportion() {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex 1\n{VERTEX}");
    for i in 0..100_000 {
        text += &format!("property char p{i}\n");
    }
    text += "end_header\n0 0 0";
    text += &" 1".repeat(100_000);
    let clock = Instant::now();
    let document = parse(&text).unwrap();
    assert_eq!(document.attributes().unwrap().vertices.len(), 100_000);
    assert!(clock.elapsed() < Duration::from_secs(10));
    let limits = Limits {
        max_memory: 20 << 20,
        ..Limits::default()
    };
    let error = open(text.into_bytes(), &limits).unwrap_err().to_string();
    assert!(error.ends_with("bytes of memory; raise the limit if you trust the file"));
}

/// A face list that is mostly triangles, with quads, in rows that contain more than the list.
#[test]
fn bulk_and_single_rows_meet_without_a_seam() {
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex 5\n{VERTEX}element face 4\n\
         property uchar a\nproperty list uchar uint vertex_indices\nproperty short b\nend_header\n"
    );
    let faces: [&[u32]; 4] = [&[0, 1, 2], &[2, 3, 4], &[0, 1, 2, 3], &[1, 2, 3]];
    let mut bytes = header.into_bytes();
    (0..15u8).for_each(|x| bytes.extend(f32::from(x).to_le_bytes()));
    let start = bytes.len();
    for face in faces {
        bytes.extend([9, face.len() as u8]);
        face.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([1, 2]);
    }
    let document = parse(&bytes).unwrap();
    assert_eq!(document.faces().iter().collect::<Vec<_>>(), faces);
    let attributes = document.attributes().unwrap();
    assert_eq!(
        attributes.face("b").unwrap().values,
        Values::I16(vec![513; 4])
    );
    // The first error in file order is reported, with its row.
    let mut wrong = bytes.clone();
    wrong[start + 16 + 2] = 5;
    wrong[start + 34] = 7;
    assert_eq!(
        refusal(&wrong),
        format!(
            "byte {}: face 1 refers to vertex 5, but the vertices are numbered 0 to 4",
            start + 16
        )
    );
    let mut wrong = bytes.clone();
    wrong[start - 5 * 12 + 27] = 0xff;
    wrong[start - 5 * 12 + 26] = 0xff;
    assert!(refusal(&wrong).contains("vertex 2 has the coordinate NaN"));
    assert!(refusal(&bytes[..start + 20]).contains("the file ends at face 1"));
    assert!(refusal(&bytes[..start - 20]).contains("vertex"));
}

fn property(name: &str, components: usize, values: Values) -> Property {
    Property {
        name: name.to_owned(),
        components,
        values,
    }
}

#[test]
fn names_and_comments_never_break_a_header() {
    let points = vec![
        Point3::origin(),
        Point3::new(1.0, 0.0, 0.0),
        Point3::new(0.0, 1.0, 0.0),
    ];
    let faces: FaceList = [[0, 1, 2]].iter().collect();
    let vertices = vec![
        property("x", 1, Values::U8(vec![1, 2, 3])),
        property("nx", 1, Values::U8(vec![4, 5, 6])),
        property("alpha", 1, Values::U8(vec![7, 8, 9])),
        property("a b\nend_header\n", 1, Values::U8(vec![10, 11, 12])),
        property("", 1, Values::U8(vec![13, 14, 15])),
        property("tangent", 4, Values::F32(vec![0.5; 12])),
        property("wide", 20, Values::I8(vec![3; 60])),
        property(COLOR, 3, Values::U8(vec![255; 9])),
        property(COLOR, 3, Values::U8(vec![16; 9])),
        property(NORMAL, 3, Values::F32(vec![1.0; 9])),
        property(UV, 3, Values::F32(vec![2.0; 9])),
    ];
    let lists = Values::Lists {
        ends: vec![300],
        items: Box::new(Values::U32(vec![9; 300])),
    };
    let of_faces = vec![
        property("vertex_index", 1, lists),
        property("texcoord", 1, Values::U8(vec![3])),
    ];
    let attributes = Attributes {
        vertices,
        faces: of_faces,
        corners: vec![
            CornerProperty {
                name: NORMAL.to_owned(),
                components: 3,
                values: Values::F32(vec![0.0; 3]),
                indices: vec![0, 0, NONE],
            },
            CornerProperty {
                name: UV.to_owned(),
                components: 3,
                values: Values::F32(vec![1.0, 2.0, 3.0]),
                indices: vec![0, NONE, 0],
            },
        ],
        labels: vec![Labels {
            kind: LabelKind::Material,
            names: vec!["m".to_owned()],
            faces: vec![0],
        }],
        comments: vec!["one\nelement face 9\r".to_owned(), " two".to_owned()],
        libraries: vec!["m.mtl".to_owned()],
    };
    let document = Document::new(points, faces)
        .unwrap()
        .with_attributes(attributes)
        .unwrap();
    let losses = document.losses(Format::Ply);
    assert_eq!(
        losses,
        [
            "the corner property normal will be lost in PLY",
            "further components of the texture coordinates will be lost in PLY",
            "the lack of texture coordinates at corners whose face has some elsewhere will be \
             lost in PLY",
            "materials will be lost in PLY",
            "the material libraries will be lost in PLY",
        ]
    );
    let bytes = document.write(Format::Ply).unwrap();
    let ply = Parser::<DefaultElement>::new()
        .read_ply(&mut bytes.as_slice())
        .unwrap();
    let names: Vec<&str> = ply.header.elements["vertex"]
        .properties
        .keys()
        .map(|k| &**k)
        .collect();
    let expected = "x y z x_2 nx_2 alpha_2 a_b_end_header_ _ tangent_0 tangent_1 tangent_2 \
                    tangent_3 wide red green blue color_0 color_1 color_2 nx ny nz uv_0 uv_1 uv_2";
    assert_eq!(names.join(" "), expected);
    let names: Vec<&str> = ply.header.elements["face"]
        .properties
        .keys()
        .map(|k| &**k)
        .collect();
    assert_eq!(
        names,
        ["vertex_indices", "vertex_index_2", "texcoord_2", "texcoord"]
    );
    let again = parse(&bytes).unwrap();
    let attributes = again.attributes().unwrap();
    assert_eq!(attributes.comments, ["one element face 9 ", " two"]);
    let uv = attributes.corner(UV).unwrap();
    assert_eq!(uv.values, Values::F32(vec![1.0, 2.0, 0.0, 0.0]));
    assert_eq!(uv.indices, [0, 1, 0]);
    assert_eq!(
        attributes.vertex(COLOR).unwrap().values,
        Values::U8(vec![255; 9])
    );
}

/// Files that developers have in a folder next to the workspace; it need not exist.
#[test]
fn real_files_come_back_byte_by_byte_also_rebuilt() {
    let mut num_files = 0;
    for folder in ["meshes", "malformed"]
        .into_iter()
        .filter_map(cotan_testing::shared)
    {
        let entries = std::fs::read_dir(folder).unwrap();
        for path in entries.map(|entry| entry.unwrap().path()) {
            if path.extension().is_none_or(|extension| extension != "ply") {
                continue;
            }
            let bytes = std::fs::read(&path).unwrap();
            let Ok(document) = parse(&bytes) else {
                continue;
            };
            num_files += 1;
            assert!(document.write(Format::Ply).unwrap() == bytes, "{path:?}");
            let attributes = document.attributes().unwrap();
            let anew = Document::new(document.positions().to_vec(), document.faces().clone());
            let anew = anew
                .unwrap()
                .with_attributes(attributes.clone().into_owned())
                .unwrap();
            let again = parse(anew.write(Format::Ply).unwrap()).unwrap();
            assert_eq!(again.positions(), document.positions(), "{path:?}");
            assert_eq!(again.attributes().unwrap(), attributes, "{path:?}");
            let identity = Remap::identity(document.positions().len(), document.faces());
            let same = document.remapped(&identity, Vec::new()).unwrap();
            let same = parse(same.write(Format::Ply).unwrap()).unwrap();
            assert_eq!(same.positions(), document.positions(), "{path:?}");
            assert_eq!(same.faces(), document.faces(), "{path:?}");
            assert_eq!(same.attributes().unwrap(), attributes, "{path:?}");
        }
    }
    eprintln!("{num_files} files");
}
