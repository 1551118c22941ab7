//! `cotan convert`: writes a mesh in another format.

pub(crate) mod args;

use cotan_tool::Work;

use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::report::{MeshCounts, Report};

use args::ConvertArgs;

pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<(), CliError> {
    files::mesh_format(&args.output)?;
    let document = files::load(&args.input, console)?;
    memory::check(Work::Convert, &args.input, &document)?;
    files::save(&document, &args.output, args.embed, console)?;
    console.note(&MeshCounts::new(&args.output, &document).table());
    Ok(())
}
