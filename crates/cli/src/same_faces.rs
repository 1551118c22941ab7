//! Further files with the same vertices and faces as the mesh of a command.

use std::path::Path;

use cotan::geometry::Positions;
use cotan_io::Document;

use crate::args::InputPath;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::prepare::{Prepared, positions_of};

/// The positions of another file with the same faces, in the order of the processing mesh.
///
/// # Errors
/// [`CliError::Compare`] for a file with other faces.
pub(crate) fn other_positions(
    mesh: &Prepared,
    other_path: &InputPath,
    console: &Console,
) -> Result<Positions<f64>, CliError> {
    let other = files::load(other_path, console)?;
    check_same_faces([mesh.path(), other_path], [&mesh.document, &other])?;
    Ok(positions_of(&other, &mesh.processing))
}

/// Fails with the first difference if two documents do not have the same faces.
pub(crate) fn check_same_faces(
    paths: [&Path; 2],
    documents: [&Document; 2],
) -> Result<(), CliError> {
    let different = |problem: String| CliError::Compare {
        paths: paths.map(Path::to_owned),
        problem,
    };
    let [a, b] = documents;
    let counts = documents.map(|d| (d.positions().len(), d.faces().len()));
    if counts[0] != counts[1] {
        let [(va, fa), (vb, fb)] = counts;
        return Err(different(format!(
            "{va} vertices and {fa} faces against {vb} vertices and {fb} faces"
        )));
    }
    match a
        .faces()
        .iter()
        .zip(b.faces().iter())
        .position(|(f, g)| f != g)
    {
        Some(face) => Err(different(format!(
            "face {face} (counted from 0) has different corners"
        ))),
        None => Ok(()),
    }
}
