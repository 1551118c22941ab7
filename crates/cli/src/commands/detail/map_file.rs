//! Files that state corresponding points: per vertex of the target a triangle of the source and
//! three weights.
//!
//! A text file has one line per vertex, `triangle a b c`, or `-` for a vertex without counterpart,
//! with `#` comments. The weights belong to the corners in the order of the file of the source.

use std::path::Path;

use cotan::detail::{Correspondence, CorrespondingPoint, DetailError};
use cotan::halfedge::{VertexId, VertexMap};
use cotan_io::read_regular;
use thiserror::Error;

use crate::error::CliError;
use crate::memory;
use crate::prepare::Prepared;

/// The reason why a map file was refused.
#[derive(Debug, Error)]
enum MapFileError {
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    #[error("this is not a text file; a map has lines of a triangle and three weights")]
    NotText,
    #[error("line {line}: expected a triangle and three weights, or `-`, but found `{text}`")]
    Line { line: usize, text: String },
    #[error("the map has {found} lines, but {} has {expected} vertices: one line each", target.display())]
    Length {
        target: std::path::PathBuf,
        found: usize,
        expected: usize,
    },
    #[error("line {line}: {} has no triangle {face}; it has {num_faces} faces, numbered from 0, of which only triangles can be named", source_mesh.display())]
    NoTriangle {
        source_mesh: std::path::PathBuf,
        line: usize,
        face: usize,
        num_faces: usize,
    },
    #[error("line {line}: the weights must be at least 0 with the sum 1")]
    Weights { line: usize },
    #[error(transparent)]
    Map(#[from] DetailError),
}

/// A line of the file: its number, the triangle and the weights.
struct Row {
    line: usize,
    point: Option<(usize, [f64; 3])>,
}

/// Reads a map.
///
/// # Errors
/// [`CliError::File`] with the problem in the file at `path`.
pub(super) fn read(
    path: &Path,
    target: &Prepared,
    source: &Prepared,
) -> Result<Correspondence, CliError> {
    let map = parse(path).and_then(|rows| correspondence(&rows, target, source));
    map.map_err(|error| CliError::File {
        path: path.to_owned(),
        source: Box::new(error),
    })
}

fn parse(path: &Path) -> Result<Vec<Row>, MapFileError> {
    let bytes = read_regular(path, memory::limits().max_bytes).map_err(MapFileError::Read)?;
    let text = String::from_utf8(bytes).map_err(|_| MapFileError::NotText)?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    rows(text)
}

fn rows(text: &str) -> Result<Vec<Row>, MapFileError> {
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words: Vec<&str> = line
            .split('#')
            .next()
            .unwrap_or_default()
            .split_whitespace()
            .collect();
        let point = match words.as_slice() {
            [] => continue,
            ["-"] => None,
            words => match point(words) {
                Some(point) => Some(point),
                None => {
                    return Err(MapFileError::Line {
                        line: index + 1,
                        text: line.trim().to_owned(),
                    });
                }
            },
        };
        rows.push(Row {
            line: index + 1,
            point,
        });
    }
    Ok(rows)
}

fn point(words: &[&str]) -> Option<(usize, [f64; 3])> {
    let &[face, a, b, c] = words else { return None };
    let weight = |word: &str| word.parse::<f64>().ok().filter(|w| w.is_finite());
    Some((face.parse().ok()?, [weight(a)?, weight(b)?, weight(c)?]))
}

fn correspondence(
    rows: &[Row],
    target: &Prepared,
    source: &Prepared,
) -> Result<Correspondence, MapFileError> {
    let file = target.file_vertices.as_ref();
    let document = target.document.positions().len();
    let expected = file.map_or(document, |file| file.num_vertices());
    if rows.len() != expected {
        return Err(MapFileError::Length {
            target: target.path().to_owned(),
            found: rows.len(),
            expected,
        });
    }
    let processing = &target.processing;
    let points: Result<VertexMap<_>, MapFileError> = processing
        .mesh()
        .vertices()
        .map(|v| {
            let vertex = processing.document_vertex(v);
            let row = rows.get(file.map_or(vertex, |file| file.vertex(vertex)));
            row.map_or(Ok(None), |row| corresponding_point(row, source))
        })
        .collect();
    let num_source_vertices = source.processing.mesh().num_vertices();
    Ok(Correspondence::new(num_source_vertices, points?)?)
}

fn corresponding_point(
    row: &Row,
    source: &Prepared,
) -> Result<Option<CorrespondingPoint>, MapFileError> {
    let Some((face, weights)) = row.point else {
        return Ok(None);
    };
    let faces = source.document.faces();
    let corners = (face < faces.len())
        .then(|| corners(source, face))
        .flatten();
    let corners = corners.ok_or_else(|| MapFileError::NoTriangle {
        source_mesh: source.path().to_owned(),
        line: row.line,
        face,
        num_faces: faces.len(),
    })?;
    let sum: f64 = weights.iter().sum();
    if weights.iter().any(|w| *w < 0.0) || (sum - 1.0).abs() > 1e-6 {
        return Err(MapFileError::Weights { line: row.line });
    }
    Ok(Some(CorrespondingPoint { corners, weights }))
}

/// The vertices of the surface at the corners of a triangle of the file.
fn corners(source: &Prepared, face: usize) -> Option<[VertexId; 3]> {
    let corners = source.document.faces().iter().nth(face)?;
    let vertices: Option<Vec<VertexId>> = corners
        .iter()
        .map(|&v| source.processing.vertex(v as usize))
        .collect();
    vertices?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_points_or_none() {
        let rows = rows("# map\n3 0.5 0.25 0.25\n\n-  # no counterpart\n0 1 0 0\n").unwrap();
        let found: Vec<_> = rows.iter().map(|row| (row.line, row.point)).collect();
        let expected = [
            (2, Some((3, [0.5, 0.25, 0.25]))),
            (4, None),
            (5, Some((0, [1.0, 0.0, 0.0]))),
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn other_lines_are_refused_by_number() {
        for line in ["1 2 3", "x 1 0 0", "1 nan 0 0", "-1 1 0 0", "1 1 0 0 0"] {
            let error = rows(&format!("0 1 0 0\n{line}")).err().unwrap();
            assert!(error.to_string().starts_with("line 2"), "{line}: {error}");
        }
    }
}
