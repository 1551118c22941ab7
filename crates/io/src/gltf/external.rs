//! The files that a glTF refers to: its buffers, which are read with it, and all others, which
//! are read on demand.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{Error, ErrorKind};
use std::sync::Arc;

use super::buffers::{data_of, unescape};
use super::container::Container;
use super::tokens::{Token, Tokens};
use crate::companions::{Companion, References};
use crate::error::{IoError, quote};
use crate::resolve::Resolve;

/// The files of a glTF.
#[derive(Clone, Debug)]
pub(super) struct External {
    /// The files of buffers, by unescaped name.
    read: BTreeMap<String, Arc<Vec<u8>>>,
    num_bytes: u64,
    resolver: Arc<dyn Resolve>,
}

impl External {
    /// Creates a set of files that `resolver` will find; none is read yet.
    pub(super) fn new(resolver: Arc<dyn Resolve>) -> Self {
        Self {
            read: BTreeMap::new(),
            num_bytes: 0,
            resolver,
        }
    }

    /// Total size of the files that were read, each counted once.
    pub(super) fn num_bytes(&self) -> u64 {
        self.num_bytes
    }

    /// The bytes of a file that a buffer refers to, read on first use.
    pub(super) fn read(&mut self, uri: &str, max_bytes: u64) -> Result<Arc<Vec<u8>>, IoError> {
        let name = name(uri)?;
        if let Some(bytes) = self.read.get(&name) {
            return Ok(Arc::clone(bytes));
        }
        let bytes = self.find(&name, max_bytes);
        let bytes = Arc::new(bytes.map_err(|error| refused(uri, error.to_string()))?);
        self.num_bytes = self.num_bytes.saturating_add(bytes.len() as u64);
        self.read.insert(name, Arc::clone(&bytes));
        Ok(bytes)
    }

    /// The bytes of any file, read again unless a buffer refers to it; `None` if there is no such
    /// file in the folder.
    pub(super) fn bytes(&self, uri: &str, max_bytes: u64) -> Result<Option<Arc<Vec<u8>>>, IoError> {
        let Some(name) = name(uri).ok().filter(|_| !is_address(uri)) else {
            return Ok(None);
        };
        if let Some(bytes) = self.read.get(&name) {
            return Ok(Some(Arc::clone(bytes)));
        }
        match self.find(&name, max_bytes) {
            Ok(bytes) => Ok(Some(Arc::new(bytes))),
            Err(error) => match error.kind() {
                ErrorKind::NotFound | ErrorKind::PermissionDenied => Ok(None),
                _ => Err(refused(&name, error.to_string())),
            },
        }
    }

    fn find(&self, name: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        let bytes = self.resolver.resolve(name, max_bytes)?;
        if bytes.len() as u64 > max_bytes {
            let problem = "it is larger than the limit";
            return Err(Error::new(ErrorKind::FileTooLarge, problem));
        }
        Ok(bytes)
    }

    /// Lists the references in a glTF or GLB written from the file with these files.
    pub(super) fn references(&self, written: &[u8], max: u64) -> Result<References, IoError> {
        let container = Container::read(written, &mut Vec::new())?;
        let text = str::from_utf8(written.get(container.json).unwrap_or(&[])).unwrap_or_default();
        let mut references = References::default();
        for uri in uris(text) {
            let companion = name(&uri).and_then(|name| {
                let companion = match self.read.get(&name) {
                    Some(bytes) => Companion::new(&name, Arc::clone(bytes)),
                    None => Companion::found(&name, Arc::clone(&self.resolver), max),
                };
                companion.map_err(|problem| refused(&uri, problem.to_owned()))
            });
            match companion {
                Ok(companion) => references.companions.push(companion),
                Err(_) if is_address(&uri) => {}
                Err(_) => references.left.push(format!(
                    "the reference to `{}` is unchanged; it points outside the folder, and that \
                     file was not copied",
                    quote(uri.as_bytes())
                )),
            }
        }
        Ok(references)
    }
}

/// Returns the buffers that were read, and forwards everything else to the original resolver.
impl Resolve for External {
    fn resolve(&self, uri: &str, max_bytes: u64) -> Result<Vec<u8>, Error> {
        match self.read.get(uri) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => self.resolver.resolve(uri, max_bytes),
        }
    }

    fn shared(&self) -> Arc<dyn Resolve> {
        Arc::new(self.clone())
    }
}

/// The name in a reference, without percent escapes.
fn name(uri: &str) -> Result<String, IoError> {
    let name = unescape(uri).map_err(|problem| refused(uri, problem))?;
    String::from_utf8(name.into_owned())
        .map_err(|_| refused(uri, "its percent escapes are not UTF-8".to_owned()))
}

fn refused(uri: &str, problem: String) -> IoError {
    IoError::External {
        uri: quote(uri.as_bytes()),
        problem,
    }
}

/// Returns `true` if a reference does not depend on the folder of the file.
fn is_address(uri: &str) -> bool {
    let scheme = uri.split_once("://").map(|(scheme, _)| scheme);
    scheme.is_some_and(|s| !s.is_empty() && s.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Lists the references to other files in a JSON text: every `uri` that is not a data URI, each
/// once. Application data (`extras`) is not searched.
fn uris(text: &str) -> Vec<String> {
    let mut uris: Vec<String> = Vec::new();
    let mut seen = BTreeSet::new();
    let mut tokens = Tokens::new(text);
    while let Some(token) = tokens.next() {
        let Token::Key(_) = token else { continue };
        match token.string().as_deref() {
            Some("extras") => tokens.skip_value(),
            Some("uri") => {
                let mut ahead = tokens.clone();
                if let Some(value @ Token::Text(_)) = ahead.next() {
                    let uri = value.string().filter(|uri| data_of(uri).is_none());
                    uris.extend(uri.filter(|uri| seen.insert(uri.clone())));
                    tokens = ahead;
                }
            }
            _ => {}
        }
    }
    uris
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::resolve::NoFiles;

    #[test]
    fn escapes_that_are_not_text_are_refused() {
        let mut files = External::new(NoFiles.shared());
        let error = files.read("%FF.bin", 10).unwrap_err().to_string();
        assert!(
            error.contains("its percent escapes are not UTF-8"),
            "{error}"
        );
        let error = files.read("a%zz.bin", 10).unwrap_err().to_string();
        assert!(error.contains("hexadecimal"), "{error}");
    }

    #[test]
    fn references_are_found_wherever_they_stand() {
        let text = r#"{"buffers":[{"uri":"b\u002ebin"},{"uri":"data:,x"},{"byteLength":1}],
            "extras":{"uri":"no"},"images":[{"uri":"t/a.png"},{"uri":"t/a.png"},{"uri":"a.png"}],
            "extensions":{"X":{"lights":[{"uri":"l.ies","n":[1.5,-1,null,true]}]}},"uri":[1e999],
            "x":{"extras":[[{"uri":"no"}]],"y":"\"uri\":\"no\"","uri" : "c d"}}"#;
        assert_eq!(uris(text), ["b.bin", "t/a.png", "a.png", "l.ies", "c d"]);
    }
}
