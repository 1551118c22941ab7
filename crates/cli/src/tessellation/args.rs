//! Options that the commands of this kind share.

use std::num::NonZeroUsize;

use clap::Args;

use crate::args::{OutputPath, values};

/// The outputs in addition to the mesh, and the threads.
#[derive(Debug, Args)]
pub(crate) struct OutcomeArgs {
    /// Number of threads; the result does not depend on it [default: one per core]
    #[arg(long, value_name = "N", value_parser = values::threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Write a report (JSON)
    #[arg(long, value_name = "R.json")]
    pub(crate) report: Option<OutputPath>,
    /// Draw the mesh before and after, coloured by the least angle of each face (PNG)
    #[arg(long, value_name = "P.png")]
    pub(crate) picture: Option<OutputPath>,
}
