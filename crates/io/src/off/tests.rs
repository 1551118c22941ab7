//! Tests of OFF.

use proptest::prelude::*;

use super::*;
use crate::attributes::{COLOR, NONE, NORMAL, Property, UV, Values};
use crate::document::Document;
use crate::remap::Remap;

fn parse(text: &str) -> Result<Document, IoError> {
    open(text.as_bytes().to_vec(), &Limits::default())
}

fn refusal(text: &str) -> String {
    parse(text).unwrap_err().to_string()
}

const BODY: &str = "0 0 0\n1 0 0\n\n1 1 0\n0 1 0\n4 0 1 2 3\n";

#[test]
fn headers_come_in_many_shapes() {
    for header in [
        "OFF\n4 1 0\n",
        "OFF 4 1\n",
        "# c\nOFF # c\n\n# c\n4 1 4#c\n",
        "4 1 0\r\n",
        "\u{feff}COFF\r4 1 0\r",
        "OFF4 1 0\n",
        "# c\nOFF4\n1\n",
        "COFF4 1 0\n",
        "STNCOFF4# c\n1 0\n",
    ] {
        let document = parse(&format!("{header}{BODY}")).unwrap();
        assert_eq!(
            (document.positions().len(), document.faces().num_corners()),
            (4, 4),
            "{header}"
        );
    }
    for header in ["4OFF\n4 1 0\n", "nOFF\n3\n4 1 0\n", "OFF BINARY\n4 1 0\n"] {
        assert!(
            refusal(&format!("{header}{BODY}")).starts_with("line 1: "),
            "{header}"
        );
    }
}

#[test]
fn a_header_with_a_glued_count_is_written_back() {
    let text = format!("OFF4 1 0\n{BODY}");
    let mut document = parse(&text).unwrap();
    document
        .set_position(1, Point3::new(2.0, 0.0, 0.0))
        .unwrap();
    let written = document.write(Format::Off).unwrap();
    assert_eq!(
        written,
        text.replacen("1 0 0\n\n", "2 0 0\n\n", 1).into_bytes()
    );
    // After a repair there are fewer vertices and faces.
    let document = parse("OFF5 2 0\n0 0 0\n1 0 0\n9 9 9\n1 1 0\n0 1 0\n3 0 0 1\n4 0 1 3 4\n");
    let repair = crate::Repair::new().drop_degenerate().compact();
    let repaired = repair.apply(&document.unwrap()).unwrap();
    let written = repaired.document.write(Format::Off).unwrap();
    let again = parse(std::str::from_utf8(&written).unwrap()).unwrap();
    assert_eq!((again.positions().len(), again.faces().len()), (4, 1));
    // The letters must be followed by a count, or it is not a header.
    assert!(!is_header_word(b"OFFx") && !is_header_word(b"4x") && !is_header_word(b"BOFF"));
}

#[test]
fn refusals_name_line_element_and_trouble() {
    let three = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
    let with = |line: &str| refusal(&format!("{three}{line}\n"));
    assert_eq!(
        with("3 0 1 3"),
        "line 6: face 0 refers to vertex 3, but the vertices are numbered 0 to 2"
    );
    assert_eq!(
        with("3 0 1 -1"),
        "line 6: face 0 refers to vertex -1, but the vertices are numbered 0 to 2"
    );
    assert_eq!(
        with("2 0 1"),
        "line 6: face 0 has 2 corners; a face needs three or more"
    );
    assert_eq!(with("4 0 1 2"), "line 6: face 0 has 4 numbers; it needs 5");
    assert_eq!(
        with("9223372036854775807 0 1 2"),
        "line 6: face 0 has `9223372036854775807` where a number of corners is expected"
    );
    assert_eq!(
        with("999999999999999999 0 1"),
        "line 6: face 0 has 3 numbers; it needs 1000000000000000000"
    );
    assert_eq!(
        with("3 0 1 2.5"),
        "line 6: face 0 has `2.5` where a vertex number is expected"
    );
    assert_eq!(
        with(""),
        "line 6: the file ends at face 0, but 1 were promised; it was cut short"
    );
    assert!(
        refusal("OFF\n999999999999 1 0\n0 0 0")
            .starts_with("line 2: the header promises 999999999999 vertices")
    );
    assert!(refusal("OFF\nx\n").starts_with("line 2: `x` is not the number of vertices"));
    assert!(refusal("OFF\n").starts_with("line 1: the numbers of vertices and faces are missing"));
    assert!(refusal("OFF\n0 0 0\n").starts_with("no vertices"));
    assert!(
        refusal("OFF\n3 0\n0 0 0\n1 inf 0\n")
            .starts_with("line 4: vertex 1 has the coordinate inf")
    );
}

