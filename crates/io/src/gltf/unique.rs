//! A file in which no two nodes share a mesh, so that each can be edited alone.
//!
//! Every node that shows a mesh in addition to the first gets a copy of its entry in the JSON. The
//! copies refer to the accessors of the original; these are copied only when a copy is edited and
//! written. The instances of one node by `EXT_mesh_gpu_instancing` continue to share their mesh.

use super::GltfFile;
use super::write::{Rewrite, write};
use crate::error::IoError;
use crate::source::{Moves, Reading, SourceFile};

/// Copies meshes that several nodes show; returns `None` if there are none.
///
/// The vertices and faces of the file keep their indices, and those of the copies follow.
pub(super) fn with_unique_meshes(
    file: &GltfFile,
    moves: &Moves<'_>,
) -> Result<Option<Reading>, IoError> {
    let others = file.geometry.placements.others.iter().enumerate();
    let further = others.flat_map(|(mesh, others)| others.further_nodes().map(move |n| (n, mesh)));
    let further: Vec<(usize, usize)> = further.collect();
    if further.is_empty() {
        return Ok(None);
    }
    let again = |bytes| GltfFile::read(bytes, &file.limits, file.files.clone());
    let (moved, _) = again(write(file, file.format(), moves)?)?;
    let mut rewrite = Rewrite::new(&moved)?;
    let editor = &mut rewrite.editor;
    let root = editor.root();
    let (nodes, meshes) = (editor.list(&root, "nodes")?, editor.list(&root, "meshes")?);
    let mut copies = Vec::with_capacity(further.len());
    for (node, mesh) in further {
        let (Some(node), Some(mesh)) = (nodes.get(node), meshes.get(mesh)) else {
            continue;
        };
        let number = meshes.len() + copies.len();
        copies.push(editor.text(mesh).to_owned());
        editor.set(node, "mesh", number.to_string())?;
    }
    editor.append(&root, "meshes", &copies)?;
    let bytes = rewrite.finish(file.container.is_binary)?;
    let (unique, parsed) = again(bytes)?;
    Ok(Some(Reading::new(parsed, unique)))
}
