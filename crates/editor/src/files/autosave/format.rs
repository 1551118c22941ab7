//! The file format of an autosave.
//!
//! ```text
//! magic "COTANSAV" | version u32 | header length u64 | number of positions u64
//! header: JSON | positions: 3 × f64 each | checksum u64 of everything before
//! ```
//!
//! Numbers are little-endian. A reader trusts no length until the length of the file confirms it.

use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use cotan_tool::handles_file::{Group, GroupMotion, from_json, to_json};
use nalgebra::Point3;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use serde_json::value::RawValue;

use crate::files::Fingerprint;

/// The contents of an autosave.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The file of the mesh.
    pub mesh: &'a Path,
    /// The fingerprint of the file when it was read.
    pub fingerprint: Fingerprint,
    /// The handles, with the vertex indices of the document.
    ///
    /// Handles without vertices or with numbers that are not finite are left out.
    pub groups: &'a [Group],
    /// Any further state of the editor.
    pub state: &'a Value,
    /// The positions of the surface, in the vertex order of the processing mesh.
    pub positions: &'a [Point3<f64>],
}

/// The contents of an autosave, read back.
#[derive(Clone, PartialEq, Debug)]
pub struct Recovered {
    /// The handles, with the vertex indices of the document.
    pub groups: Vec<Group>,
    /// The further state of the editor.
    pub state: Value,
    /// The positions of the surface, bit for bit.
    pub positions: Vec<Point3<f64>>,
}

/// The information shown about an autosave before it is fully read.
pub(super) struct Summary {
    pub(super) mesh: PathBuf,
    pub(super) fingerprint: Fingerprint,
    pub(super) saved: SystemTime,
    pub(super) num_positions: u64,
}

/// The reason why bytes are not a valid autosave.
#[derive(Debug)]
pub(super) enum FormatError {
    Read(io::Error),
    Corrupt(String),
}

impl From<io::Error> for FormatError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => corrupt("it was cut short"),
            _ => Self::Read(error),
        }
    }
}

fn corrupt(problem: impl Into<String>) -> FormatError {
    FormatError::Corrupt(problem.into())
}

/// The header.
///
/// Parts needed only for restoring stay text until then, so that listing autosaves takes no more
/// memory than their headers.
#[derive(Serialize, Deserialize)]
struct Header {
    mesh: String,
    /// The bytes of the path, if it is not Unicode.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mesh_bytes: Option<Vec<u8>>,
    fingerprint: Fingerprint,
    /// Milliseconds since 1970.
    saved: u64,
    groups: Box<RawValue>,
    state: Box<RawValue>,
}

const MAGIC: [u8; 8] = *b"COTANSAV";
const VERSION: u32 = 1;
/// Length of the magic, the version and the two lengths.
const START: u64 = 8 + 4 + 8 + 8;
const CHECKSUM: u64 = 8;
const POSITION: u64 = 3 * 8;
/// The longest header: 128 MiB, room for ten million handle vertices.
///
/// Parsing JSON takes up to sixteen times as much memory, and a forged file must not trigger
/// more.
const MOST_HEADER: u64 = 128 << 20;

/// Writes a record with the current time.
pub(super) fn encode(record: &Record<'_>, to: impl Write) -> io::Result<()> {
    let raw = |text: String| RawValue::from_string(text).map_err(io::Error::other);
    // A file of handles cannot store NaN; one bad handle must not lose the others.
    let sound: Vec<Group> = record.groups.iter().filter(is_finite).cloned().collect();
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let header = Header {
        mesh: record.mesh.to_string_lossy().into_owned(),
        mesh_bytes: not_unicode(record.mesh),
        fingerprint: record.fingerprint,
        saved: since.map_or(0, |since| u64::try_from(since.as_millis()).unwrap_or(0)),
        groups: raw(to_json(&sound))?,
        state: raw(serde_json::to_string(record.state)?)?,
    };
    let header = serde_json::to_vec(&header)?;
    if header.len() as u64 > MOST_HEADER {
        return Err(io::ErrorKind::FileTooLarge.into());
    }
    let mut to = Summed::new(to);
    to.write_all(&MAGIC)?;
    to.write_all(&VERSION.to_le_bytes())?;
    to.write_all(&(header.len() as u64).to_le_bytes())?;
    to.write_all(&(record.positions.len() as u64).to_le_bytes())?;
    to.write_all(&header)?;
    let mut bytes = Vec::with_capacity(CHUNK);
    for chunk in record.positions.chunks(CHUNK / POSITION as usize) {
        bytes.clear();
        let numbers = chunk.iter().flat_map(|p| [p.x, p.y, p.z]);
        bytes.extend(numbers.flat_map(f64::to_le_bytes));
        to.write_all(&bytes)?;
    }
    let sum = to.sum;
    to.inner.write_all(&sum.to_le_bytes())?;
    to.inner.flush()
}

