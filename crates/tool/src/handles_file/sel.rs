//! The `.sel` + `.def` pair of the bend benchmark.
//!
//! `.sel` has one line per vertex of the mesh: 0 fixed, 1 free, 2 handle. `.def` has the 4×4
//! matrix that moves the handle vertices, row by row. Both may contain `#` comments.

use nalgebra::{Matrix4, Point3};

use super::constraint::{Constraint, Goal};
use super::error::{HandlePlace, HandlesError};
use super::text::{finite, rows};
use super::transform;
use super::vertices::Vertices;

/// The held vertices of a `.sel` file.
pub(super) struct Statuses {
    held: Vec<(usize, HandlePlace, Status)>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Status {
    Fixed,
    Moved,
}

/// Reads a `.sel` file.
pub(super) fn read_statuses(contents: &str, mesh: &Vertices<'_>) -> Result<Statuses, HandlesError> {
    let mut held = Vec::new();
    let mut num_lines = 0;
    for (line, word) in rows(contents) {
        let status = match word {
            "0" => Some(Status::Fixed),
            "1" => None,
            "2" => Some(Status::Moved),
            _ => {
                let problem =
                    format!("`{word}` is not a status: 0 is fixed, 1 is free, 2 is moved");
                return Err(HandlesError::Line { line, problem });
            }
        };
        held.extend(status.map(|status| (num_lines, HandlePlace::Line(line), status)));
        num_lines += 1;
    }
    if num_lines != mesh.len() {
        return Err(HandlesError::StatusCount {
            statuses: num_lines,
            num_vertices: mesh.len(),
        });
    }
    Ok(Statuses { held })
}

impl Statuses {
    /// Returns `true` if any vertex is moved.
    pub(super) fn need_matrix(&self) -> bool {
        self.held
            .iter()
            .any(|&(_, _, status)| status == Status::Moved)
    }

    pub(super) fn constraints(
        self,
        matrix: Option<Matrix4<f64>>,
        mesh: &Vertices<'_>,
    ) -> Result<Vec<Constraint>, HandlesError> {
        let matrix = matrix.unwrap_or_else(Matrix4::identity);
        let one = |(vertex, place, status)| {
            let position: Point3<f64> = mesh.position(vertex, place)?;
            let goal = match status {
                Status::Fixed => Goal::Stay,
                Status::Moved => Goal::To(transform::apply(&matrix, position)),
            };
            Ok(Constraint {
                vertex,
                goal,
                weight: None,
                turn: None,
                place,
            })
        };
        self.held.into_iter().map(one).collect()
    }
}

/// Reads a `.def` file.
pub(super) fn read_matrix(contents: &str) -> Result<Matrix4<f64>, HandlesError> {
    let mut matrix_rows: Vec<Vec<f64>> = Vec::new();
    for (line, row) in rows(contents) {
        let numbers = row
            .split_whitespace()
            .map(finite)
            .collect::<Result<Vec<_>, _>>();
        let numbers = numbers.map_err(|problem| HandlesError::Line { line, problem })?;
        matrix_rows.push(numbers);
    }
    transform::from_rows(&matrix_rows).map_err(HandlesError::Matrix)
}
