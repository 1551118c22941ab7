//! The options of `edit`.

use clap::Args;

use crate::args::InputPath;

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan edit bar.obj --handles bar.json

Starts the program cotan-editor, which is next to this one or on the PATH; its exit code is passed
on. `cotan edit bar.obj --help` shows the editor's own options.";

#[derive(Debug, Args)]
pub(crate) struct EditArgs {
    /// Mesh file (.obj, .ply, .off, .stl, .gltf, .glb; also with .gz)
    pub(crate) mesh: InputPath,
    /// Options of the editor, passed on as they are; a `--` before them is left out
    #[arg(
        value_name = "OPTIONS",
        trailing_var_arg = true,
        allow_hyphen_values = true
    )]
    pub(crate) options: Vec<std::ffi::OsString>,
}
