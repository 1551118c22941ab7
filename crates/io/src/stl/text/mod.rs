//! Text STL: words separated by whitespace, 21 of them per facet.
//!
//! Keywords are case-insensitive and lines may end anywhere, except that the name of a solid is
//! the rest of its line. A normal may be a non-number (`nan`, `-1.#IND`).

mod gather;
mod scan;
mod words;

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Point3;

use super::soup::Soup;
use crate::attributes::{Attributes, LabelKind, Labels, NONE, NORMAL, Property, Values};
use crate::error::IoError;
use crate::format::Format;
use crate::limits::Limits;
use crate::number;
use crate::remap::Remap;
use crate::source::{Mesh, Moves, Reading, SourceFile, TextPatch};
use crate::text as lines;
use scan::{Layout, coordinate, normal_number, scan};
use words::{Word, Words};

/// Approximate size in bytes of a facet as programs write it.
const USUAL_FACET: usize = 250;

/// Size of the window searched for the first facet or the end of a file, to detect its format.
const WINDOW: usize = 1 << 16;

/// Returns `true` if a text starts like an STL: `solid`, a name, and facets or the end.
pub(in crate::stl) fn is_text(bytes: &[u8]) -> bool {
    let window = &bytes[..bytes.len().min(WINDOW)];
    let mut words = Words::new(window, lines::after_bom(window));
    let Some(first) = words.next() else {
        return false;
    };
    if !first.is("solid") {
        return false;
    }
    words.solid_name();
    words.next().is_some_and(|word| {
        ["facet", "endsolid", "solid"]
            .iter()
            .any(|keyword| word.is(keyword))
    })
}

/// Returns `true` if a file known to be an STL can only be text: a binary header without a zero
/// byte has a facet count of at least 2^24.
pub(in crate::stl) fn starts_as_text(bytes: &[u8]) -> bool {
    let window = &bytes[..bytes.len().min(super::binary::HEADER)];
    let first = Words::new(window, lines::after_bom(window)).next();
    first.is_some_and(|word| word.is("solid")) && !window.contains(&0)
}

pub(in crate::stl) fn read(bytes: Vec<u8>, limits: &Limits) -> Result<Reading, IoError> {
    let mut soup = Soup::new(limits, bytes.len(), bytes.len() / USUAL_FACET);
    let layout = scan(&bytes, limits, |layout, corners| {
        let held = layout.num_bytes();
        soup.set_held(bytes.len().saturating_add(held));
        let mut positions = [([0; 3], Point3::origin()); 3];
        for (corner, words) in positions.iter_mut().zip(corners) {
            let mut position = Point3::origin();
            for (x, word) in position.iter_mut().zip(words) {
                *x = coordinate(&bytes, word, layout.facets.len(), soup.next_vertex())?;
            }
            // Negative and positive zero are the same position.
            let place = position.coords.map(|x| (x + 0.0).to_bits()).into();
            *corner = (place, position);
        }
        soup.facet(positions)
    })?;
    Ok(Reading::new(
        soup.finish(Vec::new()),
        TextStl { bytes, layout },
    ))
}

/// A text STL as it was read.
#[derive(Debug)]
struct TextStl {
    bytes: Vec<u8>,
    layout: Layout,
}

/// Indices of the numbers of a facet among its words.
const NORMAL_AT: usize = 2;
const CORNER_AT: [usize; 3] = [8, 12, 16];
/// Number of words per facet.
const NUM_WORDS: usize = 21;

impl TextStl {
    /// The words of a facet, which were checked when the file was read.
    fn words(&self, facet: usize) -> [Word<'_>; NUM_WORDS] {
        let start = self.layout.facets.get(facet).copied();
        let mut words = Words::new(&self.bytes, start.unwrap_or(self.bytes.len()));
        std::array::from_fn(|_| words.next().unwrap_or_default())
    }

    fn normal(&self, facet: usize) -> [f64; 3] {
        let words = self.words(facet);
        [0, 1, 2].map(|k| normal_number(words[NORMAL_AT + k].text).unwrap_or(f64::NAN))
    }

    /// The solid of each facet, and the solids' names, each once.
    fn labels(&self) -> Option<Labels> {
        let solids = &self.layout.solids;
        let mut numbers: HashMap<&[u8], u32> = HashMap::new();
        let mut names = Vec::new();
        let mut faces = Vec::new();
        for solid in solids.iter().filter(|solid| !solid.facets.is_empty()) {
            let name = &self.bytes[solid.name.clone()];
            let number = if name.is_empty() {
                NONE
            } else {
                *numbers.entry(name).or_insert_with(|| {
                    names.push(crate::text::decode(name));
                    names.len() as u32 - 1
                })
            };
            faces.resize(solid.facets.end, number);
        }
        (!names.is_empty()).then_some(Labels {
            kind: LabelKind::Object,
            names,
            faces,
        })
    }
}

impl SourceFile for TextStl {
    fn format(&self) -> Format {
        Format::Stl
    }

    fn num_bytes(&self) -> usize {
        self.bytes.len()
    }

    fn attributes(&self, _mesh: Mesh<'_>) -> Result<Attributes, IoError> {
        let mut faces = Vec::new();
        if self.layout.has_normals {
            let facets = 0..self.layout.facets.len();
            faces.push(Property {
                name: NORMAL.to_owned(),
                components: 3,
                values: Values::F64(facets.flat_map(|facet| self.normal(facet)).collect()),
            });
        }
        Ok(Attributes {
            faces,
            labels: self.labels().into_iter().collect(),
            ..Attributes::default()
        })
    }

    fn has_normals(&self) -> bool {
        self.layout.has_normals
    }

    fn extras(&self) -> Vec<String> {
        Vec::new()
    }

    fn write(&self, _format: Format, moves: &Moves<'_>) -> Result<Vec<u8>, IoError> {
        if moves.moved.is_empty() {
            return Ok(self.bytes.clone());
        }
        let mut patch = TextPatch::new(&self.bytes);
        let mut normals = moves.normals.faces.iter().peekable();
        for (facet, polygon) in moves.mesh.faces.iter().enumerate() {
            let normal = normals.next_if(|(face, _)| *face as usize == facet);
            let is_moved = |v: u32| moves.moved[v as usize];
            if normal.is_none() && !polygon.iter().any(|&v| is_moved(v)) {
                continue;
            }
            let words = self.words(facet);
            let mut replace = |at: usize, numbers: [f64; 3]| {
                for (word, x) in words[at..].iter().zip(numbers) {
                    // A number whose value is unchanged keeps its digits.
                    if number::parse_f64(word.text) == Some(x) {
                        continue;
                    }
                    patch.replace(word.start, word.text.len(), |out| {
                        number::push_f64(out, x);
                    });
                }
            };
            if let Some(&(_, normal)) = normal {
                replace(NORMAL_AT, normal);
            }
            for (at, &v) in CORNER_AT.into_iter().zip(polygon) {
                if is_moved(v) {
                    replace(at, moves.mesh.positions[v as usize].coords.into());
                }
            }
        }
        Ok(patch.finish())
    }

    fn rebuild(&self, remap: &Remap, mesh: Mesh<'_>) -> Result<Arc<dyn SourceFile>, IoError> {
        let bytes = gather::gather(self, remap, mesh)?;
        let layout = scan(&bytes, &Limits::NONE, |_, _| Ok(()))?;
        Ok(Arc::new(Self { bytes, layout }))
    }
}
