//! A vertex that does not move keeps its digits, in every format and number type. The bytes of
//! the file are the same if nothing moves, and those of the other vertices are the same if one
//! does.

use std::io::Write as _;

use cotan_geometry::shapes::{icosphere, torus};
use cotan_geometry::{Mesh, Positions, Scalar};
use cotan_io::{Document, FaceList, Format, Limits, NoFiles, read, read_with};
use flate2::{Compression, write::GzEncoder};
use nalgebra::{Point3, Vector3};
use proptest::prelude::*;

/// A file, and the changes that a moved vertex may cause in it.
struct Case {
    name: &'static str,
    bytes: Vec<u8>,
    format: Format,
}

/// Coordinates as people and programs write them: more digits than a number has, trailing zeros,
/// signs, exponents.
fn odd_number(x: f64, style: u32) -> String {
    match style % 6 {
        0 => format!("{x:.20}"),
        1 => format!("{x:.3}00"),
        2 => format!("{x:e}"),
        3 => format!("{}{x:.17}", if x < 0.0 { "" } else { "+" }),
        4 => format!("{x:.7}"),
        _ => format!("{x}"),
    }
}

fn triple(p: &Point3<f64>, seed: u32) -> String {
    let words: Vec<String> = [p.x, p.y, p.z]
        .into_iter()
        .zip(0u32..)
        .map(|(x, k)| odd_number(x, seed.wrapping_mul(7) + k))
        .collect();
    words.join(" ")
}

fn obj(shape: &Mesh<f64>) -> Vec<u8> {
    let mut text = String::from("# odd digits\r\n");
    for (v, p) in shape.positions().iter() {
        text += &format!("v  {}\t# {}\n", triple(p, v.index() as u32), v.index());
    }
    for f in shape.connectivity().faces() {
        let [a, b, c] = shape.connectivity().triangle(f).map(|v| v.index() + 1);
        text += &format!("f {a} {b} {c}\n");
    }
    text.into_bytes()
}

fn off(shape: &Mesh<f64>) -> Vec<u8> {
    let mut text = format!("OFF\n{} {} 0\n", shape.positions().len(), shape.num_faces());
    for (v, p) in shape.positions().iter() {
        text += &format!("{}\n", triple(p, v.index() as u32));
    }
    for f in shape.connectivity().faces() {
        let [a, b, c] = shape.connectivity().triangle(f).map(|v| v.index());
        text += &format!("3 {a} {b} {c}\n");
    }
    text.into_bytes()
}

fn ply_text(shape: &Mesh<f64>, number: &str) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty {number} x\nproperty {number} y\n\
         property {number} z\nproperty uchar red\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        shape.positions().len(),
        shape.num_faces()
    );
    for (v, p) in shape.positions().iter() {
        text += &format!("{} {}\n", triple(p, v.index() as u32), v.index() % 256);
    }
    for f in shape.connectivity().faces() {
        let [a, b, c] = shape.connectivity().triangle(f).map(|v| v.index());
        text += &format!("3 {a} {b} {c}\n");
    }
    text.into_bytes()
}

fn ply_binary(shape: &Mesh<f64>, number: &str, order: &str) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_{order}_endian 1.0\nelement vertex {}\nproperty {number} x\n\
         property {number} y\nproperty {number} z\nelement face {}\n\
         property list uchar int vertex_indices\nend_header\n",
        shape.positions().len(),
        shape.num_faces()
    )
    .into_bytes();
    let is_little = order == "little";
    for x in shape.positions().values().flat_map(|p| [p.x, p.y, p.z]) {
        match (number, is_little) {
            ("float", true) => bytes.extend((x as f32).to_le_bytes()),
            ("float", false) => bytes.extend((x as f32).to_be_bytes()),
            (_, true) => bytes.extend(x.to_le_bytes()),
            (_, false) => bytes.extend(x.to_be_bytes()),
        }
    }
    for f in shape.connectivity().faces() {
        bytes.push(3);
        for v in shape.connectivity().triangle(f) {
            let v = v.index() as i32;
            bytes.extend(if is_little {
                v.to_le_bytes()
            } else {
                v.to_be_bytes()
            });
        }
    }
    bytes
}

/// Facets with zero normals, as many programs write them.
fn stl_text(shape: &Mesh<f64>) -> Vec<u8> {
    let mut text = String::from("solid odd digits\n");
    for f in shape.connectivity().faces() {
        text += "facet normal 0 0 0\n outer loop\n";
        for v in shape.connectivity().triangle(f) {
            text += &format!(
                "  vertex {}\n",
                triple(&shape.positions()[v], v.index() as u32)
            );
        }
        text += " endloop\nendfacet\n";
    }
    text += "endsolid odd digits\n";
    text.into_bytes()
}

