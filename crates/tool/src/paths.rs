//! The files of one run: no output overwrites an input or another output.
//!
//! Programs register every file that they are going to read or write, and then check. Two paths
//! denote the same file regardless of spelling: relative or absolute, through `..`, links and
//! hard links, in different case where the file system ignores it, and even if the file does not
//! exist yet.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use cotan_io::{Printable, link_target};
use same_file::Handle;
use thiserror::Error;

use crate::error::ToolError;
use crate::files::{self, Stream, folder_of};

/// The files that a run reads and writes.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Paths {
    inputs: Vec<Named>,
    outputs: Vec<Named>,
}

/// A file and its purpose.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Named {
    /// The option or argument that specifies it, such as `--report`, or a short description.
    pub name: String,
    /// The file.
    pub path: PathBuf,
}

/// Two paths of a run that denote the same file, at least one of which would be written.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error(
    "{} {} and {} {} are the same file, so that writing one would overwrite the other; write to another \
     file, and rename it after checking it",
    output.name, Printable(output.path.display()), other.name, Printable(other.path.display())
)]
pub struct Conflict {
    /// An output.
    pub output: Named,
    /// An input or another output.
    pub other: Named,
}

impl Paths {
    /// Registers a file that will be read.
    pub fn read(&mut self, name: impl Into<String>, path: impl Into<PathBuf>) {
        self.inputs.push(Named::new(name, path));
    }

    /// Registers a file that will be written.
    pub fn write(&mut self, name: impl Into<String>, path: impl Into<PathBuf>) {
        self.outputs.push(Named::new(name, path));
    }

    /// The files that will be written.
    pub fn outputs(&self) -> &[Named] {
        &self.outputs
    }

    /// Rejects an output that is an input or another output.
    ///
    /// # Errors
    /// [`Conflict`] with the first pair.
    pub fn check(&self) -> Result<(), Conflict> {
        let inputs: Vec<_> = self.inputs.iter().map(Place::of).collect();
        let outputs: Vec<_> = self.outputs.iter().map(Place::of).collect();
        for (number, output) in outputs.iter().enumerate() {
            let mut others = inputs.iter().chain(&outputs[..number]);
            if let Some(other) = others.find(|other| output.is_same(other)) {
                return Err(output.conflict(other));
            }
        }
        Ok(())
    }

    /// Rejects a file that turned out to be read as well (the buffer of a glTF), if it is one of
    /// the outputs.
    ///
    /// # Errors
    /// [`Conflict`] with the output.
    pub fn check_read(&self, name: &str, path: &Path) -> Result<(), Conflict> {
        let read = Named::new(name, path);
        let read = Place::of(&read);
        match self
            .outputs
            .iter()
            .map(Place::of)
            .find(|o| o.is_same(&read))
        {
            Some(output) => Err(output.conflict(&read)),
            None => Ok(()),
        }
    }

    /// Rejects a file that turned out to be written as well (an image next to a mesh), if it is
    /// an input or an output.
    ///
    /// # Errors
    /// [`Conflict`] with that file.
    pub fn check_written(&self, name: &str, path: &Path) -> Result<(), Conflict> {
        let written = Named::new(name, path);
        let written = Place::of(&written);
        let mut others = self.inputs.iter().chain(&self.outputs).map(Place::of);
        match others.find(|other| written.is_same(other)) {
            Some(other) => Err(written.conflict(&other)),
            None => Ok(()),
        }
    }

    /// Rejects outputs that cannot be written, before the work is done rather than after it.
    ///
    /// # Errors
    /// As for [`files::check_writable`].
    pub fn check_writable(&self) -> Result<(), ToolError> {
        self.outputs
            .iter()
            .try_for_each(|output| files::check_writable(&output.path))
    }
}

impl Named {
    fn new(name: impl Into<String>, path: impl Into<PathBuf>) -> Self {
        Self {
            name: name.into(),
            path: path.into(),
        }
    }
}

/// The location of a file, as far as the system can tell.
struct Place<'a> {
    named: &'a Named,
    /// The path with links followed.
    target: PathBuf,
    exists: bool,
    /// The regular file that exists there.
    file: Option<Handle>,
    /// `target` with the canonical path of its folder, if the folder exists.
    canonical: Option<PathBuf>,
}

