//! Statement counts of an OBJ file, apart from vertices and faces.

use crate::error::{Place, Warning, quote};

/// Counts of statements that are preserved but not read with the mesh.
#[derive(Clone, Debug, Default)]
pub(super) struct Counts {
    textures: usize,
    normals: usize,
    libraries: usize,
    /// In the order of [`EXTRAS`].
    extras: [usize; EXTRAS.len()],
    /// The line and keyword of the first statement that is not valid OBJ.
    unknown: Option<(usize, String)>,
    num_unknown: usize,
}

/// Statements that [`Attributes`](crate::Attributes) cannot represent, with their descriptions.
const EXTRAS: [(&[&str], &str); 3] = [
    (&["l", "p"], "lines and points (l, p)"),
    (FREE_FORM, "statements of free-form geometry"),
    (
        &[
            "bevel",
            "c_interp",
            "call",
            "csh",
            "ctech",
            "d_interp",
            "lod",
            "maplib",
            "mg",
            "shadow_obj",
            "stech",
            "trace_obj",
            "usemap",
        ],
        "display settings (lod, mg, …)",
    ),
];

/// Curves and surfaces, which also refer to vertices.
const FREE_FORM: &[&str] = &[
    "bmat", "bsp", "bzp", "cdc", "cdp", "con", "cstype", "curv", "curv2", "deg", "end", "hole",
    "parm", "res", "scrv", "sp", "step", "surf", "trim", "vp",
];

impl Counts {
    /// Counts a statement that is neither a vertex nor a face.
    pub(super) fn add(&mut self, keyword: &[u8], line: usize) {
        match keyword {
            b"vt" => self.textures += 1,
            b"vn" => self.normals += 1,
            b"mtllib" => self.libraries += 1,
            b"" | b"g" | b"o" | b"s" | b"usemtl" => {}
            word => {
                let kind = EXTRAS
                    .iter()
                    .position(|(words, _)| words.iter().any(|w| w.as_bytes() == word));
                if let Some(kind) = kind {
                    self.extras[kind] += 1;
                } else {
                    self.num_unknown += 1;
                    self.unknown.get_or_insert_with(|| (line, quote(word)));
                }
            }
        }
    }

    #[inline]
    pub(super) fn add_texture(&mut self) {
        self.textures += 1;
    }

    #[inline]
    pub(super) fn add_normal(&mut self) {
        self.normals += 1;
    }

    /// Adds the counts of a piece of the file that follows `num_lines` lines.
    pub(super) fn append(&mut self, piece: &Self, num_lines: usize) {
        self.textures += piece.textures;
        self.normals += piece.normals;
        self.libraries += piece.libraries;
        for (sum, count) in self.extras.iter_mut().zip(piece.extras) {
            *sum += count;
        }
        self.num_unknown += piece.num_unknown;
        if self.unknown.is_none() {
            let unknown = piece.unknown.clone();
            self.unknown = unknown.map(|(line, word)| (line + num_lines, word));
        }
    }

    /// Number of `vt` statements.
    pub(super) fn textures(&self) -> usize {
        self.textures
    }

    /// Number of `vn` statements.
    pub(super) fn normals(&self) -> usize {
        self.normals
    }

    /// Number of `mtllib` statements.
    pub(super) fn libraries(&self) -> usize {
        self.libraries
    }

    /// Returns `true` if there are lines or points.
    pub(super) fn has_lines(&self) -> bool {
        self.extras[0] > 0
    }

    /// Returns `true` if there are curves or surfaces.
    pub(super) fn has_free_form(&self) -> bool {
        self.extras[1] > 0
    }

    /// Lists the contents that attributes cannot represent.
    pub(super) fn extras(&self) -> Vec<String> {
        let known = self.extras.iter().zip(&EXTRAS);
        let known = known.map(|(&count, (_, name))| (count, *name));
        known
            .chain([(self.num_unknown, "statements that OBJ does not define")])
            .filter(|&(count, _)| count > 0)
            .map(|(count, name)| format!("{count} {name}"))
            .collect()
    }

    /// The warning about unknown statements, if any.
    pub(super) fn warnings(&self) -> Vec<Warning> {
        let warning = self.unknown.as_ref().map(|(line, word)| Warning {
            place: Some(Place::Line(*line)),
            message: match self.num_unknown {
                1 => format!("`{word}` is not an OBJ statement; the line is kept unchanged"),
                n => format!(
                    "`{word}` is not an OBJ statement; this line and {} like it are kept unchanged",
                    n - 1
                ),
            },
        });
        warning.into_iter().collect()
    }
}
