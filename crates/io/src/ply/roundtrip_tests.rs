//! Properties: files read back as written, also by ply-rs, and rebuilt files preserve the data of
//! every vertex, face and corner.

use nalgebra::Point3;
use ply_rs::parser::Parser;
use ply_rs::ply::{DefaultElement, Encoding, Ply};
use ply_rs::writer::Writer;
use proptest::prelude::*;

use super::*;
use crate::attributes::{COLOR, CornerProperty, NONE, NORMAL, Property, UV, Values};
use crate::document::Document;
use crate::faces::FaceList;

fn parse(bytes: &[u8]) -> Document {
    open(bytes.to_vec(), &Limits::default()).unwrap()
}

fn single() -> impl Strategy<Value = f32> {
    use prop::num::f32::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    INFINITE | NEGATIVE | NORMAL | POSITIVE | SUBNORMAL | ZERO
}

fn double() -> impl Strategy<Value = f64> {
    use prop::num::f64::{INFINITE, NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    INFINITE | NEGATIVE | NORMAL | POSITIVE | SUBNORMAL | ZERO
}

fn numbers(count: usize) -> impl Strategy<Value = Values> {
    use prop::collection::vec;
    prop_oneof![
        vec(any::<i8>(), count).prop_map(Values::I8),
        vec(any::<u8>(), count).prop_map(Values::U8),
        vec(any::<i16>(), count).prop_map(Values::I16),
        vec(any::<u16>(), count).prop_map(Values::U16),
        vec(any::<i32>(), count).prop_map(Values::I32),
        vec(any::<u32>(), count).prop_map(Values::U32),
        vec(single(), count).prop_map(Values::F32),
        vec(double(), count).prop_map(Values::F64),
    ]
}

fn colors(count: usize) -> impl Strategy<Value = Values> {
    use prop::collection::vec;
    prop_oneof![
        vec(any::<u8>(), count).prop_map(Values::U8),
        vec(any::<u16>(), count).prop_map(Values::U16),
        vec(single(), count).prop_map(Values::F32),
        vec(double(), count).prop_map(Values::F64),
    ]
}

/// Lists of up to 4 items. The first has one item, so that the number of items never matches the
/// corners.
fn lists(count: usize) -> impl Strategy<Value = Values> {
    prop::collection::vec(0usize..5, count).prop_flat_map(|mut lengths| {
        if let Some(first) = lengths.first_mut() {
            *first = 1;
        }
        numbers(lengths.iter().sum()).prop_map(move |items| Values::Lists {
            ends: lengths
                .iter()
                .scan(0, |end, length| {
                    *end += length;
                    Some(*end)
                })
                .collect(),
            items: Box::new(items),
        })
    })
}

/// Properties of `count` elements, in the order in which a file has them.
fn properties(count: usize) -> impl Strategy<Value = Vec<Property>> {
    let usual = |name: &'static str, components: usize, values: BoxedStrategy<Values>| {
        prop::option::of(values.prop_map(move |values| Property {
            name: name.to_owned(),
            components,
            values,
        }))
    };
    let color = (3usize..5).prop_flat_map(move |components| {
        prop::option::of(colors(components * count).prop_map(move |values| Property {
            name: COLOR.to_owned(),
            components,
            values,
        }))
    });
    let plain = prop::collection::btree_map(
        "[a-z_][a-zA-Z0-9_-]{5,9}",
        prop_oneof![numbers(count), lists(count)],
        0..4,
    );
    let normal = usual(NORMAL, 3, numbers(3 * count).boxed());
    let uv = usual(UV, 2, numbers(2 * count).boxed());
    (normal, color, uv, plain).prop_map(|(normal, color, uv, plain)| {
        let plain = plain.into_iter().map(|(name, values)| Property {
            name,
            components: 1,
            values,
        });
        [normal, color, uv]
            .into_iter()
            .flatten()
            .chain(plain)
            .collect()
    })
}

