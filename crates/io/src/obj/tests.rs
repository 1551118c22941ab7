//! Tests of reading: every form of a statement, and every error.

use nalgebra::Point3;

use super::*;
use crate::document::Document;

fn parse(text: &str) -> Result<Document, IoError> {
    open(text.as_bytes().to_vec(), &Limits::default())
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

#[test]
fn every_way_to_write_a_corner_means_the_same_vertex() {
    let text = "\u{feff}# square\r\nv 0 0 0 1\r\n\tv 1 0 0 0.5 nan 0.5\r\nv +1.0 1e0 .0\r\n\
                v 0 1 0 # the last\r\nvt 0 0\nvn 0 0 1\n\
                f 1 2 3#x\nf 1/1 2/1 3/1 4/1\nf 1//1 2//1 3//1\nf -4/-1/-1 -3/1/1 \\\r\n-2/1/1\n";
    let document = parse(text).unwrap();
    assert_eq!(document.positions()[2], Point3::new(1.0, 1.0, 0.0));
    let faces: Vec<_> = document.faces().iter().collect();
    assert_eq!(
        faces,
        [&[0, 1, 2][..], &[0, 1, 2, 3], &[0, 1, 2], &[0, 1, 2]]
    );
    assert!(document.losses(Format::Obj).is_empty());
}

#[test]
fn a_face_may_stand_before_its_vertices() {
    let document = parse("f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap();
    assert_eq!(document.faces().get(0), Some(&[0, 1, 2][..]));
    assert!(
        refusal("f 1 2 3\nf 1 2 4\nv 0 0 0\nv 1 0 0\nv 0 1 0\n")
            .starts_with("line 2: face 1 refers to vertex 4")
    );
}

#[test]
fn a_comment_that_ends_in_a_backslash_swallows_nothing() {
    let document = parse("# C:\\meshes\\\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3").unwrap();
    assert_eq!(document.positions().len(), 3);
}

#[test]
fn refusals_name_line_element_and_trouble() {
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let with = |line: &str| refusal(&format!("{three}{line}\n"));
    assert_eq!(
        with("f 0 1 2"),
        "line 4: face 0 refers to vertex 0, but the vertices are numbered 1 to 3"
    );
    assert_eq!(
        with("f 1 2 -4"),
        "line 4: face 0 refers to vertex -4, but the vertices are numbered 1 to 3"
    );
    assert_eq!(
        with("f 1 2"),
        "line 4: face 0 has 2 corners; a face needs three or more"
    );
    assert_eq!(
        with("f 1 2 x"),
        "line 4: face 0 has `x` where a corner (v, v/vt, v//vn or v/vt/vn) is expected"
    );
    assert!(with("f 1 2/x 3").starts_with("line 4: face 0 has `2/x`"));
    assert!(with("f 1 2 99999999999999999999").starts_with("line 4: face 0 has"));
    assert_eq!(with("v 1 2"), "line 4: vertex 3 has 2 numbers; it needs 3");
    assert_eq!(
        with("v 1 2 x\u{7f}y"),
        "line 4: vertex 3 has `x\\u{7f}y` where a number is expected"
    );
    assert!(with("v 1 nan 3").starts_with("line 4: vertex 3 has the coordinate nan"));
    assert!(with("v 1 1e999 3").starts_with("line 4: vertex 3 has the coordinate 1e999"));
    assert!(refusal("").starts_with("no vertices"));
    assert!(refusal("<!DOCTYPE html>\n<p>404</p>").starts_with("no vertices"));
}

#[test]
fn moved_vertices_change_and_nothing_else_does() {
    let text =
        "v  0.10 \\\n 0\t0.0  1 # w\r\no box\nv 1 0 0\nv 0 1 0\nv 9 9 9\nvt 1 1\nf 1/1 2/1 3/1";
    let mut document = parse(text).unwrap();
    document
        .set_position(0, Point3::new(-0.5, 1e-30, 12345.0))
        .unwrap();
    document
        .set_position(2, Point3::new(0.1 + 0.2, 0.0, 0.0))
        .unwrap();
    let written = String::from_utf8(document.write(Format::Obj).unwrap()).unwrap();
    let expected = text
        .replace("0.10 \\\n 0\t0.0", "-0.5 \\\n 1e-30\t12345")
        .replace("v 0 1 0", "v 0.30000000000000004 0 0");
    assert_eq!(written, expected);
}

/// A strip of `quads` quads with relative indices, and its number of lines.
fn strip(quads: usize) -> (String, usize) {
    let mut text = "v 0 0 0\nv 0 1 0\n".to_owned();
    for k in 1..=quads {
        text += &format!("v {k} 0 0\nv {k}.123456 1 0\nf -4 -2 -1 -3\n");
    }
    (text, 2 + 3 * quads)
}

#[test]
fn long_files_are_read_in_pieces_and_errors_name_the_right_line() {
    let (text, lines) = strip(60_000);
    let document = parse(&text).unwrap();
    assert_eq!(document.faces().len(), 60_000);
    let last = document.faces().get(59_999);
    assert_eq!(last, Some(&[119_998, 120_000, 120_001, 119_999][..]));
    let with = |line: &str| refusal(&format!("{text}{line}\nv x\n"));
    let line = lines + 1;
    assert_eq!(
        with("f 1 2 -120003"),
        format!(
            "line {line}: face 60000 refers to vertex -120003, but the vertices are numbered 1 to 120002"
        )
    );
    assert!(with("f 1 2").starts_with(&format!("line {line}: face 60000 has 2 corners")));
    assert!(with("").starts_with(&format!("line {}: vertex 120002 has `x`", line + 1)));
    let forward = refusal(&format!("f 1 2 120003\n{text}f 1 2 120004\n"));
    assert_eq!(
        forward,
        "line 1: face 0 refers to vertex 120003, but the vertices are numbered 1 to 120002"
    );
    // The first of two errors, although both are encountered.
    let twice = text.replacen("v 7 0 0", "v 7 0", 1) + "f 1 2\n";
    assert!(refusal(&twice).starts_with("line 21: vertex 14 has 2 numbers"));
}

#[test]
fn limits_hold_in_every_piece() {
    let (text, _) = strip(60_000);
    let refused = |limits: Limits| {
        let error = open(text.clone().into_bytes(), &limits).unwrap_err();
        assert!(matches!(error, IoError::OverLimit { .. }), "{error}");
        error.to_string()
    };
    let some = Limits::default();
    let max_vertices = 100_000;
    assert!(
        refused(Limits {
            max_vertices,
            ..some
        })
        .starts_with("more than 100000 vertices")
    );
    let max_faces = 59_999;
    assert!(refused(Limits { max_faces, ..some }).starts_with("more than 59999 faces"));
    let max_corners = 239_999;
    assert!(
        refused(Limits {
            max_corners,
            ..some
        })
        .starts_with("more than 239999 face corners")
    );
    let max_degree = 3;
    assert!(refused(Limits { max_degree, ..some }).starts_with("more than 3 corners of a face"));
    let max_line = 17;
    assert!(refused(Limits { max_line, ..some }).starts_with("more than 17 bytes in a line"));
    let named = format!("{}f 1 2 3 4 5\n", "v 0 0 0\n".repeat(5)).into_bytes();
    let max_degree = 4;
    let error = open(named, &Limits { max_degree, ..some }).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("more than 4 corners of a face")
    );
    let max_memory = 4_000_000;
    assert!(
        refused(Limits { max_memory, ..some }).starts_with("more than 4000000 bytes of memory")
    );
}

#[test]
fn continued_lines_count_as_one_and_end_soon() {
    let corners = "1 \\\n2 \\\r\n3 \\\r".repeat(100_000);
    let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf {corners}1\nf 1 2 x\n");
    let error = refusal(&text);
    assert!(error.starts_with("line 300005: face 1 has `x`"), "{error}");
    let document = parse(&text.replace(" x", " 3")).unwrap();
    assert_eq!(document.faces().get(0).map(<[u32]>::len), Some(300_001));
    let limits = Limits {
        max_line: 1000,
        ..Limits::default()
    };
    let error = open(text.into_bytes(), &limits).unwrap_err().to_string();
    assert!(
        error.starts_with("more than 1000 bytes in a line"),
        "{error}"
    );
    let open = "\\\n".repeat(500_000);
    assert!(refusal(&open).starts_with("no vertices"));
}

#[test]
fn huge_indices_are_refused() {
    for index in ["4294967297", "999999999999999999", "-999999999999999999"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n");
        assert_eq!(
            refusal(&text),
            format!(
                "line 4: face 0 refers to vertex {index}, but the vertices are numbered 1 to 3"
            )
        );
    }
    for index in ["9223372036854775808", "6148914691236517206"] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 {index}\n");
        assert!(refusal(&text).starts_with(&format!("line 4: face 0 has `{index}`")));
    }
    // References other than vertices are checked only on request.
    let document = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1//6148914691236517206 2 3\n").unwrap();
    assert!(document.attributes().is_err());
}

