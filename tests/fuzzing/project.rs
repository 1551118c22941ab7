//! Projects of the editor.

use std::path::Path;

use cotan_io::Limits;
use cotan_workspace::files::{Fingerprint, project_bytes, read_project};

/// A project is refused in one sentence, or it is written and read again as it was.
pub fn project(data: &[u8]) {
    let path = Path::new("fuzz.cotan");
    let limits = Limits {
        max_bytes: MOST_BYTES,
        ..Limits::default()
    };
    let read = |bytes: &[u8]| read_project(path, bytes, Fingerprint::default(), &limits);
    let model = match read(data) {
        Ok(model) => model,
        Err(error) => {
            let text = error.to_string();
            assert_eq!(text.lines().count(), 1, "{text}");
            return;
        }
    };
    let Ok(bytes) = project_bytes(&model) else {
        return;
    };
    if bytes.len() as u64 > MOST_BYTES {
        return;
    }
    let again = read(&bytes).unwrap_or_else(|error| panic!("our own project: {error}"));
    assert_eq!(again.scene(), model.scene());
    let same = project_bytes(&again).unwrap_or_else(|error| panic!("{error}"));
    assert!(same == bytes, "the same model gives other bytes");
}

/// 4 MiB.
const MOST_BYTES: u64 = 4 << 20;
