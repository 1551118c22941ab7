//! Landmark files: vertices of a mesh file, or pairs of vertices of two files.
//!
//! A text file has one landmark per line, with `#` comments; JSON is a list of indices or of
//! pairs. Vertices are counted from 0.

use std::path::{Path, PathBuf};

use cotan::halfedge::VertexId;
use cotan_io::read_regular;
use cotan_tool::handles_file::FileVertices;
use serde::Deserialize;
use thiserror::Error;

use crate::error::CliError;
use crate::memory;
use crate::prepare::Prepared;

/// The reason why a landmarks file was refused.
#[derive(Debug, Error)]
enum LandmarksError {
    #[error("cannot read the file: {0}")]
    Read(#[source] std::io::Error),
    #[error("this is not a text file; landmarks are JSON or lines of vertex indices")]
    NotText,
    #[error("the JSON is not a list of vertex indices or of pairs of them: {0}")]
    Json(#[source] serde_json::Error),
    #[error("line {line}: `{word}` is not a vertex index (indices start at 0)")]
    Number { line: usize, word: String },
    #[error("expected three vertices, one per line; the file has {found}")]
    NotThree { found: usize },
    #[error(
        "landmark {number} (counted from 1) must name a vertex of A and one of B, but has {found}"
    )]
    NotAPair { number: usize, found: usize },
    #[error("expected at least two pairs of vertices; the file has {found}")]
    TooFew { found: usize },
    #[error("there is no vertex {vertex} in {}: it has {num_vertices}, numbered from 0", mesh.display())]
    OutOfRange {
        mesh: PathBuf,
        vertex: usize,
        num_vertices: usize,
    },
    #[error("vertex {vertex} belongs to no face of {}; choose one that a face uses", mesh.display())]
    Unreferenced { mesh: PathBuf, vertex: usize },
}

/// Reads the three landmarks of a mesh.
///
/// # Errors
/// [`CliError::File`] with the problem in the file at `path`.
pub(crate) fn three(path: &Path, mesh: &Prepared) -> Result<[VertexId; 3], CliError> {
    let here = in_file(path);
    let vertices = read(path)?.concat();
    let &[a, b, c] = vertices.as_slice() else {
        let found = vertices.len();
        return Err(here(LandmarksError::NotThree { found }));
    };
    let find = |vertex| find(mesh, vertex).map_err(&here);
    Ok([find(a)?, find(b)?, find(c)?])
}

/// Reads pairs of a vertex of each of two meshes.
///
/// # Errors
/// The same as [`three`].
pub(crate) fn pairs(path: &Path, [a, b]: &[Prepared; 2]) -> Result<Vec<[VertexId; 2]>, CliError> {
    let here = in_file(path);
    let rows = read(path)?;
    if rows.len() < 2 {
        return Err(here(LandmarksError::TooFew { found: rows.len() }));
    }
    let pair = |(index, row): (usize, &Vec<usize>)| {
        let &[of_a, of_b] = row.as_slice() else {
            return Err(LandmarksError::NotAPair {
                number: index + 1,
                found: row.len(),
            });
        };
        Ok([find(a, of_a)?, find(b, of_b)?])
    };
    let pairs: Result<_, _> = rows.iter().enumerate().map(pair).collect();
    pairs.map_err(here)
}

/// The vertex of the surface for a vertex of the file.
fn find(mesh: &Prepared, vertex: usize) -> Result<VertexId, LandmarksError> {
    let path = || mesh.path().to_owned();
    let file = mesh.file_vertices.as_ref();
    let num_vertices = file.map_or(mesh.document.positions().len(), FileVertices::num_vertices);
    if vertex >= num_vertices {
        return Err(LandmarksError::OutOfRange {
            mesh: path(),
            vertex,
            num_vertices,
        });
    }
    let found = match file {
        None => mesh.processing.vertex(vertex),
        Some(file) => file
            .in_document(vertex)
            .find_map(|v| mesh.processing.vertex(v)),
    };
    found.ok_or_else(|| LandmarksError::Unreferenced {
        mesh: path(),
        vertex,
    })
}

/// One landmark of a JSON file.
#[derive(Deserialize)]
#[serde(untagged)]
enum Entry {
    Vertex(usize),
    Vertices(Vec<usize>),
}

/// The vertex indices of each landmark.
fn read(path: &Path) -> Result<Vec<Vec<usize>>, CliError> {
    let here = in_file(path);
    let bytes = read_regular(path, memory::limits().max_bytes)
        .map_err(|e| here(LandmarksError::Read(e)))?;
    let text = String::from_utf8(bytes).map_err(|_| here(LandmarksError::NotText))?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
    match text.trim_start().starts_with(['[', '{']) {
        true => read_json(text),
        false => read_lines(text),
    }
    .map_err(here)
}

fn read_json(text: &str) -> Result<Vec<Vec<usize>>, LandmarksError> {
    let entries: Vec<Entry> = serde_json::from_str(text).map_err(LandmarksError::Json)?;
    let row = |entry| match entry {
        Entry::Vertex(vertex) => vec![vertex],
        Entry::Vertices(vertices) => vertices,
    };
    Ok(entries.into_iter().map(row).collect())
}

fn read_lines(text: &str) -> Result<Vec<Vec<usize>>, LandmarksError> {
    let mut rows = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words = line.split('#').next().unwrap_or_default();
        let number = |word: &str| {
            word.parse::<usize>().map_err(|_| LandmarksError::Number {
                line: index + 1,
                word: word.to_owned(),
            })
        };
        let row: Vec<usize> = words
            .split_whitespace()
            .map(number)
            .collect::<Result<_, _>>()?;
        if !row.is_empty() {
            rows.push(row);
        }
    }
    Ok(rows)
}

fn in_file(path: &Path) -> impl Fn(LandmarksError) -> CliError {
    move |source| CliError::File {
        path: path.to_owned(),
        source: Box::new(source),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_and_json_say_the_same() {
        let expected = vec![vec![7], vec![0], vec![12]];
        assert_eq!(read_lines("7 # head\n\n0\n12\n").unwrap(), expected);
        assert_eq!(read_json("[7, 0, 12]").unwrap(), expected);
        let pairs = vec![vec![1, 2], vec![3, 4]];
        assert_eq!(read_lines("1 2\n3 4").unwrap(), pairs);
        assert_eq!(read_json("[[1, 2], [3, 4]]").unwrap(), pairs);
    }

    #[test]
    fn a_word_that_is_not_a_number_is_quoted() {
        let error = read_lines("1\n# c\nx\n").unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains("`x`"), "{error}");
        assert!(read_lines("-1").is_err() && read_json("[0.5]").is_err());
        assert!(read_json("{\"a\": 1}").is_err());
    }
}
