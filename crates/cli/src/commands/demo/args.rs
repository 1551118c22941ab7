//! The options of `demo`.

use clap::Args;

use crate::args::OutputFolder;

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan demo -o out     writes before.obj, after.obj, handles.json, demo.png and report.json";

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "DIR", default_value = "cotan-demo")]
    pub(crate) output: OutputFolder,
}
