//! `cotan convert`: the same mesh in another format.

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::text::Text;

pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<(), CliError> {
    let format = files::mesh_format(&args.output)?;
    let document = files::load(&args.input, console)?;
    for loss in document.losses(format) {
        console.warn(format_args!("{}: {loss}", args.input.display()));
    }
    files::save(&document, &args.output)?;
    console.note(&Text::of(format_args!(
        "{}: {} vertices, {} faces",
        args.output.display(),
        document.positions().len(),
        document.faces().len()
    )));
    Ok(())
}
