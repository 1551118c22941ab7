//! The file format of an autosave.
//!
//! Each line is a checksum, a space and JSON. The first line says of which mesh the file is, the
//! second holds a scene, and every further line a command that was carried out after it. A process
//! that ends while it writes leaves at most one broken line, the last.

use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::command::Command;
use crate::files::Fingerprint;
use crate::record::SceneRecord;

/// The first bytes of an autosave.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The file of the mesh.
    pub mesh: &'a Path,
    /// The fingerprint of the file when it was read.
    pub fingerprint: Fingerprint,
    /// `true` if the file is the user's.
    pub has_file: bool,
    /// `true` if the mesh was opened repaired.
    pub is_repaired: bool,
    /// The scene from which the commands start.
    pub scene: &'a SceneRecord,
}

/// The contents of an autosave, read back.
#[derive(Clone, PartialEq, Debug)]
pub struct Recovered {
    /// `true` if the file of the mesh is the user's.
    pub has_file: bool,
    /// `true` if the mesh was opened repaired.
    pub is_repaired: bool,
    /// The scene from which the commands start.
    pub scene: SceneRecord,
    /// The commands, in their order.
    pub commands: Vec<Command>,
    /// `true` if there is a broken line behind the commands.
    pub is_cut: bool,
}

/// The information shown about an autosave before it is fully read.
pub(super) struct Summary {
    pub(super) mesh: PathBuf,
    pub(super) fingerprint: Fingerprint,
    pub(super) saved: SystemTime,
    pub(super) has_file: bool,
}

/// The reason why bytes are not a valid autosave.
#[derive(Debug)]
pub(super) enum FormatError {
    Read(io::Error),
    Corrupt(String),
}

impl From<io::Error> for FormatError {
    fn from(error: io::Error) -> Self {
        Self::Read(error)
    }
}

fn corrupt(problem: impl Into<String>) -> FormatError {
    FormatError::Corrupt(problem.into())
}

/// The first line.
#[derive(Serialize, Deserialize)]
struct Header {
    /// Tells an autosave from other files.
    cotan_autosave: u32,
    mesh: String,
    /// The bytes of the path, if it is not Unicode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mesh_bytes: Option<Vec<u8>>,
    fingerprint: Fingerprint,
    /// Milliseconds since 1970.
    saved: u64,
    has_file: bool,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    is_repaired: bool,
}

const VERSION: u32 = 2;

/// The longest first line: paths are shorter.
const MOST_HEADER: u64 = 1 << 16;

/// The bytes with which an autosave begins, with the current time.
pub(super) fn begin(record: &Record<'_>) -> io::Result<Vec<u8>> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let header = Header {
        cotan_autosave: VERSION,
        mesh: record.mesh.to_string_lossy().into_owned(),
        mesh_bytes: not_unicode(record.mesh),
        fingerprint: record.fingerprint,
        saved: since.map_or(0, |since| u64::try_from(since.as_millis()).unwrap_or(0)),
        has_file: record.has_file,
        is_repaired: record.is_repaired,
    };
    let mut bytes = line(&header)?;
    bytes.extend(line(record.scene)?);
    Ok(bytes)
}

/// A command as a line.
pub(super) fn command(command: &Command) -> io::Result<Vec<u8>> {
    line(command)
}

fn line(value: &impl Serialize) -> io::Result<Vec<u8>> {
    let json = serde_json::to_vec(value)?;
    let mut line = format!("{:08x} ", checksum(&json)).into_bytes();
    line.extend(json);
    line.push(b'\n');
    Ok(line)
}

fn checksum(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// Reads the value of a line, without its end; `None` if it is broken.
fn value<T: DeserializeOwned>(line: &[u8]) -> Option<T> {
    let (sum, json) = line.split_at_checked(9)?;
    let sum = std::str::from_utf8(sum).ok()?.strip_suffix(' ')?;
    let sum = u32::from_str_radix(sum, 16).ok()?;
    (sum == checksum(json)).then(|| serde_json::from_slice(json).ok())?
}

/// Reads only the first line, and checks that there is a second.
pub(super) fn summary(from: impl Read) -> Result<Summary, FormatError> {
    let mut from = BufReader::new(from);
    let header = header(&mut from)?;
    let mut scene = Vec::new();
    from.read_until(b'\n', &mut scene)?;
    if scene.pop() != Some(b'\n') || value::<serde::de::IgnoredAny>(&scene).is_none() {
        return Err(corrupt("it was cut short"));
    }
    Ok(Summary {
        mesh: header.mesh(),
        fingerprint: header.fingerprint,
        saved: UNIX_EPOCH
            .checked_add(Duration::from_millis(header.saved))
            .unwrap_or(UNIX_EPOCH),
        has_file: header.has_file,
    })
}

/// Reads the whole file.
pub(super) fn decode(from: impl Read) -> Result<Recovered, FormatError> {
    let mut from = BufReader::new(from);
    let header = header(&mut from)?;
    let mut bytes = Vec::new();
    from.read_until(b'\n', &mut bytes)?;
    if bytes.pop() != Some(b'\n') {
        return Err(corrupt("it was cut short"));
    }
    let scene = value(&bytes).ok_or_else(|| corrupt("its scene is damaged"))?;
    let mut commands = Vec::new();
    let is_cut = loop {
        bytes.clear();
        if from.read_until(b'\n', &mut bytes)? == 0 {
            break false;
        }
        let is_whole = bytes.pop() == Some(b'\n');
        match value(&bytes).filter(|_| is_whole) {
            Some(command) => commands.push(command),
            None => break true,
        }
    };
    Ok(Recovered {
        has_file: header.has_file,
        is_repaired: header.is_repaired,
        scene,
        commands,
        is_cut,
    })
}

fn header(from: &mut impl BufRead) -> Result<Header, FormatError> {
    let mut first = Vec::new();
    from.by_ref()
        .take(MOST_HEADER)
        .read_until(b'\n', &mut first)?;
    if first.pop() != Some(b'\n') {
        return Err(corrupt("it is no autosave, or was cut short"));
    }
    let header: Header = value(&first).ok_or_else(|| corrupt("it is no autosave"))?;
    match header.cotan_autosave {
        VERSION => Ok(header),
        version => Err(corrupt(format!(
            "it is of version {version}, not {VERSION}"
        ))),
    }
}

impl Header {
    fn mesh(&self) -> PathBuf {
        #[cfg(unix)]
        if let Some(bytes) = &self.mesh_bytes {
            use std::os::unix::ffi::OsStringExt;
            return std::ffi::OsString::from_vec(bytes.clone()).into();
        }
        PathBuf::from(&self.mesh)
    }
}

/// The bytes of a path that is not Unicode.
fn not_unicode(path: &Path) -> Option<Vec<u8>> {
    match path.to_str() {
        Some(_) => None,
        None => Some(path.as_os_str().as_encoded_bytes().to_vec()),
    }
}
