//! The bytes that a document was read from, and where its coordinates stand in them.

use nalgebra::Point3;

use crate::error::IoError;
use crate::format::Format;
use crate::number;
use crate::ply::VertexRows;
use crate::text;

/// A file as it was read.
#[derive(Clone, Debug)]
pub(crate) struct Source {
    bytes: Vec<u8>,
    /// Where each vertex starts: its x in OBJ and OFF, its row in PLY. Ascending.
    starts: Vec<usize>,
    rows: Rows,
    contents: Contents,
}

/// How a vertex is laid out from its start on.
#[derive(Clone, Debug)]
pub(crate) enum Rows {
    /// x, y and z are the first three tokens.
    Obj,
    /// x, y and z are the first three tokens.
    Off,
    /// As the header says.
    Ply(VertexRows),
}

/// What a file has besides positions and faces, in words for a warning.
#[derive(Clone, Default, Debug)]
pub(crate) struct Contents {
    /// What another format would drop.
    pub(crate) extras: Vec<String>,
    /// What no longer fits once vertices move.
    pub(crate) stale: Vec<String>,
}

impl Contents {
    pub(crate) fn count_comments(&mut self, count: usize) {
        if count > 0 {
            self.extras.push(format!("{count} comments"));
        }
    }
}

impl Source {
    pub(crate) fn new(bytes: Vec<u8>, starts: Vec<usize>, rows: Rows, contents: Contents) -> Self {
        Self {
            bytes,
            starts,
            rows,
            contents,
        }
    }

    pub(crate) fn format(&self) -> Format {
        match self.rows {
            Rows::Obj => Format::Obj,
            Rows::Off => Format::Off,
            Rows::Ply(_) => Format::Ply,
        }
    }

    pub(crate) fn extras(&self) -> &[String] {
        &self.contents.extras
    }

    pub(crate) fn stale(&self) -> &[String] {
        &self.contents.stale
    }

    /// The file with the coordinates of some vertices replaced, given in ascending order.
    pub(crate) fn rewrite(
        &self,
        moved: impl Iterator<Item = (usize, Point3<f64>)>,
    ) -> Result<Vec<u8>, IoError> {
        let bytes = &self.bytes;
        match &self.rows {
            Rows::Obj | Rows::Off => {
                let mut patch = TextPatch::new(bytes);
                for (vertex, position) in moved {
                    let start = self.starts[vertex];
                    let tokens = text::Tokens::new(&bytes[start..]);
                    for (token, &x) in tokens.zip(position.iter()) {
                        patch.replace(start + token.start, token.text.len(), |out| {
                            number::push_f64(out, x);
                        });
                    }
                }
                Ok(patch.finish())
            }
            Rows::Ply(rows) => rows.rewrite(
                bytes,
                moved.map(|(vertex, position)| (vertex, self.starts[vertex], position)),
            ),
        }
    }
}

/// A text that is copied with some words replaced, from front to back.
pub(crate) struct TextPatch<'a> {
    bytes: &'a [u8],
    copied: usize,
    out: Vec<u8>,
    number: String,
}

impl<'a> TextPatch<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        // New numbers are often longer than old ones: room for an eighth more.
        let out = Vec::with_capacity(bytes.len() + bytes.len() / 8);
        Self {
            bytes,
            copied: 0,
            out,
            number: String::new(),
        }
    }

    /// Replaces `length` bytes at `start`, which lies behind everything replaced so far.
    pub(crate) fn replace(&mut self, start: usize, length: usize, write: impl FnOnce(&mut String)) {
        self.number.clear();
        write(&mut self.number);
        self.out.extend_from_slice(&self.bytes[self.copied..start]);
        self.out.extend_from_slice(self.number.as_bytes());
        self.copied = start + length;
    }

    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.out.extend_from_slice(&self.bytes[self.copied..]);
        self.out
    }
}
