//! The text of an OBJ file for another mesh made of its vertices and faces.
//!
//! Vertices and faces stay on their lines as long as they follow the order of the file. The rest
//! (copies of vertices, faces that close holes, reordered elements) is added after the last
//! vertex and the last face. Lines of removed elements are dropped, lines that need not change
//! keep every byte, and all others keep their whitespace and comments. Added faces have the
//! labels of their source faces; the labels that were current are restored after them.
//!
//! The file is not written anew from its attributes, because these lack lines, points, free-form
//! geometry, unknown statements, and the places of comments.

use crate::attributes::NONE;
use crate::error::IoError;
use crate::number;
use crate::obj::ObjFile;
use crate::obj::decode::{self, KINDS, RawLabels, no_name};
use crate::obj::patch::line_end;
use crate::obj::statement::{Statement, Statements, corner, is_continued, resolve, suffix};
use crate::obj::write::push_corner;
use crate::remap::Remap;
use crate::source::{Mesh, TextPatch};
use crate::text::{self, Token};

/// Builds the text whose vertices and faces are those of the remap, in its order.
pub(super) fn rebuild(file: &ObjFile, remap: &Remap, mesh: Mesh<'_>) -> Result<Vec<u8>, IoError> {
    let same_vertices = remap.vertices.len() == mesh.positions.len()
        && (0u32..).zip(&remap.vertices).all(|(new, &old)| new == old);
    if file.counts.has_free_form() && !same_vertices {
        return Err(IoError::Unsupported {
            feature: "adding or removing vertices below free-form curves and surfaces of an OBJ"
                .to_owned(),
            remedy: "remove them (curv, surf, …) or convert the file",
        });
    }
    let mut builder = Builder::new(file, remap, mesh)?;
    for statement in Statements::new(&file.bytes, text::after_bom(&file.bytes), 0) {
        match statement.keyword() {
            b"v" => builder.vertex(&statement),
            b"f" => builder.face(&statement)?,
            word @ (b"l" | b"p") => builder.line_element(&statement, word),
            _ => {}
        }
    }
    Ok(builder.patch.finish())
}

/// The number of elements that stay on their lines: the longest prefix in file order.
fn num_in_place(sources: &[u32]) -> usize {
    let mut after = 0u64;
    sources
        .iter()
        .take_while(|&&source| {
            let is_next = source != NONE && u64::from(source) >= after;
            after = u64::from(source) + 1;
            is_next
        })
        .count()
}

struct Builder<'a> {
    file: &'a ObjFile,
    remap: &'a Remap,
    mesh: Mesh<'a>,
    patch: TextPatch<'a>,
    line_end: &'static str,
    /// Number of vertices of the file above this statement.
    old_vertex: usize,
    /// Number of vertices of the new text above this statement.
    new_vertices: usize,
    /// The numbers of new vertices and faces that stay on their lines, in total and so far.
    vertices_in_place: usize,
    next_vertex: usize,
    faces_in_place: usize,
    next_face: usize,
    old_face: usize,
    /// The offsets of the vertex statements, if some are written again.
    starts: Vec<usize>,
    /// The texture coordinate and normal of every corner of the file, if corners change faces.
    references: [Option<Vec<u32>>; 2],
    /// For each old vertex, the new one that lines and points refer to; empty if there are none.
    numbers: Vec<u32>,
}

