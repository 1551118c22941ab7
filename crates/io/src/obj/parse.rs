//! Parallel parsing of the positions and faces of an OBJ file.
//!
//! Pieces of the text are parsed concurrently with local vertex indices, and then joined in file
//! order.
//!
//! The division of the text does not depend on the number of threads, so neither does the result.
//! A piece stops at the first error. Since it does not know the number of lines and vertices
//! above it, it is then read again with these known, to produce the error message.

use cotan_parallel as parallel;
use nalgebra::Point3;

use crate::coordinate;
use crate::error::{Element, IoError, Place, quote};
use crate::faces::FaceList;
use crate::limits::Limits;
use crate::number;
use crate::obj::counts::Counts;
use crate::obj::fast;
use crate::obj::statement::{CORNER, Statement, Statements, is_continued};
use crate::room;
use crate::text::{self, Lines};

/// The mesh in a file.
#[derive(Debug, Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<Point3<f64>>,
    pub(super) faces: FaceList,
    pub(super) counts: Counts,
    lines: usize,
}

/// Size of a piece in bytes: large enough that starting one costs nothing, small enough that its
/// result stays in the cache until it is appended.
const PIECE: usize = 128 << 10;

/// Number of pieces parsed before they are joined.
const PIECES: usize = 8;

/// Fewer pieces are parsed by a single thread.
const WORTH_THREADS: usize = 4;

/// Parses a file.
pub(super) fn parse(bytes: &[u8], limits: &Limits) -> Result<Mesh, IoError> {
    parse_by(bytes, limits, PIECE)
}

/// [`parse`] with another piece size.
pub(super) fn parse_by(bytes: &[u8], limits: &Limits, piece: usize) -> Result<Mesh, IoError> {
    let mut file = Mesh::default();
    let mut largest = 0;
    let mut start = text::after_bom(bytes);
    if bytes.len() > piece {
        // The memory that the pieces hold in total; the lists of the file leave the same margin.
        room::check(room::MARGIN as u64)?;
    }
    let mut batch = Batch::default();
    let mut next = Batch::default();
    start = batch.cut(bytes, start, piece);
    batch.read(bytes, limits);
    while !batch.ranges.is_empty() {
        start = next.cut(bytes, start, piece);
        if next.ranges.is_empty() {
            largest = batch.append_to(&mut file, bytes, limits)?.max(largest);
        } else {
            // One thread appends the last pieces while the others parse the next ones.
            let (appended, ()) = parallel::join(
                || batch.append_to(&mut file, bytes, limits),
                || next.read(bytes, limits),
            );
            largest = appended?.max(largest);
        }
        std::mem::swap(&mut batch, &mut next);
    }
    let num_vertices = file.positions.len();
    if file.faces.num_corners() > 0 && largest as usize >= num_vertices {
        let start = text::after_bom(bytes);
        let (above, total) = (Above::default(), Some(num_vertices));
        return Err(refusal(bytes, start, bytes.len(), limits, above, total));
    }
    Ok(file)
}

/// Consecutive pieces, whose memory is reused for the next ones.
#[derive(Default)]
struct Batch {
    /// The start and end of each piece.
    ranges: Vec<(usize, usize)>,
    /// At least as many as there are ranges; the rest is left over from earlier batches.
    pieces: Vec<Piece>,
}

impl Batch {
    /// Cuts the next pieces from `start` on, each of which ends at a statement boundary. Returns
    /// the end of the last piece.
    fn cut(&mut self, bytes: &[u8], start: usize, piece: usize) -> usize {
        self.ranges.clear();
        let mut from = start;
        while from < bytes.len() && self.ranges.len() < PIECES {
            let to = statement_start(bytes, from, from.saturating_add(piece));
            self.ranges.push((from, to));
            from = to;
        }
        from
    }

    fn read(&mut self, bytes: &[u8], limits: &Limits) {
        if self.pieces.len() < self.ranges.len() {
            self.pieces.resize_with(self.ranges.len(), Piece::default);
        }
        let jobs = self.pieces.iter_mut().zip(&self.ranges);
        if self.ranges.len() < WORTH_THREADS {
            jobs.for_each(|(piece, &(from, to))| piece.read(bytes, from, to, limits));
        } else {
            parallel::tasks(jobs.collect(), |(piece, &(from, to))| {
                piece.read(bytes, from, to, limits);
            });
        }
    }

