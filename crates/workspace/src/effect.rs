//! Effects of a command, for the front end to show.

use std::path::PathBuf;

use cotan::geometry::TriangleTree;

use crate::command::Command;

/// A reaction of the window to a command.
#[derive(Debug)]
#[non_exhaustive]
pub enum Effect {
    /// Show another model. The tree is that of its shape, for picking.
    Opened(Box<TriangleTree>),
    /// Colour the selection, the handles and the masks anew.
    Marked,
    /// Tell the person something that needs attention.
    Told(Notice),
    /// Mention something in passing.
    Mentioned(String),
    /// Ask a question. If the answer is yes, apply the command.
    Asked {
        /// The reason for the question.
        reason: String,
        /// The command.
        command: Command,
    },
    /// Warn of something, with commands that avoid it.
    Offered {
        /// The warning.
        text: String,
        /// The ways out, with their names.
        ways: Vec<(&'static str, Command)>,
    },
    /// Ask for the file to save to.
    AskedForFile,
    /// A file was written.
    Written(PathBuf),
}

/// Something that needs attention.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Notice {
    /// It did not work.
    Error(String),
    /// It worked, but there is something to know.
    Note(String),
}
