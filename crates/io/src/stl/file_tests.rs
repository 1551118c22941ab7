//! Tests on other files: a comparison with a second reader, arbitrary files, and those next to
//! the workspace.

use std::path::Path;

use proptest::prelude::*;

use super::is_stl;
use super::tests::{O, TEXT, TestFacet, binary, load, point, tetrahedron};
use crate::attributes::{Attributes, NORMAL};
use crate::document::Document;
use crate::format::Format;
use crate::remap::Remap;

#[test]
fn the_files_beside_the_workspace_do_what_is_expected() {
    let Some(table) = cotan_testing::shared("malformed/expect.json") else {
        return;
    };
    let shared = Path::new(cotan_testing::SHARED);
    let table = std::fs::read_to_string(table).unwrap();
    let table: serde_json::Value = serde_json::from_str(&table).unwrap();
    let rows = table
        .as_array()
        .or_else(|| table["files"].as_array())
        .unwrap();
    for row in rows {
        let name = row["file"].as_str().unwrap();
        if !(name.ends_with(".stl") || name.ends_with(".off")) {
            continue;
        }
        let found = crate::load(shared.join("malformed").join(name));
        match row["expect"].as_str().unwrap() {
            "ERROR" => eprintln!("{name}: {}", found.unwrap_err()),
            "EITHER" if found.is_err() => eprintln!("{name}: {}", found.unwrap_err()),
            _ => {
                let document = found.unwrap();
                let counts = (document.positions().len(), document.faces().num_triangles());
                let expected = (&row["V"], &row["F"]);
                let expected = (expected.0.as_u64().unwrap(), expected.1.as_u64().unwrap());
                assert_eq!((counts.0 as u64, counts.1 as u64), expected, "{name}");
                eprintln!("{name}: {counts:?} {:?}", document.warnings());
            }
        }
    }
    let document = crate::load(shared.join("meshes/tray_bottom.stl")).unwrap();
    let counts = (document.positions().len(), document.faces().len());
    assert_eq!(counts, (2216, 4520));
    let mesh = document.surface().unwrap();
    assert_eq!(mesh.mesh().num_vertices(), 2216);
}

/// Positions and triangles.
type Soup = (Vec<[f32; 3]>, Vec<[usize; 3]>);

/// The result of `stl_io` for a file: distinct positions and triangles.
fn oracle(bytes: &[u8]) -> Option<Soup> {
    let mesh = stl_io::read_stl(&mut std::io::Cursor::new(bytes)).ok()?;
    let vertices = mesh.vertices.iter().map(|v| v.0).collect();
    Some((vertices, mesh.faces.iter().map(|f| f.vertices).collect()))
}

/// The corners of all facets in the precision of the oracle.
fn soup(document: &Document) -> Vec<[[f32; 3]; 3]> {
    let position = |v: u32| {
        document.positions()[v as usize]
            .coords
            .map(|x| x as f32 + 0.0)
            .into()
    };
    let faces = document.faces().iter();
    faces
        .map(|f| [position(f[0]), position(f[1]), position(f[2])])
        .collect()
}

fn agrees_with_oracle(bytes: &[u8]) {
    let Ok(document) = load(bytes) else { return };
    let Some((vertices, faces)) = oracle(bytes) else {
        return;
    };
    let theirs: Vec<[[f32; 3]; 3]> = faces
        .iter()
        .map(|f| f.map(|v| vertices[v].map(|x| x + 0.0)))
        .collect();
    assert_eq!(soup(&document), theirs);
}

#[test]
fn stl_io_reads_the_same() {
    agrees_with_oracle(&tetrahedron());
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n\
        vertex 0 1 0\nendloop\nendfacet\nendsolid a\n";
    assert!(oracle(text.as_bytes()).is_some());
    agrees_with_oracle(text.as_bytes());
    // The oracle may mistake a binary file whose header starts with `solid` for text; we must
    // not.
    let mut bytes = tetrahedron();
    bytes[20] = b'\n';
    assert!(load(bytes.clone()).is_ok());
    bytes[0] = b'S';
    assert!(oracle(&bytes).is_some());
    agrees_with_oracle(&bytes);
}

fn facets() -> impl Strategy<Value = Vec<([f32; 3], [[f32; 3]; 3], u16)>> {
    let coordinate = prop_oneof![
        (-2i8..3).prop_map(f32::from),
        any::<f32>().prop_filter("finite", |x| x.is_finite()),
        Just(-0.0f32),
    ];
    let point = prop::array::uniform3(coordinate);
    let normal = prop_oneof![point.clone(), Just([f32::NAN; 3]), Just(O)];
    prop::collection::vec((normal, prop::array::uniform3(point), any::<u16>()), 1..20)
}

/// The same facets as text, with odd spacing determined by each facet's attribute.
fn text(facets: &[TestFacet]) -> String {
    use std::fmt::Write as _;
    let mut out = String::from("solid t\n");
    for (normal, corners, odd) in facets {
        let blank = [" ", "\n", "\r\n", "\t ", " \n\n"][*odd as usize % 5];
        let [x, y, z] = normal;
        let _ = write!(
            out,
            "facet{blank}normal {x:?} {y:e}{blank}{z} outer loop{blank}"
        );
        for [x, y, z] in corners {
            let _ = write!(out, "vertex {x:e}{blank}{y:?} {z}{blank}");
        }
        out.push_str("endloop endfacet\n");
    }
    out + "endsolid t\n"
}