fn values(document: &Document, face: bool, name: &str) -> Values {
    let attributes = document.attributes().unwrap();
    let property = if face {
        attributes.face(name)
    } else {
        attributes.vertex(name)
    };
    property.unwrap().values.clone()
}

fn text(document: &Document) -> String {
    String::from_utf8(document.write(Format::Off).unwrap()).unwrap()
}

#[test]
fn header_words_have_their_prefixes_in_any_order() {
    for word in [
        "OFF",
        "COFF",
        "NOFF",
        "STOFF",
        "CNOFF",
        "NCSTOFF",
        "STCN4nOFF",
        "nOFF",
    ] {
        assert!(is_header_word(word.as_bytes()), "{word}");
    }
    for word in ["", "off", "CCOFF", "SOFF", "OFFS", "XOFF", "STSTOFF"] {
        assert!(!is_header_word(word.as_bytes()), "{word}");
    }
}

#[test]
fn what_stands_behind_the_coordinates_is_told_by_header_and_count() {
    let read = |header: &str, further: &str| {
        let row = |x: &str| format!("{x} {further}\n");
        let rows: String = ["0 0 0", "1 0 0", "0 1 0"].map(row).concat();
        parse(&format!("{header}\n3 1 0\n{rows}3 0 1 2\n")).unwrap()
    };
    let document = read("STCNOFF", "0 0 1  255 0 9 1  .5 1e-1");
    let repeat = |row: &[f64]| Values::F64(row.repeat(3));
    assert_eq!(values(&document, false, NORMAL), repeat(&[0.0, 0.0, 1.0]));
    assert_eq!(
        values(&document, false, COLOR),
        Values::U8([255, 0, 9, 1].repeat(3))
    );
    assert_eq!(values(&document, false, UV), repeat(&[0.5, 0.1]));
    assert!(document.losses(Format::Off).is_empty());
    let document = read("NOFF", "nan 0 1 1 0 0.5");
    assert_eq!(values(&document, false, COLOR), repeat(&[1.0, 0.0, 0.5]));
    for header in ["OFF", "COFF"] {
        let document = read(header, "1 0 1 # a comment");
        assert_eq!(values(&document, false, COLOR), repeat(&[1.0, 0.0, 1.0]));
        assert_eq!(document.attributes().unwrap().comments, ["a comment"; 3]);
    }
    // Unknown numbers are preserved, and lost in other formats.
    let document = read("OFF", "7 8");
    assert!(document.attributes().unwrap().is_empty());
    assert_eq!(
        document.losses(Format::Obj)[0],
        "further numbers of the vertices will be lost in OBJ"
    );
}

#[test]
fn colours_may_be_missing_or_of_both_kinds() {
    let text = "OFF\n4 5 0\n0 0 0\n1 0 0 51 0 1\n1 1 0 0 0 0 0\n0 1 0\n4 0 1 2 3\n\
        3 0 1 2 0.5 1 0\n3 0 2 1 51 0 1 0\n3 0 1 3 7\n3 1 2 3 1 1 1 # c\n";
    let document = parse(text).unwrap();
    let expected = [[255; 4], [51, 0, 1, 255], [0; 4], [255; 4]].concat();
    assert_eq!(values(&document, false, COLOR), Values::U8(expected));
    let expected = [
        [1.0; 4],
        [0.5, 1.0, 0.0, 1.0],
        [0.2, 0.0, 1.0 / 255.0, 0.0],
        [1.0; 4],
        [1.0; 4],
    ];
    assert_eq!(
        values(&document, true, COLOR),
        Values::F64(expected.concat())
    );
    assert_eq!(
        values(&document, true, COLOR_INDEX),
        Values::I32(vec![-1, -1, -1, 7, -1])
    );
    // Rewritten from memory, the text has the same meaning.
    let attributes = document.attributes().unwrap().into_owned();
    let again = document.with_attributes(attributes.clone()).unwrap();
    let again = parse(&self::text(&again)).unwrap();
    assert_eq!(again.attributes().unwrap().into_owned(), attributes);
}

