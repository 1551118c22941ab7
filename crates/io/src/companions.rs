//! Files that belong beside a mesh file: the buffers and images that a glTF refers to.

use std::borrow::Cow;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::resolve::{Resolve, inside};

/// Where the files go that a mesh file refers to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Companions {
    /// Beside the file, under the names by which it refers to them.
    ///
    /// A file that is there already is never replaced: it may stay if it has the same bytes, and
    /// otherwise the mesh is not written either. References that lead out of the folder stay as
    /// they are, and [`Saved::left`] names them.
    #[default]
    Beside,
    /// Into the file: as data URIs in a `.gltf`, in the binary chunk of a `.glb`. Formats that
    /// cannot hold other files have them beside.
    Embedded,
}

/// How a document is written.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct WriteOptions<'a> {
    /// Where the files go that it refers to.
    pub companions: Companions,
    /// The name that the file will have, without its extension: files that are made for it are
    /// named after it.
    pub name: &'a str,
}

impl Default for WriteOptions<'_> {
    fn default() -> Self {
        Self {
            companions: Companions::default(),
            name: "mesh",
        }
    }
}

impl<'a> WriteOptions<'a> {
    /// These options with another place for the files.
    #[must_use]
    pub fn companions(mut self, companions: Companions) -> Self {
        self.companions = companions;
        self
    }

    /// These options with another name.
    #[must_use]
    pub fn name(mut self, name: &'a str) -> Self {
        self.name = name;
        self
    }
}

/// A file in memory, with the files that belong beside it.
#[derive(Clone, Debug)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// What belongs beside it.
    pub companions: Vec<Companion>,
    /// References to what does not belong into its folder, one sentence each.
    pub left: Vec<String>,
}

impl From<Vec<u8>> for Written {
    fn from(bytes: Vec<u8>) -> Self {
        Self {
            bytes,
            companions: Vec::new(),
            left: Vec::new(),
        }
    }
}

/// What a save did besides writing the file.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Saved {
    /// Files that were written beside it. Those that were there already are not listed.
    pub copied: Vec<PathBuf>,
    /// References that were left as they are and may lead nowhere now, one sentence each.
    pub left: Vec<String>,
}

/// What a file refers to.
#[derive(Debug, Default)]
pub(crate) struct References {
    pub(crate) companions: Vec<Companion>,
    pub(crate) left: Vec<String>,
}

/// A file that belongs beside a mesh file, in its folder or in one below.
#[derive(Clone, Debug)]
pub struct Companion {
    path: PathBuf,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Made(Arc<Vec<u8>>),
    /// A file of the document that was read, under this name.
    Found {
        files: Arc<dyn Resolve>,
        name: String,
        max_bytes: u64,
    },
}

impl Companion {
    /// A file with these bytes; `name` is its path relative to the mesh file, with `/` between
    /// folders.
    ///
    /// # Errors
    /// Why the name is not that of a file in the folder.
    pub(crate) fn new(name: &str, bytes: Arc<Vec<u8>>) -> Result<Self, &'static str> {
        Self::at(name, Content::Made(bytes))
    }

    /// A file that is found under the same name by the resolver of the document, when it is needed.
    ///
    /// # Errors
    /// Why the name is not that of a file in the folder.
    pub(crate) fn found(
        name: &str,
        files: Arc<dyn Resolve>,
        max_bytes: u64,
    ) -> Result<Self, &'static str> {
        let content = Content::Found {
            files,
            name: name.to_owned(),
            max_bytes,
        };
        Self::at(name, content)
    }

    fn at(name: &str, content: Content) -> Result<Self, &'static str> {
        let path = inside(name)?;
        match path.file_name() {
            Some(_) => Ok(Self { path, content }),
            None => Err("it names no file"),
        }
    }

    /// Its path relative to the folder of the mesh file; does not lead out of it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its bytes, read now if they are in a file that the document refers to.
    ///
    /// # Errors
    /// Why that file cannot be read.
    pub fn bytes(&self) -> Result<Cow<'_, [u8]>, Error> {
        match &self.content {
            Content::Made(bytes) => Ok(Cow::Borrowed(bytes)),
            Content::Found {
                files,
                name,
                max_bytes,
            } => {
                let bytes = files.resolve(name, *max_bytes)?;
                if bytes.len() as u64 > *max_bytes {
                    return Err(Error::new(
                        ErrorKind::FileTooLarge,
                        "it is larger than the limit",
                    ));
                }
                Ok(Cow::Owned(bytes))
            }
        }
    }

    /// Whether it is a file of the document that was read and is not held in memory.
    pub(crate) fn is_found(&self) -> bool {
        matches!(self.content, Content::Found { .. })
    }
}