    /// Appends the pieces to the file, and returns the largest vertex that they refer to.
    fn append_to(
        &mut self,
        file: &mut Mesh,
        bytes: &[u8],
        limits: &Limits,
    ) -> Result<u32, IoError> {
        let mut largest = 0;
        if file.positions.is_empty() && file.faces.is_empty() {
            self.reserve(file, bytes.len(), limits);
        }
        for (piece, &(from, to)) in self.pieces.iter_mut().zip(&self.ranges) {
            let above = Above {
                lines: file.lines,
                vertices: file.positions.len(),
                faces: file.faces.len(),
                corners: file.faces.num_corners(),
            };
            piece.check(bytes, from, to, limits, above)?;
            largest = largest.max(piece.largest);
            file.append(piece)?;
            let corners = file.faces.num_corners();
            limits.check_memory(bytes.len(), file.positions.len(), corners)?;
        }
        Ok(largest)
    }

    /// Reserves memory for the whole file, extrapolating from its start.
    ///
    /// This is only an estimate: the vectors grow if more follows, the estimate is bounded by the
    /// size of the file, and nothing beyond the limits or the available memory is reserved.
    fn reserve(&self, file: &mut Mesh, all: usize, limits: &Limits) {
        let pieces = &self.pieces[..self.ranges.len()];
        let vertices = pieces.iter().map(|p| p.positions.len()).sum::<usize>();
        let corners = pieces.iter().map(|p| p.corners.len()).sum::<usize>();
        let faces = pieces.iter().map(|p| p.ends.len()).sum::<usize>();
        let (Some(first), Some(last)) = (self.ranges.first(), self.ranges.last()) else {
            return;
        };
        if last.1 == all {
            room::reserve_if_there(&mut file.positions, vertices);
            file.faces.reserve_if_there(faces, corners);
        } else if vertices > 0 && corners > 0 {
            // Vertices and faces are interleaved, so everything grows at the same rate.
            let times = 1.02 * all as f64 / (last.1 - first.0).max(1) as f64;
            let guess = |count: usize| (count as f64 * times) as usize;
            let [vertices, faces, corners] = [vertices, faces, corners].map(guess);
            if limits.check_memory(all, vertices, corners).is_ok() {
                room::reserve_if_there(&mut file.positions, vertices);
                file.faces.reserve_if_there(faces, corners);
            }
        }
    }
}

/// The start of the first statement after `at`, given that one starts at `from`.
fn statement_start(bytes: &[u8], from: usize, at: usize) -> usize {
    if at >= bytes.len() {
        return bytes.len();
    }
    // Search backward for the start of the line that contains `at`. Exclude the last byte, since
    // `at` may lie within a two-byte line ending.
    let above = &bytes[from..at.saturating_sub(1).max(from)];
    let line = memchr::memrchr2(b'\n', b'\r', above).map_or(from, |end| from + end + 1);
    let mut lines = Lines::new(bytes, line);
    while let Some(line) = lines.next() {
        if !is_continued(line.text) && lines.position() > at {
            return lines.position();
        }
    }
    bytes.len()
}

/// The element counts above a piece.
#[derive(Clone, Copy, Default)]
pub(super) struct Above {
    lines: usize,
    vertices: usize,
    faces: usize,
    corners: usize,
}

/// The contents of a piece of the text; vertices and faces are numbered from its start.
#[derive(Debug, Default)]
pub(super) struct Piece {
    pub(super) positions: Vec<Point3<f64>>,
    /// The vertices of the corners. In the `relative` ranges they are numbered from the first
    /// vertex of the piece, and wrap around for vertices above it.
    pub(super) corners: Vec<u32>,
    pub(super) ends: Vec<u32>,
    /// Ranges of corners with relative indices.
    relative: Vec<(usize, usize)>,
    /// The lowest relative vertex, counted from the start of the piece; at most zero.
    lowest: i64,
    /// The largest absolute vertex index, or 0.
    largest: u32,
    lines: usize,
    pub(super) counts: Counts,
    failed: bool,
}

/// The state of a piece within a face.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    corners: usize,
    relative: usize,
    lowest: i64,
    largest: u32,
}

impl Piece {
    fn clear(&mut self) {
        self.positions.clear();
        self.corners.clear();
        self.ends.clear();
        self.relative.clear();
        self.lowest = 0;
        self.largest = 0;
        self.lines = 0;
        self.counts = Counts::default();
        self.failed = false;
    }