#[test]
fn wrong_attributes_are_refused_when_they_are_asked_for() {
    let refused = |header: &str, further: &str, face: &str| {
        let text = format!("{header}\n3 1 0\n0 0 0 {further}\n1 0 0\n0 1 0\n3 0 1 2 {face}\n");
        let document = parse(&text).unwrap();
        assert_eq!(self::text(&document), text);
        document.attributes().unwrap_err().to_string()
    };
    assert_eq!(
        refused("OFF", "256 0 0", ""),
        "line 3: vertex 0 has `256` where a whole number from 0 to 255 or a real number is expected"
    );
    assert_eq!(
        refused("OFF", "", "1 x 0"),
        "line 6: face 0 has `x` where a whole number from 0 to 255 or a real number is expected"
    );
    assert_eq!(
        refused("OFF", "", "0.5"),
        "line 6: face 0 has `0.5` where a number of a colour map is expected"
    );
    assert_eq!(
        refused("NOFF", "0 0 z", ""),
        "line 3: vertex 0 has `z` where a number is expected"
    );
    assert_eq!(
        refused("NOFF", "0 0 1", ""),
        "line 4: vertex 1 has 3 numbers; it needs 6"
    );
}

#[test]
fn moved_vertices_and_turned_normals_are_replaced() {
    let text = "CNOFF # n\n4 2 0\n0 0 0  0 0 1  9 9 9 # a\n1 0 0  0.0 0 2  9 9 9\n\
        0 1 0\t0 0 1  9 9 9\n5 5 5 0 0 1 9 9 9\n3 0 1 2 .5 .5 .5\n3 0 2 1\n";
    let mut document = parse(&text.replace("3 0 2 1", "3 0 1 2")).unwrap();
    document
        .set_position(2, Point3::new(0.0, 0.0, 1.0))
        .unwrap();
    let written = self::text(&document);
    let expected = "CNOFF # n\n4 2 0\n0 0 0  0 -1 0  9 9 9 # a\n1 0 0  0.0 -2 0  9 9 9\n\
        0 0 1\t0 -1 0  9 9 9\n5 5 5 0 0 1 9 9 9\n3 0 1 2 .5 .5 .5\n3 0 1 2\n";
    let again = parse(&written).unwrap();
    assert_eq!(again.positions(), document.positions());
    let Values::F64(normals) = values(&again, false, NORMAL) else {
        panic!("they are f64")
    };
    let wanted = [
        0.0, -1.0, 0.0, 0.0, -2.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0,
    ];
    assert!(
        normals
            .iter()
            .zip(wanted)
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{normals:?}"
    );
    // The text is unchanged except for the last digits of the normals.
    let words = |text: &str| text.split_whitespace().count();
    assert_eq!(words(&written), words(expected));
    assert!(
        written.starts_with("CNOFF # n\n4 2 0\n0 0 0  0 -1 "),
        "{written}"
    );
    assert!(written.ends_with("9 9 9\n5 5 5 0 0 1 9 9 9\n3 0 1 2 .5 .5 .5\n3 0 1 2\n"));
}

#[test]
fn rows_beyond_the_promised_are_kept_and_not_read() {
    let text = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n# c\n3 0 2 1\nanything\n";
    let document = parse(text).unwrap();
    assert_eq!(document.faces().len(), 1);
    assert_eq!(
        document.warnings()[0].to_string(),
        "line 8: 2 more rows follow the 1 faces that the header promises; they are kept but not read"
    );
    assert_eq!(self::text(&document), text);
    assert_eq!(
        document.losses(Format::Ply)[0],
        "2 rows after the last face will be lost in PLY"
    );
}

