//! The files that were opened or saved last, newest first.

use std::path::{Path, PathBuf};

use cotan_io::{read_regular, replace_file};

/// The files that were opened or saved last, newest first.
///
/// They are kept as a JSON list next to the folder of the autosaves. A damaged list is replaced by
/// the next one.
#[derive(Clone, Debug, Default)]
pub struct Recent {
    /// The file that holds the list; `None` if nothing is kept.
    list: Option<PathBuf>,
    files: Vec<PathBuf>,
}

impl Recent {
    /// Reads the list that belongs to a folder of autosaves.
    pub(crate) fn load(folder: &Path) -> Self {
        let list = folder.with_file_name("recent.json");
        let read = read_regular(&list, MOST_BYTES).ok();
        let files = read.and_then(|bytes| serde_json::from_slice::<Vec<PathBuf>>(&bytes).ok());
        let mut files = files.unwrap_or_default();
        files.truncate(MOST_FILES);
        Self {
            list: Some(list),
            files,
        }
    }

    /// The files, newest first.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// Puts a file first.
    ///
    /// # Errors
    /// The error of the system if the list cannot be written.
    pub(crate) fn note(&mut self, path: &Path) -> std::io::Result<()> {
        let path = std::path::absolute(path)?;
        self.files.retain(|known| *known != path);
        self.files.insert(0, path);
        self.files.truncate(MOST_FILES);
        let Some(list) = &self.list else {
            return Ok(());
        };
        if let Some(folder) = list.parent() {
            std::fs::create_dir_all(folder)?;
        }
        // JSON has no form for a path that is not Unicode.
        let named: Vec<&str> = self.files.iter().filter_map(|p| p.to_str()).collect();
        let bytes = serde_json::to_vec(&named)?;
        replace_file(list, &bytes)
    }
}

/// The largest number of files in the list.
const MOST_FILES: usize = 10;

/// A list of ten paths is shorter.
const MOST_BYTES: u64 = 1 << 20;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_files_come_first_and_are_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let autosaves = folder.path().join("autosaves");
        let mut recent = Recent::load(&autosaves);
        assert!(recent.files().is_empty());
        let path = |k: usize| folder.path().join(format!("{k}.obj"));
        for k in [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 5] {
            recent.note(&path(k)).unwrap();
        }
        let expected: Vec<PathBuf> = [5, 11, 10, 9, 8, 7, 6, 4, 3, 2].map(path).into();
        assert_eq!(recent.files(), expected);
        assert_eq!(Recent::load(&autosaves).files(), expected);
        std::fs::write(folder.path().join("recent.json"), "[1,").unwrap();
        assert!(Recent::load(&autosaves).files().is_empty());
    }
}
