//! Whether a map survives the numbers of the file that it was written to.

use std::path::Path;

use cotan::geometry::{Positions, Scalar};
use cotan::sphere::flipped_faces;
use cotan_io::{Format, IoError, ProcessingMesh};

use super::Mapped;
use crate::console::Console;
use crate::edit::positions_of;
use crate::error::CliError;

/// Warns of triangles that are flipped in the file at `path`, which may hold shorter numbers than
/// the map has.
pub(crate) fn warn_of_short_numbers<T: Scalar>(
    path: &Path,
    format: Format,
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
    console: &Console,
) -> Result<(), CliError> {
    let Some(stored) = stored(path, format, mapped, processing)? else {
        return Ok(());
    };
    let flipped = flipped_faces(processing.mesh(), &stored).len();
    if flipped > 0 {
        console.warn(format_args!(
            "{}: no triangle of the map is flipped, but the shorter numbers of this file flip \
             {flipped}; write .obj or .off, or map with --precision f32",
            path.display()
        ));
    }
    Ok(())
}

/// The positions that the file holds; `None` if they are those of the map to the bit.
fn stored<T: Scalar>(
    path: &Path,
    format: Format,
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
) -> Result<Option<Positions<f64>>, IoError> {
    Ok(match format {
        // Text with as many digits as it takes.
        Format::Obj | Format::Off => None,
        // It does not keep the order of vertices, but its numbers are known.
        Format::Stl => {
            let single = |x: T| f64::from(x.as_f64() as f32);
            Some(mapped.map.positions().map(|p| p.map(single)))
        }
        _ => {
            let document = cotan_io::load(path)?;
            let is_same = document.positions().len() == processing.num_document_vertices();
            is_same.then(|| positions_of(&document, processing))
        }
    })
}
