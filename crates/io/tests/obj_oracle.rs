//! Comparison of the OBJ reader with tobj: if both accept a file, positions and faces are equal.

#![allow(clippy::unwrap_used, reason = "a test stops at the first surprise")]

mod obj_filter;

use std::fmt::Write as _;

use cotan_io::{Format, Limits, read};
use proptest::prelude::*;

use obj_filter::{agree, for_tobj, read_by_tobj};

/// Compares the results if both readers accept the text. Returns `true` if they do.
fn compare(text: &[u8]) -> bool {
    let Some((filtered, num_vertices)) = for_tobj(text) else {
        return false;
    };
    let ours = read(text.to_vec(), Some(Format::Obj), &Limits::default());
    let (Ok(ours), Some(theirs)) = (ours, read_by_tobj(&filtered, num_vertices)) else {
        return false;
    };
    assert_eq!(ours.positions().len(), theirs.0.len());
    for (ours, theirs) in ours.positions().iter().zip(&theirs.0) {
        let same = ours.iter().zip(theirs).all(|(&x, &y)| agree(x, y));
        assert!(same, "{ours} {theirs:?}");
    }
    let faces: Vec<&[u32]> = ours.faces().iter().collect();
    assert_eq!(faces, theirs.1);
    true
}

/// A file with all forms of numbers and indices that both readers support.
fn text() -> impl Strategy<Value = String> {
    let number = prop_oneof![
        "-?[0-9]{1,9}(\\.[0-9]{0,9})?",
        "-?\\.[0-9]{1,20}",
        "[+-]?[0-9]{1,3}(\\.[0-9]{1,17})?[eE][+-]?[0-9]{1,2}",
        any::<f32>()
            .prop_filter("finite", |x| x.is_finite())
            .prop_map(|x| x.to_string()),
    ];
    let vertex = prop::collection::vec(number, 3..7);
    let vertices = prop::collection::vec(vertex, 1..30);
    let face = (
        prop::collection::vec((any::<u16>(), 0u8..8), 3..7),
        any::<bool>(),
    );
    let faces = prop::collection::vec(face, 0..40);
    (vertices, faces, any::<bool>()).prop_map(|(vertices, faces, crlf)| {
        let count = vertices.len();
        let mut text = "# made\nmtllib none.mtl\nvt 0 0\nvn 0 0 1\n".to_owned();
        for (k, vertex) in vertices.iter().enumerate() {
            writeln!(text, "v {}", vertex.join(" ")).unwrap();
            if k % 7 == 3 {
                text.push_str("g some\nusemtl other\n");
            }
        }
        for (corners, relative) in faces {
            text.push('f');
            for (vertex, form) in corners {
                let vertex = usize::from(vertex) % count;
                let index = match relative {
                    true => format!("-{}", count - vertex),
                    false => format!("{}", vertex + 1),
                };
                let rest = ["", "/1", "//1", "/1/1", "/-1/-1", "", "", ""][usize::from(form)];
                write!(text, " {index}{rest}").unwrap();
            }
            text.push('\n');
        }
        if crlf {
            text.replace('\n', "\r\n")
        } else {
            text
        }
    })
}

proptest! {
    #[test]
    fn both_read_the_same(text in text()) {
        prop_assert!(compare(text.as_bytes()));
    }

    #[test]
    fn where_both_accept_broken_files_they_read_the_same(
        text in text(),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..5),
    ) {
        let mut text = text.into_bytes();
        for (at, byte) in changes {
            let at = at.index(text.len());
            text[at] = byte;
        }
        compare(&text);
    }
}

#[test]
fn what_tobj_panics_on_is_kept_from_it() {
    for line in [
        "f 1//6148914691236517206 2 3",
        "f 1/-2/-2 2 3",
        "mtllib /etc/passwd",
    ] {
        let text = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{line}\nf 1 2 3\n");
        assert!(compare(text.as_bytes()), "{line}");
    }
    assert_eq!(for_tobj(b"v 0 0 0 \\\n1\n"), None);
}

/// Real meshes that developers have in a folder next to the workspace; it need not exist.
#[test]
fn real_meshes_are_read_the_same() {
    let Some(folder) = cotan_testing::shared("meshes") else {
        return;
    };
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if Format::from_path(&path) == Some(Format::Obj) {
            assert!(
                compare(&std::fs::read(&path).unwrap()),
                "{}",
                path.display()
            );
        }
    }
}
