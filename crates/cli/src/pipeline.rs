//! The steps of every command that reads meshes, works on them, and writes one.
//!
//! ```text
//! check → load → prepare → run → save → losses → report → picture
//! ```
//!
//! A command implements [`Job`], which says only what is particular to it; [`run`] is the one
//! place that puts the steps in order.

use std::num::NonZeroUsize;
use std::time::Instant;

use cotan_io::{Document, Format};

use crate::args::{EmbedArgs, OutputPath};
use crate::console::{Console, Progress};
use crate::error::CliError;
use crate::files;
use crate::losses;
use crate::prepare::{Prepared, Source, prepare};
use crate::report::{Report, Seconds, write_json};
use crate::threads;

/// The particulars of a command that reads meshes and writes one.
pub(crate) trait Job: Sync {
    /// The meshes that are read: [`Prepared`] for one, `[Prepared; 2]` for two.
    type Meshes: Meshes;
    /// The content of `--report` and of the summary.
    type Report: Report + Send;
    /// Further results of [`Self::run`] that the steps after it need; `()` if none.
    type Rest;

    /// The files and settings of the run.
    fn plan(&self) -> Plan<'_, <Self::Meshes as Meshes>::Sources>;

    /// Does the work.
    ///
    /// Repairs and defects have been dealt with, and nothing has been written yet. Check the
    /// memory first, with [`Prepared::check_memory`].
    fn run(
        &self,
        meshes: &mut Self::Meshes,
        context: &Context<'_>,
    ) -> Result<Finished<Self::Report, Self::Rest>, CliError>;

    /// Checks files that are named by other files rather than on the command line, before anything
    /// is read.
    fn check(&self) -> Result<(), CliError> {
        Ok(())
    }

    /// Prints warnings about the result and writes further files, after the mesh was written.
    fn after_save(
        &self,
        _meshes: &Self::Meshes,
        _finished: &mut Finished<Self::Report, Self::Rest>,
        _context: &Context<'_>,
    ) -> Result<(), CliError> {
        Ok(())
    }

    /// The picture (PNG) and its path, if one was requested.
    fn picture(
        &self,
        _meshes: &Self::Meshes,
        _finished: &Finished<Self::Report, Self::Rest>,
    ) -> Option<(&OutputPath, Vec<u8>)> {
        None
    }
}

/// The files and settings of a run.
#[derive(Debug)]
pub(crate) struct Plan<'a, S> {
    pub(crate) sources: S,
    /// The mesh to write.
    pub(crate) output: &'a OutputPath,
    pub(crate) embed: EmbedArgs,
    pub(crate) threads: Option<NonZeroUsize>,
    pub(crate) report: Option<&'a OutputPath>,
    /// The length of the progress bar; `None` for work that reports no progress.
    pub(crate) iterations: Option<usize>,
}

/// The surroundings of the work.
#[derive(Debug)]
pub(crate) struct Context<'a> {
    /// The format of the mesh to write.
    pub(crate) format: Format,
    pub(crate) console: &'a Console,
    pub(crate) progress: Progress,
}

/// The result of [`Job::run`].
#[derive(Debug)]
pub(crate) struct Finished<R, T> {
    pub(crate) mesh: Output,
    pub(crate) report: R,
    pub(crate) rest: T,
}

/// The mesh to write.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one per run")]
pub(crate) enum Output {
    /// The file of the (first) mesh that was read, whose document the job has changed.
    InPlace,
    /// A mesh of its own, without anything of the files that were read.
    New(Document),
}

/// The meshes that a job reads.
pub(crate) trait Meshes: Sized {
    /// Their files.
    type Sources;

    /// Reads and builds them, in order.
    fn prepare(
        sources: Self::Sources,
        seconds: &mut Seconds,
        console: &Console,
    ) -> Result<Self, CliError>;

    /// The mesh that [`Output::InPlace`] means.
    fn first(&self) -> &Prepared;
}

impl Meshes for Prepared {
    type Sources = Source;

    fn prepare(source: Source, seconds: &mut Seconds, console: &Console) -> Result<Self, CliError> {
        prepare(source, seconds, console)
    }

    fn first(&self) -> &Prepared {
        self
    }
}

impl Meshes for [Prepared; 2] {
    type Sources = [Source; 2];

    fn prepare(
        [a, b]: [Source; 2],
        seconds: &mut Seconds,
        console: &Console,
    ) -> Result<Self, CliError> {
        Ok([prepare(a, seconds, console)?, prepare(b, seconds, console)?])
    }

    fn first(&self) -> &Prepared {
        &self[0]
    }
}

/// Runs a job and prints its summary if one is wanted.
///
/// # Errors
/// As for [`run`].
pub(crate) fn execute(job: &impl Job, console: &Console) -> Result<(), CliError> {
    let report = run(job, console)?;
    console.note(&report.table());
    Ok(())
}

/// Runs a job on the threads of its plan. Returns its report.
///
/// # Errors
/// [`CliError`] of the first step that fails. An output of a step that was not reached is not
/// written; existing files stay intact.
pub(crate) fn run<J: Job>(job: &J, console: &Console) -> Result<J::Report, CliError> {
    let plan = job.plan();
    threads::with_threads(plan.threads, || steps(job, console))?
}

fn steps<J: Job>(job: &J, console: &Console) -> Result<J::Report, CliError> {
    let clock = Instant::now();
    let plan = job.plan();
    let context = Context {
        format: files::mesh_format(plan.output)?,
        console,
        progress: console.progress(plan.iterations),
    };
    job.check()?;

    context.progress.phase("load");
    let mut seconds = Seconds::default();
    let mut meshes = Meshes::prepare(plan.sources, &mut seconds, console)?;
    let mut finished = job.run(&mut meshes, &context)?;
    context.progress.finish();

    match &finished.mesh {
        Output::InPlace => {
            let mesh = J::Meshes::first(&meshes);
            files::save(&mesh.document, plan.output, plan.embed, console)?;
            losses::warn(plan.output, context.format, &mesh.changes, console);
        }
        Output::New(document) => files::save(document, plan.output, plan.embed, console)?,
    }
    seconds.total = clock.elapsed().as_secs_f64();
    finished.report.set_seconds(seconds);
    job.after_save(&meshes, &mut finished, &context)?;
    if let Some(path) = plan.report {
        write_json(path, &finished.report)?;
    }
    if let Some((path, png)) = job.picture(&meshes, &finished) {
        files::write(path, &png)?;
    }
    Ok(finished.report)
}