impl<'a> Place<'a> {
    fn of(named: &'a Named) -> Self {
        let target = link_target(&named.path).unwrap_or_else(|_| named.path.clone());
        // Nothing else is opened: a pipe would block.
        let is_file = std::fs::metadata(&named.path).is_ok_and(|metadata| metadata.is_file());
        let file = is_file
            .then(|| Handle::from_path(&named.path).ok())
            .flatten();
        let canonical = std::fs::canonicalize(&target).ok().or_else(|| {
            let folder = std::fs::canonicalize(folder_of(&target)).ok()?;
            Some(folder.join(target.file_name()?))
        });
        Self {
            named,
            exists: target.exists(),
            target,
            file,
            canonical,
        }
    }

    /// Returns `true` if both are the same file.
    fn is_same(&self, other: &Self) -> bool {
        let streams = [self, other].map(|place| Stream::of(&place.named.path));
        if let [Some(a), Some(b)] = streams {
            return a == b && a != Stream::Null;
        }
        if let (Some(a), Some(b)) = (&self.file, &other.file) {
            return a == b;
        }
        if self.exists != other.exists {
            return false;
        }
        match (&self.canonical, &other.canonical) {
            (Some(a), Some(b)) => a == b || (!self.exists && self.is_same_name(other)),
            (None, None) => self.target == other.target,
            _ => false,
        }
    }

    /// Returns `true` if two files that do not exist yet would have the same name in the same
    /// folder.
    fn is_same_name(&self, other: &Self) -> bool {
        let [Some(a), Some(b)] = [self, other].map(|place| place.target.file_name()) else {
            return false;
        };
        let [in_a, in_b] = [self, other].map(|place| Handle::from_path(folder_of(&place.target)));
        let is_one_folder = matches!((in_a, in_b), (Ok(a), Ok(b)) if a == b);
        is_one_folder && could_be_same(a, b) && are_same_names(folder_of(&self.target), a, b)
    }

    fn conflict(&self, other: &Self) -> Conflict {
        Conflict {
            output: self.named.clone(),
            other: other.named.clone(),
        }
    }
}

/// Returns `true` if some file system treats two names as equal: with different case, or (beyond
/// ASCII) with different code points.
fn could_be_same(a: &OsStr, b: &OsStr) -> bool {
    let [a, b] = [a, b].map(|name| name.to_string_lossy().to_lowercase());
    a == b || !(a.is_ascii() || b.is_ascii())
}