/// Texture coordinates whose table is in the order of first use without duplicates. Either all
/// corners of a face have some, or none.
fn corner_uv(faces: &FaceList) -> impl Strategy<Value = Option<CornerProperty>> + use<> {
    let ends: Vec<usize> = (0..faces.len())
        .map(|f| faces.corner_range(f).end)
        .collect();
    let of_faces = prop::collection::vec(any::<bool>(), ends.len());
    let of_corners = prop::collection::vec(0u32..6, faces.num_corners());
    (any::<bool>(), of_faces, of_corners).prop_map(move |(is_single, of_faces, of_corners)| {
        let mut order: Vec<u32> = Vec::new();
        let mut indices = Vec::new();
        let mut start = 0;
        for (&end, has_some) in ends.iter().zip(of_faces) {
            for &entry in &of_corners[start..end] {
                let number = order
                    .iter()
                    .position(|&e| e == entry)
                    .unwrap_or(order.len());
                if has_some && number == order.len() {
                    order.push(entry);
                }
                indices.push(if has_some { number as u32 } else { NONE });
            }
            start = end;
        }
        let pairs = order
            .iter()
            .flat_map(|&e| [0.1 * f64::from(e), -f64::from(e)]);
        let values = if is_single {
            Values::F32(pairs.map(|x| x as f32).collect())
        } else {
            Values::F64(pairs.collect())
        };
        (!order.is_empty()).then_some(CornerProperty {
            name: UV.to_owned(),
            components: 2,
            values,
            indices,
        })
    })
}

fn faces(num_vertices: usize, max: usize) -> impl Strategy<Value = FaceList> {
    let polygon = prop::collection::vec(0..num_vertices as u32, 3..6);
    prop::collection::vec(polygon, 0..max).prop_map(|faces| faces.iter().collect())
}

fn document() -> impl Strategy<Value = Document> {
    let finite = prop::num::f64::NEGATIVE | prop::num::f64::NORMAL | prop::num::f64::ZERO;
    let points = prop::collection::vec(prop::array::uniform3(finite), 1..8);
    points
        .prop_flat_map(|points| {
            let n = points.len();
            (Just(points), faces(n, 6))
        })
        .prop_flat_map(|(points, faces)| {
            let comments = prop::collection::vec("([#-~\u{e9}][ -~\u{e9}]{0,10})?", 0..3);
            let of_vertices = properties(points.len());
            let of_faces = properties(faces.len());
            let uv = corner_uv(&faces);
            let mesh = Just((points, faces));
            (mesh, of_vertices, of_faces, uv, comments)
        })
        .prop_map(|((points, faces), vertices, of_faces, uv, comments)| {
            let points = points.into_iter().map(Point3::from).collect();
            let attributes = Attributes {
                vertices,
                faces: of_faces,
                corners: uv.into_iter().collect(),
                comments,
                ..Attributes::default()
            };
            Document::new(points, faces)
                .unwrap()
                .with_attributes(attributes)
                .unwrap()
        })
}

/// The file as ply-rs reads it and writes it in another encoding.
fn transcoded(bytes: &[u8], encoding: Encoding) -> Vec<u8> {
    let mut ply: Ply<DefaultElement> = Parser::new().read_ply(&mut &*bytes).unwrap();
    ply.header.encoding = encoding;
    let mut out = Vec::new();
    Writer::new().write_ply(&mut out, &mut ply).unwrap();
    out
}

/// The values of a corner property, per corner.
fn corner_values(property: &CornerProperty) -> Vec<Option<Vec<u64>>> {
    let value = |&i: &u32| {
        let bits = |k| property.values.get(2 * i as usize + k).unwrap().to_bits();
        (i != NONE).then(|| (0..2).map(bits).collect())
    };
    property.indices.iter().map(value).collect()
}

