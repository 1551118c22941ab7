//! For arbitrary bytes, nothing panics, and a document that is read is complete.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

use cotan_io::{Document, Format, Limits, read};
use proptest::prelude::*;

const FORMATS: [Format; 3] = [Format::Obj, Format::Ply, Format::Off];

const OBJ: &str = "# cube corner\nmtllib a.mtl\nv 0 0 0\nv 1.5 0 0\nv 1 1e-1 0 1 0 0\nv 0 1 0\n\
                   vt 0 0\nvn 0 0 1\ng a\nf 1/1 2/1 3/1 \\\n4/1\nf -4//1 -3//1 -1//1\n";
const OFF: &str = "COFF # c\n4 2 0\n0 0 0 255 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 2 1 1 1 1\n";
const PLY: &str = "ply\nformat ascii 1.0\ncomment c\nelement vertex 4\nproperty list uchar int l\n\
                   property float x\nproperty double y\nproperty int z\nproperty uchar red\n\
                   element face 2\nproperty list uchar int vertex_indices\nend_header\n\
                   1 2 0 0 0 9\n0 1 0 0 9\n0 1 1 0 9\n0 0 1 0 9\n4 0 1 2 3\n3 0 2 1\n";

/// The same mesh as a binary PLY file.
fn binary() -> Vec<u8> {
    let document = read(PLY, None, &Limits::default()).unwrap();
    let off = document.write(Format::Off).unwrap();
    read(off, None, &Limits::default())
        .unwrap()
        .write(Format::Ply)
        .unwrap()
}

/// Checks the invariants of every document.
fn check(document: &Document, bytes: &[u8]) {
    let num_vertices = document.positions().len();
    assert!(num_vertices > 0);
    assert!(
        document
            .positions()
            .iter()
            .all(|p| p.iter().all(|x| x.is_finite()))
    );
    for polygon in document.faces().iter() {
        assert!(polygon.len() >= 3 && polygon.iter().all(|&v| (v as usize) < num_vertices));
    }
    assert!(document.write(document.format().unwrap()).unwrap() == bytes);
    for format in FORMATS
        .into_iter()
        .filter(|&format| Some(format) != document.format())
    {
        // Data that was only retained is decoded now, and may be invalid.
        if let Err(refused) = document.attributes() {
            let error = document.write(format).unwrap_err();
            assert_eq!(error.to_string(), refused.to_string());
            continue;
        }
        let written = document.write(format).unwrap();
        let again = read(written, Some(format), &Limits::default()).unwrap();
        assert_eq!(again.positions(), document.positions());
        assert_eq!(again.faces(), document.faces());
    }
    // An STL has 32-bit numbers, and only the vertices that faces use.
    if let Ok(written) = document.write(Format::Stl) {
        let again = read(written, None, &Limits::default()).unwrap();
        assert_eq!(again.format(), Some(Format::Stl));
        assert_eq!(again.faces().len(), document.faces().num_triangles());
    }
    if let Ok(processing) = document.surface() {
        assert!(processing.mesh().is_triangle_mesh());
        let mut moved = document.clone();
        let positions = processing
            .positions()
            .map(|p| p.map(|x| (x * 0.5).round() + 1.0));
        moved.set_positions(&processing, &positions).unwrap();
        // An integer coordinate may not fit; anything else is written and read again.
        if let Ok(written) = moved.write(moved.format().unwrap()) {
            let again = read(written, moved.format(), &Limits::default()).unwrap();
            for (a, b) in again.positions().iter().zip(moved.positions()) {
                assert_eq!(a.map(|x| x as f32), b.map(|x| x as f32));
            }
            assert_eq!(again.faces(), moved.faces());
        }
    }
}

fn read_and_check(bytes: &[u8]) {
    for hint in FORMATS {
        match read(bytes, Some(hint), &Limits::default()) {
            Ok(document) => check(&document, bytes),
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
}

#[test]
fn the_samples_are_read() {
    for (bytes, format) in [
        (OBJ.as_bytes(), Format::Obj),
        (OFF.as_bytes(), Format::Off),
        (PLY.as_bytes(), Format::Ply),
        (&binary(), Format::Ply),
    ] {
        let document = read(bytes, None, &Limits::default()).unwrap();
        assert_eq!(document.format(), Some(format));
        assert_eq!((document.positions().len(), document.faces().len()), (4, 2));
        check(&document, bytes);
    }
}

#[test]
fn every_prefix_is_read_or_refused() {
    for sample in [OBJ.as_bytes(), OFF.as_bytes(), PLY.as_bytes(), &binary()] {
        for length in 0..sample.len() {
            read_and_check(&sample[..length]);
        }
    }
}

/// A change to a file: overwrite, insert or remove at a position.
#[derive(Clone, Debug)]
enum Mutation {
    Overwrite(prop::sample::Index, u8),
    Insert(prop::sample::Index, Vec<u8>),
    Remove(prop::sample::Index, usize),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let snippet = prop_oneof![
        prop::sample::select(vec![
            "-1",
            "0",
            "4294967296",
            "99999999999999999999",
            "nan",
            "1e999",
            "-",
            "\\\n",
            "\r",
            "#",
            "\n",
            "f 1 2 3\n",
            "v 1 2 3\n",
            "/",
            "element x 9\n",
            "list",
            "1e-5",
            " ",
            "uchar",
        ])
        .prop_map(|text| text.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 1..5),
    ];
    prop_oneof![
        (any::<prop::sample::Index>(), any::<u8>()).prop_map(|(at, b)| Mutation::Overwrite(at, b)),
        (any::<prop::sample::Index>(), snippet).prop_map(|(at, s)| Mutation::Insert(at, s)),
        (any::<prop::sample::Index>(), 1usize..9).prop_map(|(at, n)| Mutation::Remove(at, n)),
    ]
}

fn mutate(bytes: &mut Vec<u8>, mutation: &Mutation) {
    match mutation {
        Mutation::Overwrite(at, b) if !bytes.is_empty() => {
            let at = at.index(bytes.len());
            bytes[at] = *b;
        }
        Mutation::Insert(at, snippet) => {
            let at = at.index(bytes.len() + 1);
            bytes.splice(at..at, snippet.iter().copied());
        }
        Mutation::Remove(at, count) if !bytes.is_empty() => {
            let at = at.index(bytes.len());
            bytes.drain(at..(at + count).min(bytes.len()));
        }
        _ => {}
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn arbitrary_bytes_are_read_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        read_and_check(&bytes);
    }

    #[test]
    fn arbitrary_rows_are_read_or_refused(
        text in "(OFF\n|ply\nformat (ascii|binary_big_endian) 1.0\n)?([vf#0-9 ./-]{0,20}\r?\n){0,20}",
    ) {
        read_and_check(text.as_bytes());
    }

    #[test]
    fn damaged_files_are_read_or_refused(
        sample in 0usize..4,
        mutations in prop::collection::vec(mutation(), 1..6),
    ) {
        let mut bytes = match sample {
            0 => OBJ.as_bytes().to_vec(),
            1 => OFF.as_bytes().to_vec(),
            2 => PLY.as_bytes().to_vec(),
            _ => binary(),
        };
        mutations.iter().for_each(|mutation| mutate(&mut bytes, mutation));
        read_and_check(&bytes);
    }
}