#[test]
fn a_polygon_with_a_bridged_hole_stays_as_it_is_given() {
    let text = "v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 1 1 0\nv 1 2 0\nv 2 2 0\nv 2 1 0\n\
                f 1 2 3 4 1 5 6 7 8 5\n";
    let document = parse(text).unwrap();
    let face = [0, 1, 2, 3, 0, 4, 5, 6, 7, 4];
    assert_eq!(document.faces().get(0), Some(&face[..]));
    assert_eq!(document.write(Format::Obj).unwrap(), text.as_bytes());
}

#[test]
fn numbers_of_every_length_are_those_of_the_standard_library() {
    let numbers = [
        "1",
        "-0",
        "12345678",
        "123456789",
        "1234567.12345678",
        "0.123456789012345678",
        ".5",
        "-.5",
        "5.",
        "1e5",
        "-1.5E-3",
        "0.00000000000000000001",
        "99999999.5",
        "1234567.123456789012",
        "9007199254740993",
        "0.9007199254740993",
        "00000001.5",
        "+2",
        "1.7976931348623157e308",
    ];
    for x in numbers {
        // At the end of the file, where eight bytes may not be available, and before it.
        for behind in [
            "",
            "\n",
            " \r\n# behind the number\n",
            "\t1 0 0 # colour\nv 0 0 0\n",
        ] {
            let document = parse(&format!("v {x} {x} {x}{behind}")).unwrap();
            let expected: f64 = x.parse().unwrap();
            let found = document.positions()[0];
            assert!(
                found.iter().all(|y| y.to_bits() == expected.to_bits()),
                "{x}: {found}"
            );
        }
    }
}

