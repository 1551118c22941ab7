//! The options for messages on standard error.

use clap::Args;

const MESSAGES: &str = "Messages";

/// The verbosity of messages on standard error.
#[derive(Debug, Args)]
pub(crate) struct Messages {
    /// Print errors only: no progress, no warnings, no summary
    #[arg(short, long, global = true, conflicts_with = "verbose", help_heading = MESSAGES)]
    pub(crate) quiet: bool,
    /// Print more: the phases and how long they take; twice: also the log of the libraries
    #[arg(short, long, global = true, action = clap::ArgAction::Count, help_heading = MESSAGES)]
    pub(crate) verbose: u8,
}