/// Asks the file system, by creating a temporary file whose name ends with one of the names.
fn are_same_names(folder: &Path, a: &OsStr, b: &OsStr) -> bool {
    if a == b {
        return true;
    }
    let prefix = OsStr::new(".cotan-");
    let Ok(probe) = cotan_io::Unfinished::create(folder, prefix, a, cotan_io::Access::Private)
    else {
        // The file system cannot be asked. Be cautious, since one of the two files would be lost.
        return a.to_string_lossy().to_lowercase() == b.to_string_lossy().to_lowercase();
    };
    let own = probe.path().file_name().unwrap_or_default();
    let [own, a] = [own, a].map(OsStr::as_encoded_bytes);
    let Some(random) = own
        .strip_suffix(a)
        .and_then(|own| std::str::from_utf8(own).ok())
    else {
        return false;
    };
    let mut twin = std::ffi::OsString::from(random);
    twin.push(b);
    std::fs::symlink_metadata(folder.join(twin)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Folder(tempfile::TempDir);

    impl Folder {
        /// A folder with `mesh.obj` and `other.obj`, and a subfolder `sub`.
        fn new() -> Self {
            let folder = Self(tempfile::tempdir().unwrap());
            std::fs::write(folder.path("mesh.obj"), "mesh").unwrap();
            std::fs::write(folder.path("other.obj"), "other").unwrap();
            std::fs::create_dir(folder.path("sub")).unwrap();
            folder
        }

        fn path(&self, name: &str) -> PathBuf {
            self.0.path().join(name)
        }

        fn check(&self, inputs: &[&str], outputs: &[&str]) -> Result<(), Conflict> {
            let mut paths = Paths::default();
            for name in inputs {
                paths.read("MESH", self.path(name));
            }
            for name in outputs {
                paths.write("--report", self.path(name));
            }
            paths.check()
        }
    }

    #[test]
    fn an_output_is_neither_an_input_nor_another_output() {
        let folder = Folder::new();
        folder
            .check(&["mesh.obj", "mesh.obj"], &["other.obj", "new"])
            .unwrap();
        folder.check(&[], &["new", "newer", "sub/new"]).unwrap();
        let conflict = folder
            .check(&["mesh.obj"], &["new", "mesh.obj"])
            .unwrap_err();
        let text = conflict.to_string();
        assert!(text.contains("--report") && text.contains("MESH"), "{text}");
        folder.check(&[], &["other.obj", "other.obj"]).unwrap_err();
        folder.check(&[], &["new", "new"]).unwrap_err();
    }

    #[test]
    fn spelling_does_not_matter() {
        let folder = Folder::new();
        for spelling in ["./mesh.obj", "sub/../mesh.obj", "sub//.././mesh.obj"] {
            folder.check(&["mesh.obj"], &[spelling]).unwrap_err();
            let new = spelling.replace("mesh", "new");
            folder.check(&[], &["new.obj", &new]).unwrap_err();
        }
        // Neither the folder nor the file exists.
        folder.check(&[], &["no/new", "no/new"]).unwrap_err();
    }

    #[cfg(unix)]
    #[test]
    fn links_lead_to_one_file() {
        use std::os::unix::fs::symlink;
        let folder = Folder::new();
        symlink("mesh.obj", folder.path("link")).unwrap();
        symlink(folder.path("link"), folder.path("sub/link")).unwrap();
        std::fs::hard_link(folder.path("mesh.obj"), folder.path("hard")).unwrap();
        symlink("sub", folder.path("folder")).unwrap();
        symlink("sub/new", folder.path("dangling")).unwrap();
        for name in [
            "link",
            "sub/link",
            "hard",
            "folder/link",
            "folder/../mesh.obj",
        ] {
            folder.check(&["mesh.obj"], &[name]).unwrap_err();
            folder.check(&[name], &["mesh.obj"]).unwrap_err();
        }
        folder.check(&[], &["dangling", "folder/new"]).unwrap_err();
        folder.check(&[], &["sub/new", "dangling"]).unwrap_err();
        folder
            .check(&["link"], &["dangling", "folder/newer"])
            .unwrap();
    }

    #[test]
    fn names_that_differ_in_case_are_one_file_where_the_system_ignores_case() {
        let folder = Folder::new();
        std::fs::write(folder.path("probe"), "").unwrap();
        let is_insensitive = folder.path("PROBE").exists();
        let outcome = folder.check(&[], &["new.json", "NEW.json"]);
        assert_eq!(outcome.is_err(), is_insensitive);
        assert_eq!(
            folder.check(&["probe"], &["Probe"]).is_err(),
            is_insensitive
        );
        // The probe leaves nothing behind.
        let count = std::fs::read_dir(folder.0.path()).unwrap().count();
        assert_eq!(count, 4);
        assert!(could_be_same(OsStr::new("\u{e9}"), OsStr::new("e\u{301}")));
        assert!(!could_be_same(OsStr::new("a"), OsStr::new("b")));
    }

    #[cfg(unix)]
    #[test]
    fn dev_null_may_be_written_twice() {
        let check = |[a, b]: [&str; 2]| {
            let mut paths = Paths::default();
            paths.write("--report", a);
            paths.write("--picture", b);
            paths.check()
        };
        check(["/dev/null", "/dev/null"]).unwrap();
        check(["/dev/stdout", "/dev/stderr"]).unwrap();
        check(["/dev/stdout", "/dev/stdout"]).unwrap_err();
    }

    #[cfg(unix)]
    #[test]
    fn checking_a_pipe_does_not_block() {
        let folder = Folder::new();
        let made = std::process::Command::new("mkfifo")
            .arg(folder.path("pipe"))
            .status();
        assert!(made.unwrap().success());
        folder.check(&["pipe"], &["new"]).unwrap();
        folder.check(&["pipe"], &["sub/../pipe"]).unwrap_err();
    }

    #[test]
    fn files_that_are_found_later_are_checked_too() {
        let folder = Folder::new();
        let mut paths = Paths::default();
        paths.read("MESH", folder.path("mesh.obj"));
        paths.write("--report", folder.path("scene.bin"));
        paths
            .check_read("a buffer", &folder.path("sub/../scene.bin"))
            .unwrap_err();
        paths
            .check_read("a buffer", &folder.path("mesh.obj"))
            .unwrap();
        paths
            .check_written("an image", &folder.path("mesh.obj"))
            .unwrap_err();
        paths
            .check_written("an image", &folder.path("scene.bin"))
            .unwrap_err();
        paths
            .check_written("an image", &folder.path("image.png"))
            .unwrap();
    }
}