#[test]
fn what_another_format_drops_is_named() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nl 1 2\np 1\ncstype bezier\nlod 1\nfoo\nbar 1\n";
    let document = parse(text).unwrap();
    let losses = document.losses(Format::Off);
    for what in [
        "2 lines and points (l, p)",
        "1 statements of free-form geometry",
        "1 display settings (lod, mg, …)",
        "2 statements that OBJ does not define",
    ] {
        assert!(losses.iter().any(|l| l.starts_with(what)), "{losses:?}");
    }
    let warnings: Vec<String> = document
        .warnings()
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(
        warnings,
        ["line 9: `foo` is not an OBJ statement; this line and 1 like it are kept unchanged"]
    );
}

#[test]
fn attributes_of_other_formats_are_written_or_named() {
    use crate::attributes::{COLOR, LabelKind, Labels, NONE, NORMAL, Property, UV, Values};

    let document = parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 3 2 1\nf 1 3 2\n").unwrap();
    let property = |name: &str, components, values| Property {
        name: name.to_owned(),
        components,
        values,
    };
    let attributes = Attributes {
        vertices: vec![
            property(COLOR, 3, Values::U8(vec![0, 51, 255, 1, 2, 3, 4, 5, 6])),
            property("weight", 1, Values::F32(vec![1.0; 3])),
            property(NORMAL, 3, Values::F32(vec![0.1; 9])),
            property(UV, 2, Values::F64(vec![0.5; 6])),
            property("quality", 1, Values::F32(vec![1.0; 3])),
        ],
        faces: vec![property(COLOR, 3, Values::U8(vec![1; 9]))],
        labels: vec![
            Labels {
                kind: LabelKind::Material,
                names: vec!["red".to_owned()],
                faces: vec![NONE, 0, NONE],
            },
            Labels {
                kind: LabelKind::Smoothing,
                names: vec!["1".to_owned()],
                faces: vec![0, 0, NONE],
            },
            Labels {
                kind: LabelKind::Group,
                names: vec!["arm\nleg\\".to_owned()],
                faces: vec![0, 0, NONE],
            },
        ],
        comments: vec!["one\ntwo".to_owned(), String::new()],
        ..Attributes::default()
    };
    assert_eq!(
        write::losses(&attributes),
        [
            "the vertex properties weight, quality",
            "the face property color"
        ]
    );
    let document = document.with_attributes(attributes).unwrap();
    let text = String::from_utf8(document.write(Format::Obj).unwrap()).unwrap();
    let expected = "# one\n# two\n#\nv 0 0 0 0 0.2 1\nv 1 0 0 0.003921569 0.007843138 0.011764706\n\
        v 0 1 0 0.015686275 0.019607844 0.023529412\nvt 0.5 0.5\nvt 0.5 0.5\nvt 0.5 0.5\n\
        vn 0.1 0.1 0.1\nvn 0.1 0.1 0.1\nvn 0.1 0.1 0.1\ng arm leg\\ \ns 1\nf 1/1/1 2/2/2 3/3/3\n\
        usemtl red\nf 3/3/3 2/2/2 1/1/1\ng\nusemtl (null)\ns off\nf 1/1/1 3/3/3 2/2/2\n";
    assert_eq!(text, expected);
}

