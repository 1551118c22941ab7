//! `cotan repair`: repairs a mesh as far as possible without guessing a shape.

pub(crate) mod args;
mod report;

use cotan_tool::Work;
use cotan_tool::repair::mend;

use crate::console::Console;
use crate::error::CliError;
use crate::files;
use crate::losses;
use crate::memory;
use crate::prepare::warn_unfair;
use crate::report::write_json;

use args::RepairArgs;
use report::RepairReport;

pub(crate) fn run(args: &RepairArgs, console: &Console) -> Result<(), CliError> {
    let format = files::mesh_format(&args.output)?;
    let document = files::load(&args.input, console)?;
    memory::check(Work::Repair, &args.input, &document)?;
    let in_file = |error| files::in_file(&args.input, error);
    let mended = mend(&args.repair(), &document).map_err(in_file)?;
    if let Some(problem) = &mended.unfair {
        warn_unfair(&args.input, problem, console);
    }
    let repaired = mended.repaired;
    files::save(&repaired.document, &args.output, args.embed, console)?;
    losses::warn(&args.output, format, &repaired.changes, console);
    let report = RepairReport::new(&repaired.document, &repaired.changes).map_err(in_file)?;
    if let Some(path) = &args.report {
        write_json(path, &report)?;
    }
    if console.is_quiet() {
        return Ok(());
    }
    console.print(&report.table())
}
