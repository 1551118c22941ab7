//! Companion files of a mesh file, such as the buffers and images that a glTF refers to.

use std::borrow::Cow;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::resolve::{Resolve, inside};

/// The destination of the files that a mesh file refers to.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Companions {
    /// Next to the file, under the names by which it refers to them.
    ///
    /// An existing file is never replaced. If it has the same bytes it stays, otherwise the mesh
    /// is not written either. References that lead out of the folder are left unchanged and
    /// listed in [`Saved::left`].
    #[default]
    Separate,
    /// Inside the file: as data URIs in a `.gltf`, in the binary chunk of a `.glb`. For formats
    /// that cannot embed files, the companions are placed next to the file.
    Embedded,
}

/// Options for writing a document.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct WriteOptions<'a> {
    /// The destination of the files that it refers to.
    pub companions: Companions,
    /// The name of the output file without its extension; companion files created for it are
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
    /// Sets the destination of the companion files.
    #[must_use]
    pub fn companions(mut self, companions: Companions) -> Self {
        self.companions = companions;
        self
    }

    /// Sets the name.
    #[must_use]
    pub fn name(mut self, name: &'a str) -> Self {
        self.name = name;
        self
    }
}

/// A file in memory, together with its companion files.
#[derive(Clone, Debug)]
pub struct Written {
    /// The file.
    pub bytes: Vec<u8>,
    /// The files that belong next to it.
    pub companions: Vec<Companion>,
    /// References to files outside its folder, one sentence each.
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

/// The side effects of saving a file.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Saved {
    /// Companion files that were written. Those that already existed are not listed.
    pub copied: Vec<PathBuf>,
    /// References that were left unchanged and may be broken now, one sentence each.
    pub left: Vec<String>,
}

/// The references of a file.
#[derive(Debug, Default)]
pub(crate) struct References {
    pub(crate) companions: Vec<Companion>,
    pub(crate) left: Vec<String>,
}

/// A file that belongs next to a mesh file, in its folder or a subfolder.
#[derive(Clone, Debug)]
pub struct Companion {
    path: PathBuf,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    Made(Arc<Vec<u8>>),
    /// A file referenced by the original document, under this name.
    Found {
        files: Arc<dyn Resolve>,
        name: String,
        max_bytes: u64,
    },
}

impl Companion {
    /// Creates a companion with these bytes.
    ///
    /// `name` is its path relative to the mesh file, with `/` as the separator.
    ///
    /// # Errors
    /// The reason why the name does not denote a file in the folder.
    pub(crate) fn new(name: &str, bytes: Arc<Vec<u8>>) -> Result<Self, &'static str> {
        Self::at(name, Content::Made(bytes))
    }

    /// Creates a companion whose content the document's resolver supplies on demand, under the
    /// same name.
    ///
    /// # Errors
    /// The reason why the name does not denote a file in the folder.
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

    /// The path relative to the folder of the mesh file; never leads out of it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns its bytes, reading them now if they are in a file that the document refers to.
    ///
    /// # Errors
    /// The reason why that file cannot be read.
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

    /// Returns `true` for a file of the original document that is not held in memory.
    pub(crate) fn is_found(&self) -> bool {
        matches!(self.content, Content::Found { .. })
    }
}
