//! The option for the files that a mesh refers to.

use clap::Args;
use cotan_io::Companions;

/// The destination of the files that OUT refers to.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(crate) struct EmbedArgs {
    /// Write the buffers and images that a glTF refers to into OUT. By default they are copied
    /// next to it if it lies in another folder, but never over another file
    #[arg(long)]
    embed: bool,
}

impl EmbedArgs {
    /// The destination of these files.
    pub(crate) fn companions(self) -> Companions {
        match self.embed {
            true => Companions::Embedded,
            false => Companions::Separate,
        }
    }
}