#[test]
fn numbers_may_run_over_the_line_ends() {
    for text in [
        "OFF\n4\n2\n5\n0 0 0 1 0 0\n1 1 0 0 1\n# c\n0 3 0 1\n2 9 9 9\n3 0 2 3\n",
        "OFF 4 2 5 0 0 0 1 0 0 1 1 0 0 1 0\n3 0 1 2 9 9 9\n3 0 2 3",
        "COFF 4 2 5\n0 0 0 9 9 9 9 1 0 0 9 9 9 9\n1 1 0 9 9 9 9 0 1 0 9 9 9 9\n3 0 1 2 9 9 9\n3 0 2 3\n",
        "COFF\n4 2\n5\n0 0 0 9 9 9 1 0 0 9 9 9\n1 1 0 9 9 9 0 1 0 9 9 9 # c\n3 0\n1\n2 9 9 9\n3 0 2 3\n",
    ] {
        let mut document = parse(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        assert_eq!(document.positions()[3], Point3::new(0.0, 1.0, 0.0));
        assert_eq!(document.faces().corners(), [0, 1, 2, 0, 2, 3]);
        assert_eq!(
            values(&document, true, COLOR),
            Values::U8(vec![9, 9, 9, 255, 255, 255])
        );
        let has_colors = document.attributes().unwrap().vertex(COLOR).is_some();
        assert_eq!(has_colors, text.starts_with('C'), "{text}");
        assert_eq!(self::text(&document), text);
        document
            .set_position(3, Point3::new(0.25, 1.0, 0.0))
            .unwrap();
        let again = parse(&self::text(&document)).unwrap();
        assert_eq!(again.positions(), document.positions());
        let same = Remap::identity(4, document.faces());
        let rebuilt = document.remapped(&same, Vec::new()).unwrap();
        let again = parse(&self::text(&rebuilt)).unwrap();
        assert_eq!(again.positions(), document.positions());
        assert_eq!(again.faces(), document.faces());
        let (a, b) = (again.attributes().unwrap(), document.attributes().unwrap());
        assert_eq!((&a.vertices, &a.faces), (&b.vertices, &b.faces));
        assert_eq!(a.comments, b.comments);
    }
}

#[test]
fn rows_are_gathered_with_what_they_have() {
    let text = "# first\nCOFF # c\r\n4 3 5 # counts\n# before 0\n0 0 0 9 9 9 # v0\n# before 1\n\
        \n 1 0 0 8 8 8\n1 1 0  7 7 7\n# before 3\n0 1 0 6 6 6\n# faces\n  3  0 1 2 .5 0 0 # f0\n\
        # before f1\n3 0 2 3\n4 0 1 2 3 5\n# end";
    let document = parse(text).unwrap();
    let remap = Remap {
        vertices: vec![0, 3, 2, 0],
        faces: [[0, 2, 1], [3, 1, 2], [0, 1, 3]].iter().collect(),
        face_sources: vec![1, 2, NONE],
        corner_sources: vec![3, 4, 5, 6, 9, 8, 0, 1, 2],
    };
    let again = document.remapped(&remap, Vec::new()).unwrap();
    let expected = "# first\nCOFF # c\r\n4 3 5 # counts\n# before 0\n0 0 0 9 9 9 # v0\n# before 1\n\
        \n# before 3\n0 1 0 6 6 6\n1 1 0  7 7 7\n0 0 0 9 9 9 # v0\n# faces\n\
        # before f1\n3 0 2 1\n3 3 1 2 5\n3 0 1 3\n# end";
    assert_eq!(self::text(&again), expected);
    assert_eq!(
        values(&again, false, COLOR),
        Values::U8([[9; 3], [6; 3], [7; 3], [9; 3]].concat())
    );
    let mut again = again.clone();
    again.set_position(1, Point3::new(0.0, 2.0, 0.0)).unwrap();
    assert_eq!(self::text(&again), expected.replace("0 1 0 6", "0 2 0 6"));

    let same = Remap::identity(4, document.faces());
    let again = document.remapped(&same, Vec::new()).unwrap();
    assert_eq!(self::text(&again), text);
}

#[test]
fn a_new_file_has_what_off_can_hold() {
    let property = |name: &str, components, values| Property {
        name: name.into(),
        components,
        values,
    };
    let document = parse(&format!("OFF\n4 1 0\n{BODY}")).unwrap();
    let attributes = Attributes {
        vertices: vec![
            property("quality", 1, Values::F32(vec![0.0; 4])),
            property(NORMAL, 3, Values::F32([0.0, 0.0, 0.1].repeat(4))),
            property(COLOR, 3, Values::U16([0, 65535, 0].repeat(4))),
            property(UV, 2, Values::F64([0.5, 0.25].repeat(4))),
        ],
        faces: vec![property(COLOR, 4, Values::U8(vec![1, 2, 3, 4]))],
        comments: vec!["two\nlines".into(), String::new()],
        libraries: vec!["a.mtl".into()],
        ..Attributes::default()
    };
    let document = document.with_attributes(attributes).unwrap();
    assert_eq!(
        document.losses(Format::Off),
        [
            "the vertex property quality will be lost in OFF",
            "the material libraries will be lost in OFF"
        ]
    );
    let written = self::text(&document);
    assert!(
        written
            .starts_with("STCNOFF\n# two\n# lines\n#\n4 1 0\n0 0 0 0 0 0.1 0.0 1.0 0.0 0.5 0.25\n"),
        "{written}"
    );
    assert!(written.ends_with("\n4 0 1 2 3 1 2 3 4\n"), "{written}");
}

#[test]
fn limits_hold() {
    let text = format!("OFF\n4 1 0\n{BODY}");
    let with = |change: fn(&mut Limits)| {
        let mut limits = Limits {
            max_vertices: 4,
            max_faces: 1,
            max_corners: 4,
            max_degree: 4,
            max_line: 9,
            ..Limits::default()
        };
        change(&mut limits);
        open(text.clone().into_bytes(), &limits).map_err(|error| error.to_string())
    };
    assert!(with(|_| {}).is_ok());
    let over = |change| with(change).unwrap_err();
    assert!(over(|l| l.max_vertices = 3).starts_with("more than 3 vertices"));
    assert!(over(|l| l.max_faces = 0).starts_with("more than 0 faces"));
    assert!(over(|l| l.max_corners = 3).starts_with("more than 3 face corners"));
    assert!(over(|l| l.max_degree = 3).starts_with("more than 3 corners of a face"));
    assert!(over(|l| l.max_line = 8).starts_with("more than 8 bytes in a line"));
    assert!(over(|l| l.max_memory = 100).contains("bytes of memory"));
}

/// Meshes with everything that an OFF can represent.
fn documents() -> impl Strategy<Value = Document> {
    let real = || {
        prop_oneof![
            any::<f64>().prop_filter("finite", |x| x.is_finite()),
            (-2i8..3).prop_map(f64::from)
        ]
    };
    let colors = move |count: usize| {
        (3usize..5).prop_flat_map(move |k| {
            let bytes = prop::collection::vec(any::<u8>(), count * k)
                .prop_map(|mut bytes| {
                    // Only zeros and ones would be read as real numbers.
                    if let Some(first) = bytes.first_mut() {
                        *first = (*first).max(2);
                    }
                    bytes
                })
                .prop_map(Values::U8);
            let reals = prop::collection::vec(real(), count * k).prop_map(Values::F64);
            let values = prop_oneof![bytes, reals];
            prop::option::of(values.prop_map(move |values| Property {
                name: COLOR.into(),
                components: k,
                values,
            }))
        })
    };
    let reals = move |name: &'static str, count: usize, k: usize| {
        let values = prop::collection::vec(real(), count * k);
        prop::option::of(values.prop_map(move |values| Property {
            name: name.into(),
            components: k,
            values: Values::F64(values),
        }))
    };
    (1usize..9, 0usize..6).prop_flat_map(move |(vertices, faces)| {
        let polygon = prop::collection::vec(0..vertices as u32, 3..6);
        (
            prop::collection::vec(prop::array::uniform3(real()), vertices),
            prop::collection::vec(polygon, faces),
            (
                reals(NORMAL, vertices, 3),
                colors(vertices),
                reals(UV, vertices, 2),
            ),
            colors(faces),
            prop::collection::vec("[a-z#][ a-z#]{0,5}[a-z]|", 0..3),
        )
            .prop_map(
                |(positions, faces, (normals, vertex_colors, uvs), colors, comments)| {
                    let attributes = Attributes {
                        vertices: [normals, vertex_colors, uvs]
                            .into_iter()
                            .flatten()
                            .collect(),
                        faces: colors
                            .into_iter()
                            .filter(|p| !p.values.is_empty())
                            .collect(),
                        comments,
                        ..Attributes::default()
                    };
                    Document::new(
                        positions.into_iter().map(Point3::from).collect(),
                        faces.iter().collect(),
                    )
                    .unwrap()
                    .with_attributes(attributes)
                    .unwrap()
                },
            )
    })
}