#[test]
fn latin_1_names_survive_into_a_new_file() {
    let text = b"# M\xfcller\ng K\xf6rper\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let document = open(text.to_vec(), &Limits::default()).unwrap();
    let attributes = document.attributes().unwrap().into_owned();
    let new = document
        .clone()
        .with_attributes(attributes.clone())
        .unwrap();
    let written = new.write(Format::Obj).unwrap();
    assert!(written.starts_with("# Müller\n".as_bytes()));
    let again = open(written, &Limits::default()).unwrap();
    assert_eq!(*again.attributes().unwrap(), attributes);
    assert_eq!(document.write(Format::Obj).unwrap(), text);
}

#[test]
fn repairs_keep_the_lines_that_need_not_change() {
    let text = b"# K\xf6rper\r\nv 0 0 0 # a\r\nv 9 9 9\r\nv 1 0 0 1 0.5 0\r\nv 0 1 0\r\n\
        vt 0 0\r\nvt 1 0\r\nl 1 3 4\r\nl 1 2\r\np 2 3\r\ng \xe4\r\nf 1/1 3/2 \\\r\n 4 # first\r\n\
        g\r\nf 3/1  -4/2 4\r\nf 1 3 3\r\n";
    let document = open(text.to_vec(), &Limits::default()).unwrap();
    // Vertex 1 is dropped, vertex 2 is split. Face 1 is reversed and uses the copy, face 2 is
    // dropped, and face 0 occurs twice.
    let faces: crate::faces::FaceList = [[0u32, 1, 2], [2, 0, 3], [0, 1, 2]].iter().collect();
    let remap = Remap {
        vertices: vec![0, 2, 3, 2],
        faces,
        face_sources: vec![0, 1, 0],
        corner_sources: vec![0, 1, 2, 5, 4, 3, 0, 1, 2],
    };
    let repaired = document.remapped(&remap, Vec::new()).unwrap();
    let written = repaired.write(Format::Obj).unwrap();
    let expected =
        b"# K\xf6rper\r\nv 0 0 0 # a\r\nv 1 0 0 1 0.5 0\r\nv 0 1 0\r\nv 1 0 0 1 0.5 0\r\n\
        vt 0 0\r\nvt 1 0\r\nl 1 2 3\r\np 2\r\ng \xe4\r\nf 1/1 2/2 \\\r\n 3 # first\r\n\
        g\r\nf 3  -4/2 4/1\r\ng \xe4\r\nf 1/1 2/2 3\r\n";
    assert_eq!(
        String::from_utf8_lossy(&written),
        String::from_utf8_lossy(expected)
    );
    assert!(written == expected);
    let curves =
        parse("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\ncstype bezier\ncurv 0 1 1 2\n").unwrap();
    let mut remap = Remap::identity(3, curves.faces());
    assert!(curves.remapped(&remap, Vec::new()).is_ok());
    remap.vertices.push(0);
    let error = curves.remapped(&remap, Vec::new()).unwrap_err().to_string();
    assert!(
        error.starts_with("adding or removing vertices below free-form"),
        "{error}"
    );
}

#[test]
fn a_copied_vertex_with_a_long_comment_stays_short() {
    let comment = "#".repeat(5000);
    let text = format!("v 0 0 0 0.5 0.25 1 {comment}\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 2\n");
    let document = parse(&text).unwrap();
    let mut remap = Remap::identity(3, document.faces());
    remap.vertices.push(0);
    remap.faces = [[0u32, 1, 2], [3, 2, 1]].iter().collect();
    let written = document
        .remapped(&remap, Vec::new())
        .unwrap()
        .write(Format::Obj)
        .unwrap();
    let expected = text
        .replace("v 0 1 0\n", "v 0 1 0\nv 0 0 0 0.5 0.25 1\n")
        .replace("f 1 3 2", "f 4 3 2");
    assert!(written == expected.as_bytes());
}

#[test]
fn a_material_library_is_a_name_and_no_file_to_open() {
    // Another reader opens any path here, and panics on `Kd 1` in its content.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("bad.mtl"), "newmtl a\nKd 1\n").unwrap();
    let path = folder.path().join("mesh.obj");
    let text = "mtllib bad.mtl\nmtllib ../../../../etc/passwd /dev/zero\nusemtl a\n\
                v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(&path, text).unwrap();
    let document = crate::load(&path).unwrap();
    let attributes = document.attributes().unwrap();
    assert_eq!(
        attributes.libraries,
        ["bad.mtl", "../../../../etc/passwd /dev/zero"]
    );
    assert_eq!(document.write(Format::Obj).unwrap(), text.as_bytes());
}