/// A mesh of a document's vertices and faces, in any order and with repetitions.
fn remap(document: &Document) -> impl Strategy<Value = Remap> + use<> {
    let (n, faces_before) = (document.positions().len() as u32, document.faces().clone());
    let num_corners = faces_before.num_corners() as u32;
    prop::collection::vec(0..n, 1..9)
        .prop_flat_map(move |vertices| {
            let faces = faces(vertices.len(), if num_corners > 0 { 6 } else { 1 });
            (Just(vertices), faces)
        })
        .prop_flat_map(move |(vertices, faces)| {
            let source = prop_oneof![
                4 => 0..(faces_before.len() as u32).max(1),
                1 => Just(NONE),
            ];
            let face_sources = prop::collection::vec(source, faces.len());
            let corner_sources = prop::collection::vec(0..num_corners.max(1), faces.num_corners());
            (Just((vertices, faces)), face_sources, corner_sources)
        })
        .prop_map(|((vertices, faces), face_sources, corner_sources)| Remap {
            vertices,
            faces,
            face_sources,
            corner_sources,
        })
}

proptest! {
    #[test]
    fn what_is_written_anew_is_read_again(document in document()) {
        let bytes = document.write(Format::Ply).unwrap();
        prop_assert!(crate::formats::losses(&document.contents(Format::Ply).unwrap(), Format::Ply).iter().all(|l| l.contains("lack")));
        let again = parse(&bytes);
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
        prop_assert_eq!(again.write(Format::Ply).unwrap(), bytes.clone());
        // As transcoded by ply-rs to the other encodings.
        for encoding in [Encoding::Ascii, Encoding::BinaryBigEndian] {
            let bytes = transcoded(&bytes, encoding);
            let again = parse(&bytes);
            prop_assert_eq!(again.positions(), document.positions());
            prop_assert_eq!(again.faces(), document.faces());
            prop_assert_eq!(again.attributes().unwrap(), document.attributes().unwrap());
            prop_assert_eq!(again.write(Format::Ply).unwrap(), bytes);
        }
    }

    #[test]
    fn a_rebuilt_file_says_what_the_old_one_said(
        (document, remap) in document().prop_flat_map(|document| {
            let remap = remap(&document);
            (Just(document), remap)
        }),
        encoding in 0usize..3,
    ) {
        let bytes = document.write(Format::Ply).unwrap();
        let bytes = match encoding {
            0 => bytes,
            1 => transcoded(&bytes, Encoding::BinaryBigEndian),
            _ => transcoded(&bytes, Encoding::Ascii),
        };
        let read = parse(&bytes);
        let rebuilt = read.remapped(&remap, Vec::new()).unwrap();
        let again = parse(&rebuilt.write(Format::Ply).unwrap());
        prop_assert_eq!(again.positions(), rebuilt.positions());
        prop_assert_eq!(again.faces(), &remap.faces);
        let found = rebuilt.attributes().unwrap();
        prop_assert_eq!(&again.attributes().unwrap(), &found);
        let expected = document.attributes().unwrap().remapped(&remap);
        prop_assert_eq!(&found.vertices, &expected.vertices);
        prop_assert_eq!(&found.comments, &expected.comments);
        match found.corner(UV) {
            Some(uv) => {
                prop_assert_eq!(&found.faces, &expected.faces);
                let mut values = corner_values(&expected.corners[0]);
                for face in 0..remap.faces.len() {
                    let corners = &mut values[remap.faces.corner_range(face)];
                    if corners.iter().any(Option::is_some) {
                        corners.iter_mut().for_each(|c| *c = c.take().or(Some(vec![0, 0])));
                    }
                }
                prop_assert_eq!(corner_values(uv), values);
            }
            None => {
                // If no corner with texture coordinates is left, the lists are empty.
                let faces: Vec<_> = found.faces.iter().filter(|p| p.name != "texcoord").collect();
                prop_assert_eq!(faces, expected.faces.iter().collect::<Vec<_>>());
                for uv in &expected.corners {
                    prop_assert!(uv.indices.iter().all(|&i| i == NONE));
                }
            }
        }
        // The unchanged mesh yields the unchanged bytes.
        let identity = Remap::identity(read.positions().len(), read.faces());
        let same = read.remapped(&identity, Vec::new()).unwrap();
        prop_assert_eq!(same.write(Format::Ply).unwrap(), bytes);
    }
}

