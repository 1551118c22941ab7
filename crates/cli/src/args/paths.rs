//! The types of files on the command line, by their use.
//!
//! Every argument that names a file has one of these types. `crate::paths` uses them to find all
//! files of a run, whatever the command, and refuses an output that is an input or another
//! output.

use std::ffi::OsString;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// A file that is read.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct InputPath(PathBuf);

/// A file that is written.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct OutputPath(PathBuf);

/// A folder that files are written to.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct OutputFolder(PathBuf);

impl OutputFolder {
    /// A file in this folder.
    pub(crate) fn file(&self, name: &str) -> OutputPath {
        OutputPath(self.0.join(name))
    }
}

impl OutputPath {
    /// The file as an input of a later step of the same run.
    pub(crate) fn as_input(&self) -> InputPath {
        InputPath(self.0.clone())
    }
}

macro_rules! path {
    ($name:ident) => {
        impl From<OsString> for $name {
            fn from(path: OsString) -> Self {
                Self(path.into())
            }
        }

        impl From<PathBuf> for $name {
            fn from(path: PathBuf) -> Self {
                Self(path)
            }
        }

        impl Deref for $name {
            type Target = Path;

            fn deref(&self) -> &Path {
                &self.0
            }
        }

        impl AsRef<Path> for $name {
            fn as_ref(&self) -> &Path {
                &self.0
            }
        }
    };
}

path!(InputPath);
path!(OutputPath);
path!(OutputFolder);

#[cfg(test)]
mod tests {
    use std::any::TypeId;

    use clap::CommandFactory;

    use super::*;
    use crate::command_line::Arguments;

    #[test]
    fn every_file_argument_is_declared_as_input_or_output() {
        let undeclared = [TypeId::of::<PathBuf>(), TypeId::of::<OsString>()];
        let mut found = Vec::new();
        for command in Arguments::command().get_subcommands() {
            for argument in command.get_arguments() {
                let kind = argument.get_value_parser().type_id();
                if undeclared.iter().any(|undeclared| kind == *undeclared) {
                    found.push(format!("{} {}", command.get_name(), argument.get_id()));
                }
            }
        }
        // The options of the editor, which parses them itself.
        assert_eq!(found, ["edit options"]);
    }
}
