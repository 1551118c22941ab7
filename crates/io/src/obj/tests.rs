//! Reading: every form of a statement, and every refusal.

use nalgebra::Point3;

use super::*;

fn parse(text: &str) -> Result<Document, IoError> {
    read(text.as_bytes().to_vec(), &Limits::default())
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
        "line 4: vertex 3 has `x\u{fffd}y` where a number is expected"
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