fn is_finite(group: &&Group) -> bool {
    let is_finite = match &group.motion {
        GroupMotion::Fixed => true,
        GroupMotion::Matrix(matrix) => matrix.iter().all(|x| x.is_finite()),
        GroupMotion::To(points) => points.iter().flat_map(|p| p.iter()).all(|x| x.is_finite()),
    };
    is_finite && group.weight.is_none_or(f64::is_finite)
}

/// Reads only the header and checks the rest. `length` is that of the file.
pub(super) fn summary(from: impl Read, length: u64) -> Result<Summary, FormatError> {
    let mut from = Summed::new(from);
    let (header, num_positions) = start(&mut from, length)?;
    let mut rest = num_positions * POSITION;
    let mut chunk = vec![0; CHUNK];
    while rest > 0 {
        let part = &mut chunk[..usize::try_from(rest).unwrap_or(CHUNK).min(CHUNK)];
        from.read_exact(part)?;
        rest -= part.len() as u64;
    }
    end(from)?;
    Ok(Summary {
        mesh: header.mesh(),
        fingerprint: header.fingerprint,
        saved: UNIX_EPOCH
            .checked_add(Duration::from_millis(header.saved))
            .unwrap_or(UNIX_EPOCH),
        num_positions,
    })
}

/// Reads the whole file. `length` is that of the file.
pub(super) fn decode(from: impl Read, length: u64) -> Result<Recovered, FormatError> {
    let mut from = Summed::new(from);
    let (header, num_positions) = start(&mut from, length)?;
    let too_large = |_| corrupt("there is not enough memory for it");
    let mut positions = Vec::new();
    // `start` has checked that the file is at least this long.
    let count = usize::try_from(num_positions).unwrap_or(usize::MAX);
    positions.try_reserve_exact(count).map_err(too_large)?;
    let mut bytes = [0; POSITION as usize];
    for _ in 0..num_positions {
        from.read_exact(&mut bytes)?;
        let number = |k: usize| {
            let mut number = [0; 8];
            number.copy_from_slice(&bytes[8 * k..8 * k + 8]);
            f64::from_le_bytes(number)
        };
        positions.push(Point3::new(number(0), number(1), number(2)));
    }
    end(from)?;
    let groups = from_json(header.groups.get()).map_err(|e| corrupt(e.to_string()))?;
    let state = serde_json::from_str(header.state.get()).map_err(|e| corrupt(e.to_string()))?;
    Ok(Recovered {
        groups,
        state,
        positions,
    })
}

fn start(from: &mut Summed<impl Read>, length: u64) -> Result<(Header, u64), FormatError> {
    let mut magic = [0; 8];
    from.read_exact(&mut magic)?;
    let mut version = [0; 4];
    from.read_exact(&mut version)?;
    if magic != MAGIC {
        return Err(corrupt("it is no autosave"));
    }
    let version = u32::from_le_bytes(version);
    if version != VERSION {
        return Err(corrupt(format!(
            "it is of version {version}, not {VERSION}"
        )));
    }
    let mut count = || -> Result<u64, FormatError> {
        let mut count = [0; 8];
        from.read_exact(&mut count)?;
        Ok(u64::from_le_bytes(count))
    };
    let (header_length, num_positions) = (count()?, count()?);
    let expected = num_positions
        .checked_mul(POSITION)
        .and_then(|bytes| bytes.checked_add(header_length))
        .and_then(|bytes| bytes.checked_add(START + CHECKSUM));
    if expected != Some(length) {
        return Err(corrupt("its lengths do not add up; it was cut short"));
    }
    if header_length > MOST_HEADER {
        return Err(corrupt("its header is larger than 128 MiB"));
    }
    let mut header = Vec::new();
    let room = usize::try_from(header_length).unwrap_or(usize::MAX);
    header
        .try_reserve_exact(room)
        .map_err(|_| corrupt("there is not enough memory for it"))?;
    from.by_ref().take(header_length).read_to_end(&mut header)?;
    let header = serde_json::from_slice(&header).map_err(|e| corrupt(e.to_string()))?;
    Ok((header, num_positions))
}