proptest! {
    #[test]
    fn own_bytes_stay_and_a_new_file_reads_the_same(facets in facets()) {
        let bytes = binary("x", &facets);
        let document = load(bytes.clone()).unwrap();
        prop_assert_eq!(&document.write(Format::Stl).unwrap(), &bytes);
        agrees_with_oracle(&bytes);
        // A document in memory is written as a new file.
        let attributes = document.attributes().unwrap().into_owned();
        let kept = document.clone().with_attributes(attributes.clone()).unwrap();
        let again = load(kept.write(Format::Stl).unwrap()).unwrap();
        prop_assert_eq!(again.positions(), document.positions());
        prop_assert_eq!(again.faces(), document.faces());
        if attributes.face(NORMAL).is_some() {
            let debug = |a: &Attributes| format!("{a:?}");
            prop_assert_eq!(debug(&again.attributes().unwrap()), debug(&attributes));
        }

        let text = text(&facets);
        let from_text = load(text.clone()).unwrap();
        prop_assert_eq!(from_text.write(Format::Stl).unwrap(), text.as_bytes());
        prop_assert_eq!(soup(&from_text), soup(&document));
        prop_assert_eq!(from_text.faces(), document.faces());
        let remap = Remap::identity(from_text.positions().len(), from_text.faces());
        let same = from_text.remapped(&remap, Vec::new()).unwrap();
        prop_assert_eq!(same.write(Format::Stl).unwrap(), text.as_bytes());
    }

    #[test]
    fn moved_files_read_back(facets in facets(), moves in prop::collection::vec((any::<prop::sample::Index>(), prop::array::uniform3(-9i8..9)), 1..9)) {
        for bytes in [binary("x", &facets), text(&facets).into_bytes()] {
            let mut document = load(bytes).unwrap();
            let count = document.positions().len();
            for (at, position) in &moves {
                let [x, y, z] = position.map(f64::from);
                document.set_position(at.index(count), point(x, y, z)).unwrap();
            }
            let again = load(document.write(Format::Stl).unwrap()).unwrap();
            prop_assert_eq!(soup(&again), soup(&document));
        }
    }

    #[test]
    fn arbitrary_bytes_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        text in "(solid [a-z ]{0,3}\r?\n)?((facet|normal|outer|loop|vertex|endloop|endfacet|endsolid|solid|1|nan|-2e3)[ \n]){0,60}",
        at in any::<prop::sample::Index>(), b: u8,
    ) {
        for mut bytes in [bytes, text.into_bytes(), TEXT.into(), tetrahedron()] {
            if !bytes.is_empty() {
                let at = at.index(bytes.len());
                bytes[at] = b;
            }
            let _ = is_stl(&bytes);
            agrees_with_oracle(&bytes);
            if let Ok(document) = load(bytes.clone()) {
                prop_assert_eq!(document.write(Format::Stl).unwrap(), bytes);
                document.attributes().unwrap();
            }
        }
    }

    #[test]
    fn any_gathering_of_facets_is_written_as_it_is(
        facets in facets(),
        order in prop::collection::vec(
            (any::<prop::sample::Index>(), 0usize..6, any::<prop::sample::Index>(), 0u8..5),
            1..20,
        ),
        solids in any::<u64>(),
    ) {
        let mut text = text(&facets);
        // Solids end at some of the facets.
        for k in (1..facets.len()).rev().filter(|k| solids >> k & 1 == 1) {
            let at = text.match_indices("facet").filter(|(at, _)| !text[..*at].ends_with("end"));
            let at = at.map(|(at, _)| at).nth(k).unwrap();
            text.insert_str(at, if k % 2 == 0 { "endsolid\nsolid\n" } else { "endsolid\nSOLID b\n \n" });
        }
        for bytes in [binary("x", &facets), text.into_bytes()] {
            let document = load(bytes).unwrap();
            let count = document.positions().len();
            let mut remap = Remap {
                vertices: (0..count as u32).collect(),
                ..Remap::default()
            };
            let mut faces = Vec::new();
            for (face, turn, vertex, kind) in &order {
                let face = face.index(document.faces().len());
                let slots = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]][*turn];
                let old = document.faces().get(face).unwrap();
                let mut corners = slots.map(|k| old[k]);
                match kind {
                    // Redirect to another vertex, redirect to a copy, or close a hole.
                    1 => corners[0] = vertex.index(count) as u32,
                    2 => {
                        remap.vertices.push(corners[1]);
                        corners[1] = remap.vertices.len() as u32 - 1;
                    }
                    _ => {}
                }
                faces.push(corners);
                remap.face_sources.push(if *kind == 3 { u32::MAX } else { face as u32 });
                remap.corner_sources.extend(slots.map(|k| (3 * face + k) as u32));
            }
            remap.faces = faces.iter().collect();
            let mut again = document.remapped(&remap, Vec::new()).unwrap();
            let read = load(again.write(Format::Stl).unwrap()).unwrap();
            prop_assert_eq!(soup(&read), soup(&again));
            prop_assert_eq!(read.attributes().unwrap().misfit(0, faces.len(), 0), None);
            again.set_position(0, point(0.5, 0.25, 0.125)).unwrap();
            let read = load(again.write(Format::Stl).unwrap()).unwrap();
            prop_assert_eq!(soup(&read), soup(&again));
        }
    }
}