    /// Parses the text from `from` to `to`, up to the first error.
    fn read(&mut self, bytes: &[u8], from: usize, to: usize, limits: &Limits) {
        self.clear();
        let text = &bytes[..to];
        let mut at = from;
        while at < to {
            if let Some(next) = fast::line(self, text, at, limits) {
                self.lines += 1;
                at = next;
                continue;
            }
            let mut statements = Statements::new(text, at, self.lines);
            let Some(statement) = statements.next() else {
                break;
            };
            let mut reader = Reader {
                limits,
                above: Above::default(),
                total: None,
                piece: self,
                is_alone: false,
            };
            if reader.statement(&statement).is_err() {
                self.failed = true;
                return;
            }
            self.lines = statements.num_lines();
            at = statement.end;
        }
    }

    /// Returns the error of this piece, if any, now that the counts above it are known.
    fn check(
        &self,
        bytes: &[u8],
        from: usize,
        to: usize,
        limits: &Limits,
        above: Above,
    ) -> Result<(), IoError> {
        if self.failed || above.vertices as i64 + self.lowest < 0 {
            return Err(refusal(bytes, from, to, limits, above, None));
        }
        limits.check_vertices(above.vertices + self.positions.len())?;
        limits.check_faces(above.faces + self.ends.len())?;
        limits.check_corners(above.corners + self.corners.len())?;
        // Faces refer to vertices with 32 bits.
        if above.vertices + self.positions.len() > u32::MAX as usize {
            return Err(IoError::OverLimit {
                what: "vertices",
                limit: u64::from(u32::MAX),
            });
        }
        Ok(())
    }

    /// Adds a corner with an absolute index.
    #[inline]
    pub(super) fn push_absolute(&mut self, vertex: u32) {
        self.largest = self.largest.max(vertex);
        self.corners.push(vertex);
    }

    /// Adds a corner with a relative index; `vertex` is counted from the first vertex of the
    /// piece.
    #[inline]
    pub(super) fn push_relative(&mut self, vertex: i64) {
        let corner = self.corners.len();
        match self.relative.last_mut() {
            Some((_, end)) if *end == corner => *end += 1,
            _ => self.relative.push((corner, corner + 1)),
        }
        self.lowest = self.lowest.min(vertex);
        self.corners.push(vertex as u32);
    }

    /// Saves the current state, for [`Piece::reset`].
    #[inline]
    pub(super) fn mark(&self) -> Mark {
        Mark {
            corners: self.corners.len(),
            relative: self.relative.len(),
            lowest: self.lowest,
            largest: self.largest,
        }
    }

    /// Discards the corners added since a mark.
    pub(super) fn reset(&mut self, mark: Mark) {
        self.corners.truncate(mark.corners);
        self.relative.truncate(mark.relative);
        if let Some((_, end)) = self.relative.last_mut() {
            *end = mark.corners.min(*end);
        }
        self.lowest = mark.lowest;
        self.largest = mark.largest;
    }

    /// Completes a face and returns its degree.
    #[inline]
    pub(super) fn end_face(&mut self) -> usize {
        let degree = self.corners.len() - self.face_start();
        self.ends.push(self.corners.len() as u32);
        degree
    }

    /// The start of the corners of the current face.
    #[inline]
    pub(super) fn face_start(&self) -> usize {
        self.ends.last().map_or(0, |&end| end as usize)
    }
}

impl Mesh {
    fn append(&mut self, piece: &mut Piece) -> Result<(), IoError> {
        self.faces
            .make_room(piece.ends.len(), piece.corners.len())?;
        room::reserve(&mut self.positions, piece.positions.len())?;
        let base = self.positions.len() as u32;
        for &(start, end) in &piece.relative {
            for vertex in &mut piece.corners[start..end] {
                *vertex = vertex.wrapping_add(base);
            }
        }
        self.positions.extend_from_slice(&piece.positions);
        self.faces.append(&piece.corners, &piece.ends);
        self.counts.append(&piece.counts, self.lines);
        self.lines += piece.lines;
        Ok(())
    }
}

/// Finds the first error of a part of the text that is known to have one. With `total`, the
/// number of vertices in the file, references past the last vertex are errors too.
#[cold]
fn refusal(
    bytes: &[u8],
    from: usize,
    to: usize,
    limits: &Limits,
    above: Above,
    total: Option<usize>,
) -> IoError {
    let mut reader = Reader {
        limits,
        above,
        total,
        piece: &mut Piece::default(),
        is_alone: true,
    };
    for statement in Statements::new(&bytes[..to], from, above.lines) {
        if let Err(error) = reader.statement(&statement) {
            return error;
        }
        // Only the counts matter here.
        reader.above.vertices += reader.piece.positions.len();
        reader.above.faces += reader.piece.ends.len();
        reader.above.corners += reader.piece.corners.len();
        reader.piece.clear();
    }
    IoError::Malformed {
        place: Place::Byte(from),
        problem: "this part of the file cannot be read".to_owned(),
    }
}

