//! Losses of a repair: changes that the format of the output cannot express.
//!
//! The losses of a conversion are those of [`Document::losses`](cotan_io::Document::losses), which
//! [`files::save`](crate::files::save) prints.

use std::path::Path;

use cotan_io::{Change, Format};

use crate::console::Console;

/// Warns about changes of a repair that the file at `path` does not keep.
pub(crate) fn warn(path: &Path, format: Format, changes: &[Change], console: &Console) {
    for forgotten in forgotten(format, changes) {
        console.warn(format_args!("{}: {forgotten}", path.display()));
    }
}

/// The changes of a repair that a file in `format` cannot express, for warnings.
fn forgotten(format: Format, changes: &[Change]) -> Vec<String> {
    let is_parting = |change: &Change| {
        matches!(
            change,
            Change::SplitVertex { .. } | Change::PartedPlace { .. } | Change::DetachedFace { .. }
        )
    };
    let is_merging = |change: &Change| matches!(change, Change::MergedVertex { .. });
    let is_gltf = matches!(format, Format::Gltf | Format::Glb);
    let mut forgotten = Vec::new();
    if (is_gltf || format == Format::Stl) && changes.iter().any(is_parting) {
        let unless = if is_gltf {
            ", unless with --weld off"
        } else {
            ""
        };
        forgotten.push(format!(
            "{format} stores positions, not the identity of vertices; vertices that were split are \
             merged again when the file is read{unless}"
        ));
    }
    if is_gltf && changes.iter().any(is_merging) {
        forgotten.push(format!(
            "{format} keeps the original positions; vertices that were merged within a distance are \
             separate again when the file is read, unless with the same --weld"
        ));
    }
    forgotten
}
