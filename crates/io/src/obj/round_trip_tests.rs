//! Round trips of all kinds of files and documents: reading, writing, moving and repairing
//! preserve the data.

use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::attributes::{COLOR, CornerProperty, Labels, NONE, NORMAL, Property, UV, Values};
use crate::document::Document;
use crate::faces::FaceList;
use crate::obj::decode::{KINDS, WEIGHT, no_name};

/// The bytes of an OBJ file that uses every feature, derived from arbitrary choices.
fn file() -> impl Strategy<Value = Vec<u8>> {
    let choices = prop::collection::vec(any::<[u8; 6]>(), 1..60);
    (choices, 0usize..3, any::<bool>(), any::<bool>()).prop_map(
        |(choices, line_end, has_bom, is_ended)| {
            let line_end = ["\n", "\r\n", "\r"][line_end];
            let mut text = Vec::new();
            if has_bom {
                text.extend_from_slice(b"\xef\xbb\xbf");
            }
            let lines = lines(&choices, line_end);
            for (k, line) in lines.iter().enumerate() {
                text.extend_from_slice(line);
                if is_ended || k + 1 < lines.len() {
                    text.extend_from_slice(line_end.as_bytes());
                }
            }
            text
        },
    )
}

fn lines(choices: &[[u8; 6]], line_end: &str) -> Vec<Vec<u8>> {
    let kind = |c: &[u8; 6]| c[0] % 16;
    let total = |wanted: fn(u8) -> bool| choices.iter().filter(|c| wanted(kind(c))).count();
    // At least three vertices, and an entry in each table.
    let totals = [
        3 + total(|k| k < 4),
        1 + total(|k| k == 4),
        1 + total(|k| k == 5),
    ];
    let mut so_far = [3, 1, 1];
    let mut lines: Vec<Vec<u8>> = [
        &b"v 0 0 0"[..],
        b"v\t1.5 0 0 # one",
        b"v 0 1e0 0.250",
        b"vt 0.5 1",
        b"vn 0 0 1",
    ]
    .map(<[u8]>::to_vec)
    .into();
    let number = |x: u8| f64::from(i16::from(x) - 128) / 16.0;
    for c in choices {
        let [_, a, b, x, y, z] = *c;
        let [p, q, r] = [x, y, z].map(number);
        // An index, absolute or relative.
        let index = |k: usize, by: u8, so_far: [usize; 3]| {
            let element = usize::from(by) % totals[k];
            if by & 64 != 0 && element < so_far[k] {
                format!("-{}", so_far[k] - element)
            } else {
                format!("{}", element + 1)
            }
        };
        let corner = |by: u8, form: u8, so_far: [usize; 3]| {
            let [v, t, n] = [0, 1, 2].map(|k| index(k, by.rotate_left(k as u32), so_far));
            match form % 4 {
                0 => v,
                1 => format!("{v}/{t}"),
                2 => format!("{v}//{n}"),
                _ => format!("{v}/{t}/{n}"),
            }
        };
        let blank = match a % 8 {
            0 => format!("\\{line_end} "),
            1 => "\t ".to_owned(),
            _ => " ".to_owned(),
        };
        let comment = if b % 8 == 0 { " # K\u{f6}r \\" } else { "" };
        let line = match kind(c) {
            0..4 => {
                so_far[0] += 1;
                let extra = match b % 6 {
                    0 => " 0.5",
                    1 => " 0 0.5 1",
                    2 => " nan 0 0 0.25",
                    _ => "",
                };
                format!("v {p}{blank}{q} {r}{extra}{comment}")
            }
            4 => {
                so_far[1] += 1;
                format!("vt{blank}{p} {q}{comment}")
            }
            5 => {
                so_far[2] += 1;
                format!("vn {p}{blank}{q} {r}{comment}")
            }
            6..12 => {
                let extra = usize::from(z) % 3;
                let corners = [x, y, z, a ^ x, b ^ y];
                let words: Vec<String> = corners[..3 + extra]
                    .iter()
                    .map(|&by| corner(by, a / 8, so_far))
                    .collect();
                format!("f {}{comment}", words.join(&blank))
            }
            12 => match a % 4 {
                0 => format!("l {} {}", corner(x, 0, so_far), corner(y, 1, so_far)),
                1 => format!("p {} {}", corner(x, 0, so_far), corner(y, 0, so_far)),
                2 => "mtllib a b.mtl".to_owned(),
                _ => "# a comment \\".to_owned(),
            },
            13 => format!("g {}", ["arm", "leg # 2", "", "a\\"][usize::from(x) % 4]),
            14 => format!(
                "usemtl {}",
                ["red", "(null)", "blue sky"][usize::from(x) % 3]
            ),
            _ => ["s 1", "s off", "o \u{e9}", "o", "", "foo bar"][usize::from(x) % 6].to_owned(),
        };
        // Half of the files are entirely in Latin-1.
        let line = line.trim_end_matches(' ');
        lines.push(match choices[0][1] % 2 {
            0 => line.as_bytes().to_vec(),
            _ => line.chars().map(|c| c as u8).collect(),
        });
        // As a name at the end of its line, `a\\` would continue it.
        if let Some(line) = lines.last_mut().filter(|line| line.ends_with(b"a\\")) {
            line.push(b' ');
        }
    }
    lines
}