fn end(from: Summed<impl Read>) -> Result<(), FormatError> {
    let Summed { mut inner, sum } = from;
    let mut stored = [0; CHECKSUM as usize];
    inner.read_exact(&mut stored)?;
    match u64::from_le_bytes(stored) == sum {
        true => Ok(()),
        false => Err(corrupt("its checksum is wrong")),
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

const CHUNK: usize = 1 << 16;

/// A stream that computes a checksum of its bytes: 64-bit FNV-1a.
///
/// It detects every change of a single byte, and other changes except for one in 2^64. It guards
/// against accidents, not against forgery.
struct Summed<S> {
    inner: S,
    sum: u64,
}

impl<S> Summed<S> {
    fn new(inner: S) -> Self {
        Self {
            inner,
            sum: 0xcbf2_9ce4_8422_2325,
        }
    }

    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.sum = (self.sum ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

impl<R: Read> Read for Summed<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.add(&buffer[..count]);
        Ok(count)
    }
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.inner.write(bytes)?;
        self.add(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.inner.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(positions: &[Point3<f64>]) -> Vec<u8> {
        let file = tempfile::NamedTempFile::new().unwrap();
        let group = Group {
            vertices: vec![0, 2],
            motion: GroupMotion::To(vec![Point3::new(0.1, -0.0, 5e-324); 2]),
            weight: Some(0.3),
            turn: None,
        };
        let bad = Group {
            weight: Some(f64::NAN),
            turn: None,
            ..group.clone()
        };
        let record = Record {
            mesh: Path::new("/a/b c.obj"),
            fingerprint: Fingerprint::of(file.path()).unwrap(),
            groups: &[bad, group],
            state: &serde_json::json!({"camera": [0.1, 2, "x"]}),
            positions,
        };
        let mut bytes = Vec::new();
        encode(&record, &mut bytes).unwrap();
        bytes
    }

    fn points() -> Vec<Point3<f64>> {
        let number = |k: u64| f64::from_bits(k.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let point = |k: u64| Point3::new(number(3 * k), number(3 * k + 1), number(3 * k + 2));
        (0..50).map(point).collect()
    }

    #[test]
    fn every_bit_comes_back() {
        for points in [points(), Vec::new()] {
            let bytes = encoded(&points);
            let recovered = decode(bytes.as_slice(), bytes.len() as u64).unwrap();
            let bits = |points: &[Point3<f64>]| -> Vec<u64> {
                let numbers = points.iter().flat_map(|p| [p.x, p.y, p.z]);
                numbers.map(f64::to_bits).collect()
            };
            assert_eq!(bits(&recovered.positions), bits(&points));
            assert_eq!(recovered.state["camera"][0], 0.1);
            assert_eq!(recovered.groups[0].weight, Some(0.3));
            let summary = summary(bytes.as_slice(), bytes.len() as u64).unwrap();
            assert_eq!(summary.num_positions, points.len() as u64);
            assert_eq!(summary.mesh, Path::new("/a/b c.obj"));
        }
    }

    fn is_refused(bytes: &[u8]) -> bool {
        let length = bytes.len() as u64;
        let [listed, read] = [
            summary(bytes, length).map(|_| ()),
            decode(bytes, length).map(|_| ()),
        ];
        let corrupt = |result| matches!(result, Err(FormatError::Corrupt(_)));
        corrupt(listed) && corrupt(read)
    }

    #[test]
    fn a_truncated_file_is_refused_wherever_it_ends() {
        let bytes = encoded(&points());
        for end in 0..bytes.len() {
            assert!(is_refused(&bytes[..end]), "{end}");
            // Also if the file has shrunk since its length was queried.
            assert!(decode(&bytes[..end], bytes.len() as u64).is_err(), "{end}");
        }
        let longer = [bytes.as_slice(), &[0]].concat();
        assert!(is_refused(&longer));
    }

    #[test]
    fn a_changed_byte_is_noticed_wherever_it_is() {
        let bytes = encoded(&points());
        for place in 0..bytes.len() {
            for flip in [1, 0x80, 0xff] {
                let mut changed = bytes.clone();
                changed[place] ^= flip;
                assert!(is_refused(&changed), "{place}");
            }
        }
    }

    #[test]
    fn promised_lengths_reserve_nothing() {
        let mut bytes = encoded(&points());
        for lengths in [
            [u64::MAX, 0],
            [0, u64::MAX],
            [u64::MAX, u64::MAX],
            [1 << 60, 1 << 40],
        ] {
            bytes[12..20].copy_from_slice(&lengths[0].to_le_bytes());
            bytes[20..28].copy_from_slice(&lengths[1].to_le_bytes());
            assert!(is_refused(&bytes));
        }
        // Lengths that wrap around to the true one.
        let wrapped = (u64::MAX / POSITION + 1).wrapping_mul(POSITION);
        let rest = bytes.len() as u64 - START - CHECKSUM;
        bytes[12..20].copy_from_slice(&rest.wrapping_sub(wrapped).to_le_bytes());
        bytes[20..28].copy_from_slice(&(u64::MAX / POSITION + 1).to_le_bytes());
        assert!(is_refused(&bytes));
    }

    #[test]
    fn a_forged_file_ends_in_a_record_or_a_refusal() {
        let bytes = encoded(&points());
        let length = u64::from_le_bytes(bytes[12..20].try_into().unwrap());
        let header = &bytes[START as usize..(START + length) as usize];
        let header = String::from_utf8(header.to_vec()).unwrap();
        let mut num_read = 0;
        for (from, to) in [
            ("", ""),
            ("[0,2]", "[0]"),
            ("[0,2]", "[0,-2]"),
            ("[0,2]", "[0,18446744073709551616]"),
            ("[0,2]", "[0,18446744073709551615]"),
            ("0.3", "1e999"),
            ("0.3", "-1"),
            ("{\"camera\"", "{\"a\":[[[[[[]]]]]],\"camera\""),
            ("\"fingerprint\"", "\"f\""),
            ("\"saved\":", "\"saved\":18446744073709551615,\"x\":"),
            ("/a/b c.obj", "\\u0000"),
        ] {
            let forged = header.replace(from, to);
            assert!(from.is_empty() || forged != header, "{from}");
            let forged = if from.is_empty() {
                header.clone()
            } else {
                forged
            };
            let mut whole = bytes[..START as usize].to_vec();
            whole[12..20].copy_from_slice(&(forged.len() as u64).to_le_bytes());
            whole.extend(forged.as_bytes());
            whole.extend(&bytes[START as usize + header.len()..bytes.len() - 8]);
            let mut summed = Summed::new(io::sink());
            summed.write_all(&whole).unwrap();
            whole.extend(summed.sum.to_le_bytes());
            let length = whole.len() as u64;
            let is_listed = summary(whole.as_slice(), length).is_ok();
            let is_read = decode(whole.as_slice(), length).is_ok();
            assert!(is_listed || !is_read, "{to}");
            num_read += usize::from(is_read);
        }
        // The five: unchanged, a large index, more state, another time, another path. Whether
        // they fit the mesh is up to `Recovered::check`.
        assert_eq!(num_read, 5);
    }

    #[cfg(unix)]
    #[test]
    fn a_path_that_is_no_text_comes_back() {
        use std::os::unix::ffi::OsStrExt;
        let path = Path::new(std::ffi::OsStr::from_bytes(b"/a/\xff.obj"));
        let record = Record {
            mesh: path,
            fingerprint: Fingerprint::of(Path::new("/")).unwrap(),
            groups: &[],
            state: &Value::Null,
            positions: &[],
        };
        let mut bytes = Vec::new();
        encode(&record, &mut bytes).unwrap();
        let summary = summary(bytes.as_slice(), bytes.len() as u64).unwrap();
        assert_eq!(summary.mesh, path);
    }
}