fn written(shape: &Mesh<f64>, format: Format) -> Vec<u8> {
    let faces: FaceList = shape
        .connectivity()
        .faces()
        .map(|f| shape.connectivity().triangle(f).map(|v| v.index() as u32))
        .collect();
    let document =
        Document::new(shape.positions().values().copied().collect(), faces).expect("a document");
    document.write(format).expect("a file")
}

/// A glTF with a node that rotates, scales and translates its mesh.
fn gltf(shape: &Mesh<f64>, node: &str) -> Vec<u8> {
    let text = String::from_utf8(written(shape, Format::Gltf)).expect("text");
    // The file of a mesh that is small relative to its distance from the origin already has a
    // node.
    let (before, rest) = text.split_once(r#""nodes":[{"mesh":0"#).expect("a node");
    let (_, after) = rest.split_once("}]").expect("an end");
    let placed = format!(r#"{before}"nodes":[{{"mesh":0,{node}}}]{after}"#);
    placed.into_bytes()
}

fn gzipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).expect("in memory");
    encoder.finish().expect("in memory")
}

fn cases(shape: &Mesh<f64>) -> Vec<Case> {
    let turned = r#""rotation":[0.18257418,0.36514837,0.5477226,0.73029674],"scale":[0.3,1.7,2.9],"translation":[11.1,-5.3,0.7]"#;
    let matrix = r#""matrix":[0.6,0.8,0,0,-0.8,0.6,0,0,0.1,0.2,1.3,0,100.1,200.2,-300.3,1]"#;
    let case = |name, bytes, format| Case {
        name,
        bytes,
        format,
    };
    vec![
        case("obj", obj(shape), Format::Obj),
        case("off", off(shape), Format::Off),
        case("ply float text", ply_text(shape, "float"), Format::Ply),
        case("ply double text", ply_text(shape, "double"), Format::Ply),
        case(
            "ply float little",
            ply_binary(shape, "float", "little"),
            Format::Ply,
        ),
        case(
            "ply float big",
            ply_binary(shape, "float", "big"),
            Format::Ply,
        ),
        case(
            "ply double little",
            ply_binary(shape, "double", "little"),
            Format::Ply,
        ),
        case("stl text", stl_text(shape), Format::Stl),
        case("stl binary", written(shape, Format::Stl), Format::Stl),
        case("glb", written(shape, Format::Glb), Format::Glb),
        case("gltf turned", gltf(shape, turned), Format::Gltf),
        case("gltf matrix", gltf(shape, matrix), Format::Gltf),
        case("obj gz", gzipped(&obj(shape)), Format::Obj),
        case(
            "ply gz",
            gzipped(&ply_binary(shape, "float", "little")),
            Format::Ply,
        ),
    ]
}

fn unpacked(bytes: &[u8]) -> Vec<u8> {
    let document = read_with(bytes.to_vec(), None, &Limits::default(), &NoFiles).expect("a mesh");
    let format = document.format().expect("of a file");
    document.write(format).expect("a file")
}

/// Simulates a job in this number type that moves nothing but `moved`.
fn set<T: Scalar>(document: &mut Document, moved: Option<(usize, Vector3<f64>)>) {
    let processing = document.surface().expect("a surface");
    let mut positions: Positions<T> = processing.positions().map(|p| p.map(T::of_f64));
    if let Some((vertex, by)) = moved {
        let v = processing
            .vertex(vertex % document.positions().len())
            .expect("a vertex");
        positions[v] += by.map(T::of_f64);
    }
    document
        .set_positions(&processing, &positions)
        .expect("positions that fit");
}