fn parse(bytes: &[u8]) -> Result<Document, IoError> {
    open(bytes.to_vec(), &Limits::default())
}

/// Names instead of their indices, because the list of names depends on which are used.
fn names(attributes: &Attributes, num_faces: usize) -> Vec<Vec<String>> {
    KINDS
        .iter()
        .map(|&(kind, _)| {
            let labels = attributes.label(kind);
            (0..num_faces)
                .map(|face| {
                    let label = labels.and_then(|l| l.names.get(l.faces[face] as usize));
                    label.cloned().unwrap_or_default()
                })
                .collect()
        })
        .collect()
}

/// A mesh made of another's: some vertices omitted, copied and swapped, some faces omitted,
/// reversed, cut, swapped and added.
fn remap(vertices: usize, faces: &FaceList, choices: &[u8]) -> Remap {
    let choice = |k: usize| choices[k % choices.len()];
    let mut remap = Remap::default();
    for v in 0..vertices as u32 {
        if choice(v as usize) % 8 != 0 {
            remap.vertices.push(v);
        }
    }
    if remap.vertices.is_empty() {
        remap.vertices.push(0);
    }
    if choice(3) % 4 == 0 {
        remap.vertices.push(u32::from(choice(4)) % vertices as u32);
    }
    if choice(5) % 8 == 0 {
        let last = remap.vertices.len() - 1;
        remap.vertices.swap(0, last);
    }
    let mut list: Vec<(u32, Vec<usize>)> = Vec::new();
    for face in 0..faces.len() {
        let mut corners: Vec<usize> = faces.corner_range(face).collect();
        match choice(face + 7) % 8 {
            0 => continue,
            1 => corners.reverse(),
            2 if corners.len() > 3 => corners.truncate(3),
            3 => corners.push(corners[0]),
            4 => corners[0] = usize::from(choice(face)) % faces.num_corners(),
            _ => {}
        }
        list.push((face as u32, corners));
    }
    if let Some((_, corners)) = list.first().cloned() {
        match choice(1) % 6 {
            0 => list.push((NONE, corners)),
            1 => list.reverse(),
            2 => list.push((0, corners)),
            _ => {}
        }
    }
    for (source, corners) in list {
        let mut polygon: Vec<u32> = Vec::new();
        for &c in &corners {
            let old = faces.corners()[c];
            let new = remap.vertices.iter().position(|&v| v == old);
            // An omitted vertex was welded to another.
            let new = new.unwrap_or(old as usize % remap.vertices.len()) as u32;
            polygon.push(new);
            remap.corner_sources.push(c as u32);
        }
        polygon.iter().for_each(|&v| remap.faces.push_corner(v));
        remap.faces.end_face();
        remap.face_sources.push(source);
    }
    remap
}