impl<'a> Builder<'a> {
    fn new(file: &'a ObjFile, remap: &'a Remap, mesh: Mesh<'a>) -> Result<Self, IoError> {
        let mut builder = Self {
            file,
            remap,
            mesh,
            patch: TextPatch::new(&file.bytes),
            line_end: line_end(&file.bytes),
            old_vertex: 0,
            new_vertices: 0,
            vertices_in_place: num_in_place(&remap.vertices),
            next_vertex: 0,
            faces_in_place: num_in_place(&remap.face_sources),
            next_face: 0,
            old_face: 0,
            starts: Vec::new(),
            references: [None, None],
            numbers: Vec::new(),
        };
        if builder.vertices_in_place < remap.vertices.len() {
            let start = text::after_bom(&file.bytes);
            let statements = Statements::new(&file.bytes, start, 0);
            let vertices = statements.filter(|s| s.keyword() == b"v");
            builder.starts = vertices.map(|s| s.start).collect();
        }
        if builder.mixes_corners() {
            builder.references = decode::corner_references(file, mesh)?;
        }
        if file.counts.has_lines() {
            builder.numbers = builder.new_numbers();
        }
        Ok(builder)
    }

    /// Returns `true` if a corner takes its texture coordinate and normal from a face that is not
    /// on its line.
    fn mixes_corners(&self) -> bool {
        self.faces_in_place < self.remap.faces.len()
            || (0..self.faces_in_place).any(|face| {
                let old = self.old_corners(self.remap.face_sources[face] as usize);
                let new = self.remap.faces.corner_range(face);
                let sources = &self.remap.corner_sources[new];
                sources.iter().any(|&c| !old.contains(&(c as usize)))
            })
    }

    fn old_corners(&self, face: usize) -> std::ops::Range<usize> {
        if face < self.mesh.faces.len() {
            self.mesh.faces.corner_range(face)
        } else {
            0..0
        }
    }

    fn new_numbers(&self) -> Vec<u32> {
        let mut numbers = vec![NONE; self.mesh.positions.len()];
        let mut set = |old: Option<&u32>, new: u32| {
            let number = old.and_then(|&old| numbers.get_mut(old as usize));
            if let Some(number) = number.filter(|number| **number == NONE) {
                *number = new;
            }
        };
        for (new, old) in (0u32..).zip(&self.remap.vertices) {
            set(Some(old), new);
        }
        // A vertex that was welded to another is found through its corners.
        let corners = self.remap.faces.corners().iter();
        for (&new, &source) in corners.zip(&self.remap.corner_sources) {
            set(self.mesh.faces.corners().get(source as usize), new);
        }
        numbers
    }

    fn vertex(&mut self, statement: &Statement<'_>) {
        let old = self.old_vertex;
        self.old_vertex += 1;
        let is_kept = self.next_vertex < self.vertices_in_place
            && self.remap.vertices[self.next_vertex] as usize == old;
        if is_kept {
            self.next_vertex += 1;
            self.new_vertices += 1;
        } else {
            self.drop(statement);
        }
        let added = &self.remap.vertices[self.vertices_in_place..];
        if self.old_vertex < self.mesh.positions.len() || added.is_empty() {
            return;
        }
        let mut block = self.block(statement, is_kept);
        for &old in added {
            let start = self.starts.get(old as usize).copied().unwrap_or_default();
            if let Some(source) = Statements::new(&self.file.bytes, start, 0).next() {
                copy_vertex(&mut block, &source);
            }
            block.extend_from_slice(self.line_end.as_bytes());
        }
        self.new_vertices += added.len();
        self.patch.insert(statement.end, &block);
    }

    fn face(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let old = self.old_face;
        self.old_face += 1;
        let face = self.next_face;
        let is_kept = face < self.faces_in_place && self.remap.face_sources[face] as usize == old;
        if is_kept {
            self.next_face += 1;
            self.rewrite_face(statement, face, old);
        } else {
            self.drop(statement);
        }
        if self.old_face == self.mesh.faces.len() && self.faces_in_place < self.remap.faces.len() {
            let block = self.added_faces(statement, is_kept)?;
            self.patch.insert(statement.end, &block);
        }
        Ok(())
    }