/// Reads statements of any form into a piece.
struct Reader<'a> {
    limits: &'a Limits,
    above: Above,
    /// The number of vertices in the file, if known.
    total: Option<usize>,
    piece: &'a mut Piece,
    /// `true` if the counts above are known.
    is_alone: bool,
}

impl Reader<'_> {
    fn statement(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        self.limits.check_line(statement.text.len())?;
        match statement.keyword() {
            b"v" => self.vertex(statement),
            b"f" => self.face(statement),
            keyword => {
                self.piece.counts.add(keyword, statement.line);
                Ok(())
            }
        }
    }

    fn num_vertices(&self) -> usize {
        self.above.vertices + self.piece.positions.len()
    }

    fn vertex(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let place = Place::Line(statement.line);
        let vertex = self.num_vertices();
        let (position, _) = coordinate::position(&mut statement.arguments(), vertex, place)?;
        self.piece.positions.push(position);
        self.limits.check_vertices(self.num_vertices())
    }

    fn face(&mut self, statement: &Statement<'_>) -> Result<(), IoError> {
        let face = self.above.faces + self.piece.ends.len();
        let place = Place::Line(statement.line);
        let start = self.piece.face_start();
        for token in statement.arguments() {
            let index = vertex_index(token.text).ok_or_else(|| IoError::BadNumber {
                place,
                element: Element::new("face", face),
                text: quote(token.text),
                expected: CORNER,
            })?;
            if !self.push_corner(index) {
                return Err(IoError::IndexOutOfRange {
                    place,
                    face,
                    index,
                    first: 1,
                    num_vertices: self.total.unwrap_or(self.num_vertices()),
                });
            }
            self.limits.check_degree(self.piece.corners.len() - start)?;
        }
        let degree = self.piece.end_face();
        if degree < 3 {
            return Err(IoError::TooFewCorners {
                place,
                face,
                degree,
            });
        }
        let corners = self.above.corners + self.piece.corners.len();
        self.limits.check_corners(corners)?;
        self.limits.check_faces(face + 1)
    }

    /// Adds a corner. Returns `false` if the index cannot refer to a vertex.
    fn push_corner(&mut self, index: i64) -> bool {
        if index < 0 {
            let vertex = self.piece.positions.len() as i64 + index;
            if self.is_alone && vertex + (self.above.vertices as i64) < 0 {
                return false;
            }
            self.piece.push_relative(vertex);
            return true;
        }
        match u32::try_from(index - 1) {
            Ok(vertex) if self.total.is_none_or(|total| (vertex as usize) < total) => {
                self.piece.push_absolute(vertex);
                true
            }
            _ => false,
        }
    }
}

/// Parses the vertex index of `v`, `v/vt`, `v//vn` or `v/vt/vn`. The rest is only validated when
/// it is needed.
fn vertex_index(token: &[u8]) -> Option<i64> {
    let slash = memchr::memchr(b'/', token).unwrap_or(token.len());
    let (vertex, rest) = token.split_at(slash);
    let is_well_formed = rest
        .iter()
        .all(|b| matches!(b, b'/' | b'-' | b'+' | b'0'..=b'9'));
    number::parse_integer(vertex).filter(|_| is_well_formed)
}

/// Parses a file statement by statement, without the fast path.
#[cfg(test)]
pub(super) fn parse_plainly(bytes: &[u8], limits: &Limits) -> Result<Mesh, IoError> {
    let mut file = Mesh::default();
    let mut piece = Piece::default();
    let start = text::after_bom(bytes);
    for statement in Statements::new(bytes, start, 0) {
        let mut reader = Reader {
            limits,
            above: Above::default(),
            total: None,
            piece: &mut piece,
            is_alone: true,
        };
        reader.statement(&statement)?;
    }
    file.append(&mut piece)?;
    let num_vertices = file.positions.len();
    if piece.largest as usize >= num_vertices && file.faces.num_corners() > 0 {
        let (above, total) = (Above::default(), Some(num_vertices));
        return Err(refusal(bytes, start, bytes.len(), limits, above, total));
    }
    Ok(file)
}