/// The default for a vertex without a value of its own.
fn defaulted(attributes: &Attributes, name: &str, vertex: usize) -> [f64; 4] {
    let mut value = [1.0; 4];
    if let Some(p) = attributes.vertex(name) {
        for (k, x) in value.iter_mut().enumerate().take(p.components) {
            *x = p.values.get(vertex * p.components + k).unwrap();
        }
    }
    value
}

proptest! {
    #[test]
    fn files_are_written_as_they_were_read(bytes in file()) {
        let document = parse(&bytes).unwrap();
        prop_assert!(document.write(Format::Obj).unwrap() == bytes);
        let attributes = document.attributes().unwrap();
        let (faces, vertices) = (document.faces(), document.positions().len());
        prop_assert_eq!(attributes.misfit(vertices, faces.len(), faces.num_corners()), None);
    }

    #[test]
    fn moved_files_have_what_the_document_has(bytes in file(), moves in prop::collection::vec((0usize..64, -9.0f64..9.0), 1..9)) {
        let mut document = parse(&bytes).unwrap();
        for (vertex, x) in moves {
            let vertex = vertex % document.positions().len();
            document.set_position(vertex, Point3::new(x, 1.0 / x, 0.5)).ok();
        }
        let again = parse(&document.write(Format::Obj).unwrap()).unwrap();
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
    }

    #[test]
    fn repaired_files_have_what_the_repair_says(bytes in file(), choices in prop::collection::vec(any::<u8>(), 8..40)) {
        let document = parse(&bytes).unwrap();
        let remap = remap(document.positions().len(), document.faces(), &choices);
        let repaired = document.remapped(&remap, Vec::new()).unwrap();
        let bytes = repaired.write(Format::Obj).unwrap();
        let again = parse(&bytes).unwrap();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        prop_assert_eq!(again.positions(), repaired.positions(), "{}", text);
        prop_assert_eq!(again.faces(), &remap.faces, "{}", text);
        let expected = document.attributes().unwrap().remapped(&remap);
        let found = again.attributes().unwrap();
        prop_assert_eq!(&found.corners, &expected.corners, "{}", text);
        prop_assert_eq!(&found.libraries, &expected.libraries);
        let count = remap.faces.len();
        prop_assert_eq!(names(&found, count), names(&expected, count), "{}", text);
        for vertex in 0..remap.vertices.len() {
            for name in [COLOR, WEIGHT] {
                prop_assert_eq!(
                    defaulted(&found, name, vertex),
                    defaulted(&expected, name, vertex),
                    "{}", text
                );
            }
        }
    }

    #[test]
    fn the_mesh_as_it_is_keeps_every_byte(bytes in file()) {
        let document = parse(&bytes).unwrap();
        let identity = Remap::identity(document.positions().len(), document.faces());
        let same = document.remapped(&identity, Vec::new()).unwrap();
        prop_assert!(same.write(Format::Obj).unwrap() == bytes);
    }

    #[test]
    fn how_a_file_is_cut_makes_no_difference(
        bytes in file(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
    ) {
        let mut bytes = bytes;
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        let limits = Limits { max_degree: 6, max_line: 60, max_faces: 20, ..Limits::default() };
        let outcome = |result: Result<parse::Mesh, IoError>| match result {
            Ok(mesh) => Ok((mesh.positions, mesh.faces, mesh.counts.extras(), mesh.counts.warnings())),
            Err(error) => Err(error.to_string()),
        };
        let plainly = outcome(parse::parse_plainly(&bytes, &limits));
        for piece in [1, 20, 100, usize::MAX] {
            prop_assert_eq!(&outcome(parse::parse_by(&bytes, &limits, piece)), &plainly);
        }
    }

    #[test]
    fn documents_come_back_from_a_new_file(document in document()) {
        prop_assert!(write::losses(&document.attributes().unwrap()).is_empty());
        let bytes = document.write(Format::Obj).unwrap();
        let again = parse(&bytes).unwrap();
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
    }
}

/// Names as they can occur in a file.
fn name() -> impl Strategy<Value = String> {
    "[!-~\u{e9}\u{4e00}][ -~\u{e9}]{0,6}".prop_map(|name| name.trim().to_owned())
}

/// Documents with everything that OBJ can represent.
fn document() -> impl Strategy<Value = Document> {
    let number = || any::<f64>().prop_filter("finite", |x| x.is_finite());
    let vertices = prop::collection::vec([number(), number(), number()], 1..9);
    let faces = prop::collection::vec(
        (prop::collection::vec(any::<u32>(), 3..6), any::<[u8; 4]>()),
        0..9,
    );
    let extras = prop::collection::vec(0.0f64..=1.0, 40);
    let words = prop::collection::vec(name(), 4..9);
    let comments = prop::collection::vec("[ -~\u{e9}]{0,9}", 0..4);
    (
        vertices,
        faces,
        extras,
        words,
        comments,
        0usize..4,
        0usize..4,
        any::<[u8; 8]>(),
    )
        .prop_map(
            |(vertices, faces, extras, words, comments, extra, uv, entries)| {
                let count = vertices.len();
                let polygons: FaceList = faces
                    .iter()
                    .map(|(f, _)| -> Vec<u32> { f.iter().map(|v| v % count as u32).collect() })
                    .collect();
                let mut attributes = Attributes {
                    comments,
                    libraries: words[..2].to_vec(),
                    ..Attributes::default()
                };
                let vertex = |name: &str, components: usize| Property {
                    name: name.to_owned(),
                    components,
                    values: Values::F64(extras[..count * components].to_vec()),
                };
                match extra {
                    1 => attributes.vertices.push(vertex(WEIGHT, 1)),
                    2 => attributes.vertices.push(vertex(COLOR, 3)),
                    3 => attributes.vertices.push(vertex(COLOR, 4)),
                    _ => {}
                }
                let corner = |name: &str, components: usize| CornerProperty {
                    name: name.to_owned(),
                    components,
                    values: Values::F64(extras[..3 * components].to_vec()),
                    indices: (0..polygons.num_corners())
                        .map(|c| match entries[c % 8] % 4 {
                            3 => NONE,
                            entry => entry.into(),
                        })
                        .collect(),
                };
                if uv > 0 {
                    attributes.corners.push(corner(UV, uv));
                }
                if entries[0] > 99 {
                    attributes.corners.push(corner(NORMAL, 3));
                }
                for (k, (kind, _)) in KINDS.into_iter().enumerate() {
                    let mut names: Vec<String> = Vec::new();
                    let faces = faces.iter().map(|(_, labels)| {
                        let name = words.get(usize::from(labels[k]) % 12);
                        let is_none = |name: &&String| {
                            **name != no_name(kind) && !name.is_empty() && name.as_str() != "0"
                        };
                        let Some(name) = name.filter(is_none) else {
                            return NONE;
                        };
                        let known = names.iter().position(|known| known == name);
                        known.unwrap_or_else(|| {
                            names.push(name.clone());
                            names.len() - 1
                        }) as u32
                    });
                    let faces: Vec<u32> = faces.collect();
                    if !names.is_empty() {
                        attributes.labels.push(Labels { kind, names, faces });
                    }
                }
                let positions = vertices.into_iter().map(Point3::from).collect();
                let document = Document::new(positions, polygons).unwrap();
                document.with_attributes(attributes).unwrap()
            },
        )
}
