//! The material libraries that an OBJ refers to, and the images that these refer to.

use std::collections::BTreeSet;
use std::io::{Error, ErrorKind};
use std::sync::Arc;

use super::parse::Definitions;
use crate::companions::{Companion, References};
use crate::error::quote;
use crate::limits::Limits;
use crate::resolve::Resolve;

/// The libraries of an OBJ.
#[derive(Debug, Default)]
pub(in crate::obj) struct Libraries {
    /// The libraries found, in file order, each once.
    pub(super) found: Vec<Library>,
    /// The libraries that are missing, with the reason.
    pub(super) missing: Vec<(String, Error)>,
    /// The number of bytes that may still be read.
    budget: u64,
}

/// A library.
#[derive(Debug)]
pub(super) struct Library {
    /// Its path relative to the OBJ, normalized.
    pub(super) name: String,
    pub(super) definitions: Definitions,
}

impl Libraries {
    /// Reads the libraries named by these `mtllib` arguments.
    ///
    /// Names may contain spaces, and a statement may name several libraries. Therefore the whole
    /// line is tried first, then the parts that end in `.mtl`, then every word.
    pub(in crate::obj) fn read(lines: &[String], files: &dyn Resolve, limits: &Limits) -> Self {
        let mut libraries = Self {
            budget: limits.max_bytes.min(limits.max_memory / GROWTH),
            ..Self::default()
        };
        for line in lines {
            let names = [line.clone()];
            if libraries.open_all(&names, files).is_ok() {
                continue;
            }
            let names = split_at_extensions(line);
            for name in names {
                let Err(error) = libraries.open_all(std::slice::from_ref(&name), files) else {
                    continue;
                };
                let words: Vec<String> = name.split_ascii_whitespace().map(str::to_owned).collect();
                if words.len() < 2 || libraries.open_all(&words, files).is_err() {
                    libraries.miss(name, error);
                }
            }
        }
        libraries
    }

    /// Opens all of these or none.
    fn open_all(&mut self, names: &[String], files: &dyn Resolve) -> Result<(), Error> {
        let mut opened = Vec::new();
        let mut budget = self.budget;
        for name in names {
            let Some(name) = normalized("", name) else {
                return Err(outside());
            };
            let is_known = |library: &Library| library.name == name;
            if self.found.iter().chain(&opened).any(is_known) {
                continue;
            }
            let bytes = files.resolve(&name, budget)?;
            let rest = budget.checked_sub(bytes.len() as u64);
            budget = rest.ok_or_else(|| Error::from(ErrorKind::FileTooLarge))?;
            opened.push(Library {
                name,
                definitions: Definitions::new(&bytes),
            });
        }
        self.found.append(&mut opened);
        self.budget = budget;
        Ok(())
    }

    fn miss(&mut self, name: String, error: Error) {
        if !self.missing.iter().any(|(missing, _)| *missing == name) {
            self.missing.push((name, error));
        }
    }

    /// The companion files of the OBJ, wherever it is written.
    pub(in crate::obj) fn references(&self, files: &Arc<dyn Resolve>, max: u64) -> References {
        let mut references = References::default();
        for (name, error) in &self.missing {
            references.left.push(format!(
                "the material library `{}` was not copied ({})",
                quote(name.as_bytes()),
                reason(error)
            ));
        }
        let mut seen = BTreeSet::new();
        let mut add = |references: &mut References, name: &str| {
            if !seen.insert(name.to_owned()) {
                return;
            }
            match Companion::found(name, Arc::clone(files), max) {
                Ok(companion) => references.companions.push(companion),
                Err(problem) => references.left.push(format!(
                    "the reference to `{}` is unchanged ({problem})",
                    quote(name.as_bytes())
                )),
            }
        };
        for library in &self.found {
            add(&mut references, &library.name);
            for path in &library.definitions.paths {
                let mut places = library.places(path);
                // Which of two places is meant is only known once the files are looked up.
                if places.len() > 1
                    && let Some(at) = places
                        .iter()
                        .position(|place| files.resolve(place, max).is_ok())
                {
                    places.swap(0, at);
                }
                match places.first() {
                    Some(place) => add(&mut references, place),
                    None => add(&mut references, path),
                }
            }
        }
        references
    }
}

impl Library {
    /// The possible paths of an image named by the library: relative to the library, or to the
    /// OBJ.
    pub(super) fn places(&self, path: &str) -> Vec<String> {
        let folder = self.name.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut places: Vec<String> = normalized(folder, path).into_iter().collect();
        places.extend(normalized("", path).filter(|place| places.first() != Some(place)));
        places
    }
}

/// Normalizes a path without `.` and `..`; `None` if it leads out of the folder of the OBJ.
fn normalized(folder: &str, path: &str) -> Option<String> {
    let path = path.replace('\\', "/");
    if path.starts_with('/') || path.contains([':', '\0']) {
        return None;
    }
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    (!parts.is_empty()).then(|| parts.join("/"))
}

/// Splits a line into names, each of which except the last ends in `.mtl`.
fn split_at_extensions(line: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut name = String::new();
    for word in line.split(' ') {
        if !name.is_empty() {
            name.push(' ');
        }
        name.push_str(word);
        let is_end = name.len() >= 4
            && name
                .get(name.len() - 4..)
                .is_some_and(|end| end.eq_ignore_ascii_case(".mtl"));
        if is_end {
            names.push(std::mem::take(&mut name).trim().to_owned());
        }
    }
    names.push(name.trim().to_owned());
    names.retain(|name| !name.is_empty());
    names
}

/// The reason why a file is not available, in words that are the same on every system.
pub(super) fn reason(error: &Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "there is no such file".to_owned(),
        ErrorKind::FileTooLarge => "it is larger than the limit".to_owned(),
        _ => error.to_string(),
    }
}

pub(super) fn outside() -> Error {
    Error::new(
        ErrorKind::PermissionDenied,
        "only files in the folder of the mesh are opened",
    )
}

/// Maximum ratio of a library's memory to its text size: a line `newmtl a` becomes a material of
/// about 500 bytes.
const GROWTH: u64 = 64;
