//! Handles as text: one `vertex x y z` per line, with `#` comments.

use nalgebra::Point3;

use super::constraint::{Constraint, Goal};
use super::error::{HandlePlace, HandlesError};
use super::vertices::Vertices;

pub(super) fn read(contents: &str, mesh: &Vertices<'_>) -> Result<Vec<Constraint>, HandlesError> {
    let mut constraints = Vec::new();
    for (number, line) in rows(contents) {
        let place = HandlePlace::Line(number);
        let refuse = |problem| HandlesError::Line {
            line: number,
            problem,
        };
        let words: Vec<&str> = line.split_whitespace().collect();
        let [vertex, coordinates @ ..] = words.as_slice() else {
            continue;
        };
        if coordinates.len() != 3 {
            let found = words.len();
            return Err(refuse(format!(
                "expected `vertex x y z`, found {found} words"
            )));
        }
        let vertex = vertex.parse::<usize>().map_err(|_| {
            refuse(format!(
                "`{vertex}` is not a vertex index (indices start at 0)"
            ))
        })?;
        mesh.position(vertex, place)?;
        let mut target = Point3::origin();
        for (slot, word) in target.iter_mut().zip(coordinates) {
            *slot =
                finite(word).map_err(|problem| refuse(format!("vertex {vertex}: {problem}")))?;
        }
        constraints.push(Constraint {
            vertex,
            goal: Goal::To(target),
            weight: None,
            turn: None,
            place,
        });
    }
    Ok(constraints)
}

/// The lines without comments and blank lines, with 1-based numbers.
pub(super) fn rows(contents: &str) -> impl Iterator<Item = (usize, &str)> {
    contents
        .lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.split('#').next().unwrap_or_default().trim()))
        .filter(|(_, line)| !line.is_empty())
}

/// Parses a finite number, or returns the problem.
pub(super) fn finite(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("`{word}` is not a finite number")),
        Err(_) => Err(format!("`{word}` is not a number")),
    }
}