/// Small files that cover all features of rows and headers.
fn samples() -> Vec<Vec<u8>> {
    let text = super::attribute_tests::RICH.to_vec();
    let strips = b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nelement tristrips 1\nproperty list int int vertex_indices\n\
        element edge 2\nproperty int vertex1\nproperty int vertex2\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n1 1 1\n7 0 1 2 3 -1 0 1\n0 1\n2 3\n";
    let plain = String::from_utf8_lossy(super::attribute_tests::RICH)
        .replace("1.#IND", "0")
        .replace("nan", "0")
        .replace("255.0", "255")
        .replace(".1 1. 1e400", "0.1 1.0 0")
        .replace("-inf", "0")
        .replace(" trailing", "");
    let mut binary: Ply<DefaultElement> = Parser::new().read_ply(&mut plain.as_bytes()).unwrap();
    let mut samples = vec![text, strips.to_vec()];
    for encoding in [Encoding::BinaryLittleEndian, Encoding::BinaryBigEndian] {
        binary.header.encoding = encoding;
        let mut out = Vec::new();
        Writer::new().write_ply(&mut out, &mut binary).unwrap();
        samples.push(out);
    }
    samples
}

/// For arbitrary bytes: a document that is read is complete, and every operation on it ends in a
/// file that can be read again, or in an error.
fn exercise(bytes: &[u8]) {
    let limits = Limits::default();
    let Ok(mut document) = open(bytes.to_vec(), &limits) else {
        return;
    };
    assert_eq!(document.write(Format::Ply).unwrap(), bytes);
    let (n, num_faces) = (document.positions().len(), document.faces().len());
    if let Ok(attributes) = document.attributes() {
        let corners = document.faces().num_corners();
        assert_eq!(attributes.misfit(n, num_faces, corners), None);
        let anew = Document::new(document.positions().to_vec(), document.faces().clone());
        let anew = anew
            .unwrap()
            .with_attributes(attributes.into_owned())
            .unwrap();
        let again = parse(&anew.write(Format::Ply).unwrap());
        assert_eq!(again.faces(), document.faces());
        assert!(again.attributes().is_ok());
    }
    let reversed: FaceList = document
        .faces()
        .iter()
        .map(|polygon| -> Vec<u32> {
            let new = polygon.iter().rev().map(|&v| n as u32 - 1 - v);
            new.collect()
        })
        .collect();
    let corner_sources = (0..num_faces).flat_map(|f| document.faces().corner_range(f).rev());
    let remap = Remap {
        vertices: (0..n as u32).rev().collect(),
        face_sources: (0..num_faces as u32).collect(),
        corner_sources: corner_sources.map(|c| c as u32).collect(),
        faces: reversed,
    };
    if let Ok(rebuilt) = document.remapped(&remap, Vec::new()) {
        let again = parse(&rebuilt.write(Format::Ply).unwrap());
        assert_eq!(again.faces(), &remap.faces);
        assert_eq!(again.positions(), rebuilt.positions());
    }
    let p = document.positions()[0];
    document.set_position(0, p.map(|x| x + 1.0)).unwrap();
    if let Ok(written) = document.write(Format::Ply) {
        assert_eq!(parse(&written).faces(), document.faces());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn damaged_files_are_refused_or_whole(
        sample in 0usize..4,
        changes in prop::collection::vec((any::<prop::sample::Index>(), 0u8..3, any::<u8>()), 1..5),
    ) {
        let mut bytes = samples().swap_remove(sample);
        for (at, change, byte) in changes {
            let at = at.index(bytes.len());
            // Mostly characters that occur in such files.
            let byte = if byte < 128 { b"0123 -.\n\r"[usize::from(byte) % 9] } else { byte };
            match change {
                0 => bytes[at] = byte,
                1 => bytes.insert(at, byte),
                _ => {
                    bytes.remove(at);
                }
            }
        }
        exercise(&bytes);
    }
}
