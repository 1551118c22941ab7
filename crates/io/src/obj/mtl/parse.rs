//! The statements of a material library; those that are invalid or not converted are reported.
//!
//! Statements are known by their keyword in any case; numbers must be finite and complete.

use std::collections::{BTreeMap, BTreeSet};

use super::options::map;
use crate::error::quote;
use crate::obj::statement::{Statement, Statements, decode};
use crate::text;

/// The materials that a library defines.
#[derive(Debug, Default)]
pub(super) struct Definitions {
    pub(super) materials: Vec<Definition>,
    /// The paths of all images, with slashes.
    pub(super) paths: BTreeSet<String>,
    /// The keywords of statements that are not converted.
    pub(super) statements: BTreeSet<String>,
    /// The texture options that are not converted.
    pub(super) options: BTreeSet<&'static str>,
    /// The number of invalid statements, and the line and text of the first one.
    pub(super) num_wrong: usize,
    pub(super) first_wrong: Option<(usize, String)>,
}

/// A material with the arguments of its statements. The last statement of a keyword counts.
#[derive(Debug, Default)]
pub(super) struct Definition {
    pub(super) name: String,
    pub(super) colors: BTreeMap<&'static str, [f32; 3]>,
    pub(super) numbers: BTreeMap<&'static str, f32>,
    /// The paths of textures.
    pub(super) textures: BTreeMap<&'static str, String>,
    /// The illumination model.
    pub(super) model: Option<u8>,
}

/// The way to read a statement.
#[derive(Clone, Copy)]
enum Kind {
    Color,
    Number,
    /// The illumination model.
    Model,
    /// A texture that is converted.
    Texture,
    /// A texture that is not converted.
    OtherTexture,
}

/// The supported statements.
const STATEMENTS: [(&str, Kind); 28] = [
    ("Kd", Kind::Color),
    ("Ke", Kind::Color),
    ("Ns", Kind::Number),
    ("d", Kind::Number),
    ("Tr", Kind::Number),
    ("Pr", Kind::Number),
    ("Pm", Kind::Number),
    ("illum", Kind::Model),
    ("map_Kd", Kind::Texture),
    ("map_Ke", Kind::Texture),
    ("map_d", Kind::Texture),
    ("norm", Kind::Texture),
    ("map_Ka", Kind::OtherTexture),
    ("map_Ks", Kind::OtherTexture),
    ("map_Ns", Kind::OtherTexture),
    ("map_Tr", Kind::OtherTexture),
    ("map_Pr", Kind::OtherTexture),
    ("map_Pm", Kind::OtherTexture),
    ("map_Ps", Kind::OtherTexture),
    ("map_Pc", Kind::OtherTexture),
    ("map_RMA", Kind::OtherTexture),
    ("map_ORM", Kind::OtherTexture),
    ("map_bump", Kind::OtherTexture),
    ("bump", Kind::OtherTexture),
    ("disp", Kind::OtherTexture),
    ("map_disp", Kind::OtherTexture),
    ("decal", Kind::OtherTexture),
    ("refl", Kind::OtherTexture),
];

impl Definitions {
    pub(super) fn new(bytes: &[u8]) -> Self {
        let mut definitions = Self::default();
        for statement in Statements::new(bytes, text::after_bom(bytes), 0) {
            definitions.statement(&statement);
        }
        definitions
    }

    fn statement(&mut self, statement: &Statement<'_>) {
        let keyword = statement.keyword();
        if keyword.is_empty() {
            return;
        }
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            let name = decode(statement.name());
            if name.is_empty() {
                self.wrong(statement);
            }
            self.materials.push(Definition {
                name,
                ..Definition::default()
            });
            return;
        }
        let same = |name: &str| name.as_bytes().eq_ignore_ascii_case(keyword);
        let known = STATEMENTS.iter().find(|(name, _)| same(name));
        let (Some(&(name, kind)), Some(material)) = (known, self.materials.last_mut()) else {
            self.statements.insert(quote(keyword));
            return;
        };
        let done = match kind {
            Kind::Color => color(statement).map(|color| {
                material.colors.insert(name, color);
            }),
            Kind::Number => number(statement).map(|number| {
                material.numbers.insert(name, number);
            }),
            Kind::Model => model(statement).map(|model| material.model = Some(model)),
            Kind::Texture => map(statement.name()).map(|map| {
                // The parts of a name that continues on the next line are joined by spaces.
                let path = map.path.replace(['\n', '\r'], " ");
                material.textures.insert(name, path);
                self.paths.insert(map.path);
                self.options.extend(map.options);
            }),
            Kind::OtherTexture => map(statement.name()).map(|map| {
                self.paths.insert(map.path);
                self.statements.insert(name.to_owned());
            }),
        };
        if done.is_none() {
            self.wrong(statement);
        }
    }

    fn wrong(&mut self, statement: &Statement<'_>) {
        self.num_wrong += 1;
        if self.first_wrong.is_none() {
            let text = quote(statement.text.trim_ascii());
            self.first_wrong = Some((statement.line, text));
        }
    }
}

/// Three finite numbers; a single one stands for all three, as the format defines.
fn color(statement: &Statement<'_>) -> Option<[f32; 3]> {
    let mut numbers = Vec::with_capacity(3);
    for token in statement.arguments().take(3) {
        numbers.push(finite(token.text)?);
    }
    match numbers[..] {
        [x] => Some([x; 3]),
        [x, y, z] => Some([x, y, z]),
        _ => None,
    }
}

/// The first number.
fn number(statement: &Statement<'_>) -> Option<f32> {
    finite(statement.arguments().next()?.text)
}

/// The number of an illumination model.
fn model(statement: &Statement<'_>) -> Option<u8> {
    let text = std::str::from_utf8(statement.arguments().next()?.text).ok()?;
    text.parse().ok()
}

fn finite(text: &[u8]) -> Option<f32> {
    let number: f32 = std::str::from_utf8(text).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}
