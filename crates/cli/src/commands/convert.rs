//! `cotan convert`: the same mesh in another format.

use cotan_tool::Work;

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::memory;

pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<(), CliError> {
    let format = files::check_mesh_path(&args.output)?;
    let document = files::load(&args.input, console)?;
    memory::check(Work::Convert, &args.input, &document)?;
    for loss in document.losses(format) {
        console.warn(format_args!("{}: {loss}", args.input.display()));
    }
    cotan_io::save(&document, &args.output)?;
    console.note(format_args!(
        "{}: {} vertices, {} faces\n",
        args.output.display(),
        document.positions().len(),
        document.faces().len()
    ));
    Ok(())
}