    /// Replaces the old corners of a face by the new ones.
    fn rewrite_face(&mut self, statement: &Statement<'_>, face: usize, old: usize) {
        let first = self.old_corners(old).start;
        let new = self.remap.faces.corner_range(face);
        let tokens: Vec<Token<'_>> = statement.arguments().collect();
        let corners = self.remap.faces.corners()[new.clone()].iter();
        let corners = corners.zip(&self.remap.corner_sources[new]);
        let corners: Vec<Vec<u8>> = corners
            .map(|(&vertex, &source)| {
                let own = (source as usize).checked_sub(first);
                match own.and_then(|k| tokens.get(k)) {
                    Some(token) => self.renumbered(token.text, vertex),
                    None => self.corner(vertex, source).trim_start().into(),
                }
            })
            .collect();
        self.replace_words(statement, &tokens, &corners);
    }

    /// Replaces the words after the keyword. Words that remain keep their position and the
    /// whitespace between them.
    fn replace_words(&mut self, statement: &Statement<'_>, old: &[Token<'_>], new: &[Vec<u8>]) {
        let mut end = statement.start;
        for (k, token) in old.iter().enumerate() {
            let start = statement.start + token.start;
            match new.get(k) {
                Some(word) if word == token.text => {}
                Some(word) => self.patch.replace_bytes(start, token.text.len(), word),
                // Including the whitespace before it.
                None => self
                    .patch
                    .replace_bytes(end, start + token.text.len() - end, b""),
            }
            end = start + token.text.len();
        }
        for word in new.iter().skip(old.len()) {
            self.patch.insert(end, b" ");
            self.patch.insert(end, word);
        }
    }

    /// A corner of the same statement with another vertex; unchanged if it already refers to that
    /// vertex.
    fn renumbered(&self, token: &[u8], vertex: u32) -> Vec<u8> {
        let index = corner(token).map(|corner| corner.vertex).or_else(|| {
            let suffix = suffix(token).len();
            number::parse_integer(&token[..token.len() - suffix])
        });
        let meant = match index {
            Some(index) if index < 0 => self.new_vertices as i64 + index,
            Some(index) => index - 1,
            None => -1,
        };
        if meant == i64::from(vertex) {
            return token.to_vec();
        }
        let mut text = String::new();
        number::push_integer(&mut text, u64::from(vertex) + 1);
        let mut word = text.into_bytes();
        word.extend_from_slice(suffix(token));
        word
    }

    /// A space and a corner with the references of an old corner.
    fn corner(&self, vertex: u32, source: u32) -> String {
        let [texture, normal] = self.references.each_ref().map(|entries| {
            let entry = entries.as_ref()?.get(source as usize).copied()?;
            (entry != NONE).then_some(entry)
        });
        let mut out = String::new();
        push_corner(&mut out, vertex, texture, normal);
        out
    }

    /// Adds the faces that are not on the line of their source face.
    fn added_faces(
        &mut self,
        statement: &Statement<'_>,
        is_kept: bool,
    ) -> Result<Vec<u8>, IoError> {
        let labels = decode::raw_labels(self.file)?;
        let label = |labels: &RawLabels<'_>, face: u32| {
            labels.faces.get(face as usize).copied().unwrap_or(NONE)
        };
        let last = (self.mesh.faces.len() as u32).wrapping_sub(1);
        let current = labels.each_ref().map(|l| label(l, last));
        let mut set = current;
        let most = (64usize << 20).saturating_add(self.file.bytes.len().saturating_mul(8));
        let mut block = self.block(statement, is_kept);
        let mut name = |block: &mut Vec<u8>, wanted: [u32; 4]| {
            for (k, (kind, keyword)) in KINDS.into_iter().enumerate() {
                if set[k] == wanted[k] {
                    continue;
                }
                set[k] = wanted[k];
                let none = no_name(kind).as_bytes();
                let name = labels[k].names.get(wanted[k] as usize);
                block.extend_from_slice(keyword.as_bytes());
                block.push(b' ');
                block.extend_from_slice(name.map_or(none, |name| name));
                if block.ends_with(b"\\") {
                    // The next line would continue this one.
                    block.push(b' ');
                }
                block.extend_from_slice(self.line_end.as_bytes());
            }
        };
        for face in self.faces_in_place..self.remap.faces.len() {
            let source = self.remap.face_sources[face];
            name(&mut block, labels.each_ref().map(|l| label(l, source)));
            // Alternating long names could grow the file without bound.
            if block.len() > most {
                return Err(IoError::OverLimit {
                    what: "bytes of faces with long names in a repaired OBJ",
                    limit: most as u64,
                });
            }
            block.push(b'f');
            let range = self.remap.faces.corner_range(face);
            for corner in range {
                let vertex = self.remap.faces.corners()[corner];
                let source = self.remap.corner_sources[corner];
                block.extend_from_slice(self.corner(vertex, source).as_bytes());
            }
            block.extend_from_slice(self.line_end.as_bytes());
        }
        if statement.end < self.file.bytes.len() {
            name(&mut block, current);
        }
        Ok(block)
    }

    /// Rewrites a line or point statement. A line element is dropped if any of its vertices was;
    /// a point statement loses only the dropped points.
    fn line_element(&mut self, statement: &Statement<'_>, keyword: &[u8]) {
        let tokens: Vec<Token<'_>> = statement.arguments().collect();
        let mut words = Vec::with_capacity(tokens.len());
        for token in &tokens {
            let total = self.mesh.positions.len();
            let vertex = corner(token.text)
                .and_then(|corner| resolve(corner.vertex, self.old_vertex, total))
                .and_then(|vertex| self.numbers.get(vertex as usize).copied());
            match vertex {
                // The statement is invalid and stays as it was.
                None => return,
                Some(NONE) if keyword == b"p" => {}
                Some(NONE) => return self.drop(statement),
                Some(vertex) => words.push(self.renumbered(token.text, vertex)),
            }
        }
        if words.is_empty() && !tokens.is_empty() {
            self.drop(statement);
        } else {
            self.replace_words(statement, &tokens, &words);
        }
    }

    fn drop(&mut self, statement: &Statement<'_>) {
        let length = statement.end - statement.start;
        self.patch.replace_bytes(statement.start, length, b"");
    }

    /// The text before new lines after a statement: the ending of its line, if it has none and is
    /// kept.
    fn block(&self, statement: &Statement<'_>, is_kept: bool) -> Vec<u8> {
        let is_ended = statement.start + statement.text.len() < statement.end;
        let mut block = Vec::new();
        if is_kept && !is_ended {
            block.extend_from_slice(self.line_end.as_bytes());
            if ends_open(statement.text) {
                // It continues on an empty line.
                block.extend_from_slice(self.line_end.as_bytes());
            }
        }
        block
    }
}

/// Writes the statement of a vertex again.
fn copy_vertex(block: &mut Vec<u8>, source: &Statement<'_>) {
    if source.text.len() <= LONGEST_COPY {
        // At the end of the file a backslash continues nothing; elsewhere it would.
        let closed = source.text.strip_suffix(b"\\");
        let closed = closed.filter(|_| ends_open(source.text));
        block.extend_from_slice(closed.unwrap_or(source.text));
        return;
    }
    let mut out = "v".to_owned();
    for x in source.arguments().map_while(|t| number::parse_f64(t.text)) {
        if out.len() > LONGEST_COPY {
            break;
        }
        out.push(' ');
        number::push_f64(&mut out, x);
    }
    block.extend_from_slice(out.as_bytes());
}

/// Longer lines are not copied unchanged: a file with a long comment at a vertex of very many
/// surfaces would grow without bound.
const LONGEST_COPY: usize = 1000;

/// Returns `true` if a statement cut off by the end of the file would otherwise continue.
pub(super) fn ends_open(text: &[u8]) -> bool {
    let start = memchr::memrchr2(b'\n', b'\r', text).map_or(0, |end| end + 1);
    is_continued(&text[start..])
}
