//! `cotan convert`: the same mesh in another format.

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;

pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<(), CliError> {
    files::check_mesh_path(&args.output)?;
    let document = files::load(&args.input, console)?;
    files::save(&document, &args.output, args.embed, console)?;
    console.note(format_args!(
        "{}: {} vertices, {} faces\n",
        args.output.display(),
        document.positions().len(),
        document.faces().len()
    ));
    Ok(())
}
