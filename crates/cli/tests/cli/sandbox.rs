//! A temporary folder for each test, in which the command runs on small meshes.

use std::collections::BTreeMap;
use std::ffi::{OsStr, OsString};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use cotan::Mesh;
use cotan::halfedge::VertexId;
use cotan::shapes;
use cotan_io::Document;
use nalgebra::Point3;
use serde_json::Value;

pub(crate) struct Sandbox {
    folder: tempfile::TempDir,
}

/// The outcome of a run.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Sandbox {
    /// An empty folder.
    pub(crate) fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a folder for the test"),
        }
    }

    /// A folder with `bar.obj`, 6 × 1 × 1 along x around the origin.
    pub(crate) fn with_bar() -> Self {
        let sandbox = Self::new();
        let document =
            Document::from_mesh(bar().connectivity(), bar().positions()).expect("a document");
        cotan_io::save(&document, sandbox.path("bar.obj")).expect("a mesh file");
        sandbox
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, contents: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), contents).expect("a file in the sandbox");
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        let bytes = std::fs::read(self.path(name));
        bytes.unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// All regular files in the folder with their contents, to check that nothing changed.
    pub(crate) fn contents(&self) -> BTreeMap<OsString, Vec<u8>> {
        let entries = std::fs::read_dir(self.folder.path()).expect("the sandbox");
        let files = entries.map(|entry| entry.expect("an entry"));
        files
            .filter(|entry| entry.path().is_file())
            .map(|entry| {
                let bytes = std::fs::read(entry.path()).expect("a file");
                (entry.file_name(), bytes)
            })
            .collect()
    }

    pub(crate) fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).expect("JSON")
    }

    pub(crate) fn positions(&self, name: &str) -> Vec<Point3<f64>> {
        cotan_io::load(self.path(name))
            .expect("a mesh")
            .positions()
            .to_vec()
    }

    /// Like [`Self::positions`], for a file whose data may be in other files next to it.
    pub(crate) fn positions_beside(&self, name: &str) -> Vec<Point3<f64>> {
        let path = self.path(name);
        let folder = cotan_io::Folder::of(&path);
        let document = cotan_io::load_with(&path, &cotan_io::Limits::default(), &folder);
        document.expect("a mesh").positions().to_vec()
    }

    /// Runs `cotan` in the sandbox with the words of `line`.
    pub(crate) fn cotan(&self, line: &str) -> Outcome {
        self.run(line.split_whitespace())
    }

    /// Like [`Self::cotan`], for words with arbitrary characters.
    pub(crate) fn run(&self, words: impl IntoIterator<Item: AsRef<OsStr>>) -> Outcome {
        let output = Command::new(env!("CARGO_BIN_EXE_cotan"))
            .args(words)
            .current_dir(self.folder.path())
            .stdin(Stdio::null())
            .output()
            .expect("the command runs");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Outcome {
            code: output.status.code().expect("an exit code, not a signal"),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        }
    }

    /// Like [`Self::cotan`], for a run that must succeed.
    pub(crate) fn cotan_ok(&self, line: &str) -> Outcome {
        let outcome = self.cotan(line);
        assert_eq!(outcome.code, 0, "cotan {line}: {outcome:?}");
        outcome
    }

    /// Like [`Self::cotan`], for a run that must end with exit code 1 and an error containing
    /// `words`.
    pub(crate) fn refused(&self, line: &str, words: &[&str]) {
        let outcome = self.cotan(line);
        assert_eq!(outcome.code, 1, "cotan {line}: {outcome:?}");
        assert!(
            outcome.stderr.starts_with("error: "),
            "cotan {line}: {outcome:?}"
        );
        for word in words {
            assert!(
                outcome.stderr.contains(word),
                "no `{word}` in: {}",
                outcome.stderr
            );
        }
        assert!(outcome.stdout.is_empty(), "{outcome:?}");
    }
}

/// The mesh of `bar.obj`.
pub(crate) fn bar() -> Mesh<f64> {
    shapes::bar([6.0, 1.0, 1.0], [18, 3, 3])
}

/// The vertices at the left end, which the tests fix, and at the right end, which they move.
pub(crate) fn ends() -> [Vec<VertexId>; 2] {
    let (shape, end) = (bar(), 3.0 - 1e-9);
    [
        shape.surface().vertices_where(|p| p.x < -end),
        shape.surface().vertices_where(|p| p.x > end),
    ]
}

/// The image of the right end: rotated by 90° about the x axis and lifted by 2.
pub(crate) fn image(p: Point3<f64>) -> Point3<f64> {
    Point3::new(p.x, -p.z, p.y + 2.0)
}

pub(crate) const MATRIX: [[i32; 4]; 4] = [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 2], [0, 0, 0, 1]];

/// Handles in JSON: the left end fixed, the right end moved by [`MATRIX`].
pub(crate) fn json_handles() -> String {
    let [left, right] = ends().map(|end| numbers(&end));
    format!(
        r#"{{"handles": [{{"vertices": {left:?}, "fixed": true}},
            {{"vertices": {right:?}, "transform": {{"matrix": {MATRIX:?}}}}}]}}"#
    )
}

/// The same handles as text.
pub(crate) fn text_handles() -> String {
    let (shape, [left, right]) = (bar(), ends());
    let mut text = String::from("# the left end stays\n\n");
    let fixed = left.iter().map(|&v| (v, shape.positions()[v]));
    let moved = right.iter().map(|&v| (v, image(shape.positions()[v])));
    for (v, p) in fixed.chain(moved) {
        writeln!(text, "{} {} {} {}  # target", v.index(), p.x, p.y, p.z).expect("a line");
    }
    text
}

/// The same handles as statuses.
pub(crate) fn sel_handles() -> String {
    let [left, right] = ends();
    let status = |v: VertexId| match (left.contains(&v), right.contains(&v)) {
        (true, _) => "0\n",
        (_, true) => "2\n",
        _ => "1\n",
    };
    let statuses: String = bar().connectivity().vertices().map(status).collect();
    format!("# per vertex status\n{statuses}")
}

/// The matrix as text.
pub(crate) fn def_matrix() -> String {
    let row = |row: &[i32; 4]| row.map(|x| format!("{x}.0")).join(" ");
    let rows: Vec<String> = MATRIX.iter().map(row).collect();
    format!("# 4x4 matrix\n{}\n", rows.join("\n"))
}

pub(crate) fn numbers(vertices: &[VertexId]) -> Vec<usize> {
    vertices.iter().map(|v| v.index()).collect()
}