proptest! {
    #[test]
    fn what_is_written_reads_back_the_same(document in documents()) {
        let written = text(&document);
        prop_assert!(document.losses(Format::Off).is_empty());
        let again = parse(&written).unwrap();
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
        prop_assert_eq!(text(&again), written.clone());
        let same = Remap::identity(again.positions().len(), again.faces());
        prop_assert_eq!(text(&again.remapped(&same, Vec::new()).unwrap()), written);
    }

    #[test]
    fn a_file_without_line_ends_reads_the_same(document in documents()) {
        // Face colours end with their line.
        let attributes = Attributes {
            vertices: document.attributes().unwrap().vertices.clone(),
            ..Attributes::default()
        };
        let document = document.with_attributes(attributes).unwrap();
        let written = text(&document);
        let rows: Vec<&str> = written.lines().collect();
        let (head, faces) = rows.split_at(rows.len() - document.faces().len());
        let joined = format!("{}\n{}", head.join(" "), faces.join("\n"));
        let again = parse(&joined).unwrap();
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        prop_assert_eq!(text(&again), joined);
    }

    #[test]
    fn arbitrary_rows_never_panic(
        text in "(ST)?C?N?OFF( [0-5]){0,3}[ \n]([0-5.\\-]{1,3}[ \n]|# ?[0-9]?\n|3 0 1 2\n){0,60}",
        order in prop::collection::vec(0u32..4, 0..6),
    ) {
        if let Ok(document) = parse(&text) {
            prop_assert_eq!(self::text(&document), text);
            let _ = document.attributes();
            let count = document.positions().len() as u32;
            let vertices: Vec<u32> = order.into_iter().filter(|&v| v < count).collect();
            let num_faces = document.faces().len() as u32;
            let n = vertices.len() as u32;
            let remap = Remap {
                faces: (0..num_faces).filter(|_| n > 0).map(|f| [f % n, 0, n - 1]).collect(),
                face_sources: (0..num_faces).filter(|_| n > 0).rev().collect(),
                corner_sources: vec![0; 3 * num_faces as usize * usize::from(n > 0)],
                vertices,
            };
            let again = document.remapped(&remap, Vec::new()).unwrap();
            let written = self::text(&again);
            if n > 0 {
                let read = parse(&written).unwrap();
                prop_assert_eq!(read.positions(), again.positions());
                prop_assert_eq!(read.faces(), again.faces());
            }
        }
    }

    #[test]
    fn attributes_go_with_their_vertices_and_faces(
        document in documents(),
        copies in prop::collection::vec(any::<prop::sample::Index>(), 0..4),
        order in prop::collection::vec((any::<prop::sample::Index>(), any::<bool>()), 0..6),
    ) {
        let document = parse(&text(&document)).unwrap();
        let count = document.positions().len();
        let mut vertices: Vec<u32> = (0..count as u32).rev().collect();
        vertices.extend(copies.iter().map(|copy| copy.index(count) as u32));
        let mut remap = Remap {
            vertices,
            // All faces are kept, so that the kind of their colours stays unambiguous.
            face_sources: (0..document.faces().len() as u32).rev().collect(),
            ..Remap::default()
        };
        let num_faces = document.faces().len();
        let more = order.iter().filter(|_| num_faces > 0);
        remap.face_sources.extend(more.map(|(face, _)| face.index(num_faces) as u32));
        let mut faces = Vec::new();
        for (at, &source) in remap.face_sources.iter().enumerate() {
            let is_turned = order.get(at).is_some_and(|order| order.1);
            let old = document.faces().get(source as usize).unwrap();
            let corners = document.faces().corner_range(source as usize);
            let mut corners: Vec<(u32, u32)> =
                corners.zip(old).map(|(c, &v)| (c as u32, count as u32 - 1 - v)).collect();
            if is_turned {
                corners.reverse();
            }
            remap.corner_sources.extend(corners.iter().map(|c| c.0));
            faces.push(corners.iter().map(|c| c.1).collect::<Vec<u32>>());
        }
        remap.faces = faces.iter().collect();
        let again = document.remapped(&remap, Vec::new()).unwrap();
        let read = parse(&text(&again)).unwrap();
        prop_assert_eq!(read.positions(), again.positions());
        prop_assert_eq!(read.faces(), again.faces());
        let expected = document.attributes().unwrap().remapped(&remap);
        prop_assert_eq!(read.attributes().unwrap().into_owned(), expected);
    }
}
