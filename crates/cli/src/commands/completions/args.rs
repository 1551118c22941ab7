//! The options of `completions`.

use clap::Args;

pub(crate) const EXAMPLE: &str = "\
Example:
  cotan completions bash > ~/.local/share/bash-completion/completions/cotan";

#[derive(Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell
    pub(crate) shell: clap_complete::Shell,
}
