//! MTL, the material libraries of OBJ: read through the resolver of the document, and written.
//!
//! The statements are parsed one by one and converted to [`Materials`].
//! Problems with a library are never errors of the mesh: unreadable parts are listed among the
//! losses when the mesh is written in another format. Source: Wavefront, "Material Library File
//! (.mtl)", Advanced Visualizer manual, appendix B2; for the physically based statements
//! Clara.io, "Extending Wavefront MTL to support Physically-Based Rendering", 2014.

mod files;
mod options;
mod parse;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub(super) use files::Libraries;
pub(super) use read::materials;
pub(super) use write::{losses, material_names, write};