fn shapes() -> impl Strategy<Value = Mesh<f64>> {
    let shape = prop_oneof![
        Just(icosphere::<f64>(1)),
        Just(torus::<f64>(1.0, 0.4, 7, 5))
    ];
    (shape, -8.0..8.0_f64, prop::array::uniform3(-3.0..3.0_f64)).prop_map(
        |(mut shape, scale, by)| {
            for p in shape.positions_mut().iter_mut() {
                *p = *p * scale.exp2() + Vector3::from(by);
            }
            shape
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn nothing_moves_and_no_byte_changes(shape in shapes()) {
        for case in cases(&shape) {
            let mut document = read(case.bytes.clone(), Some(case.format), &Limits::default()).expect("a mesh");
            let as_read = unpacked(&case.bytes);
            set::<f64>(&mut document, None);
            prop_assert_eq!(&document.write(case.format).expect("a file"), &as_read, "{} f64", case.name);
            set::<f32>(&mut document, None);
            prop_assert_eq!(&document.write(case.format).expect("a file"), &as_read, "{} f32", case.name);
        }
    }

    #[test]
    fn one_vertex_moves_and_the_others_keep_their_bytes(
        shape in shapes(),
        vertex in 0usize..1000,
        by in prop::array::uniform3(0.01..0.1_f64),
        is_single in any::<bool>(),
    ) {
        for case in cases(&shape) {
            let mut document = read(case.bytes.clone(), Some(case.format), &Limits::default()).expect("a mesh");
            let before = document.positions().to_vec();
            let as_read = unpacked(&case.bytes);
            let moved = Some((vertex, Vector3::from(by)));
            match is_single {
                true => set::<f32>(&mut document, moved),
                false => set::<f64>(&mut document, moved),
            }
            let bytes = document.write(case.format).expect("a file");
            let after = read(bytes.clone(), Some(case.format), &Limits::default()).expect("a mesh");
            let at = before[vertex % before.len()];
            let mut num_moved = 0;
            for (p, q) in before.iter().zip(after.positions()) {
                if *p == at {
                    prop_assert_ne!(p, q, "{}", case.name);
                    num_moved += 1;
                } else {
                    prop_assert_eq!(p, q, "{}", case.name);
                }
            }
            // In formats with one line per vertex no other line changes; an STL has one line per
            // facet.
            let corners = document.faces().corners().iter();
            let num_facets = corners.filter(|&&v| before[v as usize] == at).count();
            let num_places = if case.format == Format::Stl { num_facets } else { num_moved };
            if let (Ok(was), Ok(is)) = (std::str::from_utf8(&as_read), std::str::from_utf8(&bytes)) {
                if !matches!(case.format, Format::Gltf) {
                    prop_assert_eq!(was.lines().count(), is.lines().count());
                    let changed = was.lines().zip(is.lines()).filter(|(was, is)| was != is);
                    let vertices = changed.filter(|(was, _)| !was.starts_with("facet"));
                    prop_assert_eq!(vertices.count(), num_places, "{}", case.name);
                }
            } else if !matches!(case.format, Format::Glb) {
                let changed = as_read.iter().zip(&bytes).filter(|(was, is)| was != is).count();
                // Three numbers of at most eight bytes; in an STL of four bytes, plus the three
                // of the normal.
                prop_assert!(changed <= 24 * num_places, "{}: {changed} bytes", case.name);
            }
        }
    }
}

#[test]
fn an_edit_of_a_file_of_32_bits_far_from_the_origin_is_warned_of() {
    let mut shape = icosphere::<f64>(2);
    for (distance, is_severe) in [(10.0, false), (2e6, true)] {
        for p in shape.positions_mut() {
            *p += Vector3::new(distance, 0.0, -distance);
        }
        for (bytes, format) in [
            (ply_binary(&shape, "float", "little"), Format::Ply),
            (ply_text(&shape, "float"), Format::Ply),
            // Its node holds the offset, so that its numbers are small.
            (written(&shape, Format::Gltf), Format::Gltf),
        ] {
            let mut document = read(bytes, None, &Limits::default()).unwrap();
            assert_eq!(document.losses(format), Vec::<String>::new());
            let p = document.positions()[5] + Vector3::new(0.01, 0.02, 0.03);
            document.set_position(5, p).unwrap();
            let losses = document.losses(format).join("\n");
            let is_warned = losses.contains("single precision, too little so far from its origin");
            let is_severe = is_severe && format != Format::Gltf;
            assert_eq!(is_warned, is_severe, "{format} at {distance}: {losses}");
            // The reported losses are the actual ones.
            let again = document.write(format).unwrap();
            let again = read(again, None, &Limits::default()).unwrap();
            // As seen by a program that reads 32-bit numbers.
            let moved = (again.positions()[5].map(|x| f64::from(x as f32)) - p).amax();
            if let Some((_, told)) = losses.split_once("vertices move by ") {
                let told: f64 = told.split(' ').next().unwrap().parse().unwrap();
                assert!((told - moved).abs() <= 0.06 * moved, "{losses}: {moved}");
            } else {
                let moved = (again.positions()[5] - p).amax();
                assert!(moved < 1e-6, "{format}: {moved}");
            }
        }
    }
}
