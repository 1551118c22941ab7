//! `cotan convert`: writes a mesh in another format.

use cotan_tool::Work;

use crate::args::ConvertArgs;
use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::memory;
use crate::text::Text;

pub(crate) fn run(args: &ConvertArgs, console: &Console) -> Result<(), CliError> {
    files::mesh_format(&args.output)?;
    let document = files::load(&args.input, console)?;
    memory::check(Work::Convert, &args.input, &document)?;
    files::save(&document, &args.output, args.embed, console)?;
    console.note(&Text::of(format_args!(
        "{}: {} vertices, {} faces",
        args.output.display(),
        document.positions().len(),
        document.faces().len()
    )));
    Ok(())
}
