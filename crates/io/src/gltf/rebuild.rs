//! The file of a mesh that was repaired.

use super::GltfFile;
use crate::error::IoError;
use crate::remap::Remap;
use crate::source::Mesh;

pub(super) fn rebuild(
    _file: &GltfFile,
    _remap: &Remap,
    _mesh: Mesh<'_>,
) -> Result<GltfFile, IoError> {
    Err(IoError::Unsupported {
        feature: "a repair within a glTF".to_owned(),
        remedy: "convert the file to another format first",
    })
}
