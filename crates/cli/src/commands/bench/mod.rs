//! `cotan bench`: measures the speed of this machine for a mesh.

pub(crate) mod args;
mod measure;

use cotan::shapes::{CREATURE_RESOLUTION, creature};
use cotan_io::Document;

use crate::args::{InputPath, OutputPath};
use crate::console::Console;
use crate::error::CliError;
use crate::report::{Table, json_text, number};
use crate::text::Text;
use crate::threads;

use args::BenchArgs;
use measure::{Measured, Plan};

pub(crate) fn run(args: &BenchArgs, console: &Console) -> Result<(), CliError> {
    let folder;
    let (path, name): (InputPath, String) = match &args.mesh {
        Some(path) => (path.clone(), path.display().to_string()),
        None => {
            folder = tempfile::tempdir().map_err(CliError::Output)?;
            let path = OutputPath::from(folder.path().join("model.obj"));
            write_model(&path)?;
            (path.as_input(), "the built-in model".to_owned())
        }
    };
    let plan = Plan {
        path: &path,
        weld: args.weld.unwrap_or_default(),
        orientation: args.orientation,
        rounds: args.rounds.get(),
    };
    let mut measured = threads::with_threads(args.threads, || plan.measure(console))??;
    measured.mesh = name;
    if args.json {
        return console.print(&json_text(&measured)?);
    }
    console.print(&table(&measured))
}

fn write_model(path: &OutputPath) -> Result<(), CliError> {
    let model = creature::<f64>(CREATURE_RESOLUTION);
    let document = Document::from_mesh(model.connectivity(), model.positions())?;
    cotan_io::save(&document, path)?;
    Ok(())
}

fn table(measured: &Measured) -> Text {
    let mut table = Table::default();
    table.row("mesh", &measured.mesh);
    table.row(
        "vertices, faces",
        format_args!("{}, {}", measured.vertices, measured.faces),
    );
    table.row("threads", measured.threads);
    if measured.is_renumbered {
        table.row("order", "scattered in the file, spatial in memory");
    }
    let seconds = &measured.seconds;
    for (name, time) in [
        ("load the file", seconds.load),
        ("build the mesh", seconds.build),
        ("weights, assembly", seconds.assemble),
        ("order and factor", seconds.factor),
        ("add a handle", seconds.add_handle),
        ("solve", seconds.solve),
        ("iteration", seconds.iteration),
        ("  without its solve", seconds.iteration_rest),
    ] {
        table.row(name, time_of(time));
    }
    let job = &measured.job;
    let steps = format!(
        "{} in {} iterations ({})",
        time_of(job.seconds),
        job.iterations,
        job.stop_reason
    );
    table.row("whole drag", steps);
    let bytes = &measured.bytes;
    table.row("file", megabytes(bytes.file));
    table.row("mesh, positions", megabytes(bytes.mesh));
    table.row("factor", megabytes(bytes.factor));
    table.text
}

fn time_of(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{} s", number(s)),
        s => format!("{:.3} ms", s * 1e3),
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.2} MB", bytes as f64 / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_in_seconds_or_thousandths() {
        assert_eq!(time_of(0.012_345_6), "12.346 ms");
        assert!(time_of(2.5).ends_with(" s"));
        assert_eq!(megabytes(1_500_000), "1.50 MB");
    }
}
