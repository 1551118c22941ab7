//! Checks that a map survives the number type of its file.

use std::path::Path;

use cotan::geometry::{Positions, Scalar};
use cotan::sphere::flipped_faces;
use cotan_io::{Format, IoError, ProcessingMesh};

use crate::console::Console;
use crate::error::CliError;
use crate::prepare::positions_of;
use crate::sphere::Mapped;

/// Warns about triangles that are flipped in the file at `path`, whose numbers may be shorter
/// than those of the map.
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

/// The positions stored in the file; `None` if they equal those of the map bit for bit.
fn stored<T: Scalar>(
    path: &Path,
    format: Format,
    mapped: &Mapped<T>,
    processing: &ProcessingMesh,
) -> Result<Option<Positions<f64>>, IoError> {
    Ok(match format {
        // Text with as many digits as needed.
        Format::Obj | Format::Off => None,
        // STL does not keep the order of the vertices, but the rounding is known.
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
