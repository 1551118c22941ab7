//! Filtering of the MTL statements that tobj's parser can handle; the others are reported.
//!
//! The parser panics on a colour with fewer than three numbers and rejects the whole library for
//! one invalid number. It therefore receives only statements that were checked here: known
//! keywords in their usual case, numbers that are finite and complete, and the index of a
//! material instead of its name, since names may contain anything.

use std::collections::BTreeSet;

use super::options::map;
use crate::error::quote;
use crate::number;
use crate::obj::statement::{Statement, Statements, decode};
use crate::text;

/// A library whose text tobj can parse.
#[derive(Debug, Default)]
pub(super) struct Checked {
    /// The statements for tobj; the name of each material is its index.
    pub(super) text: String,
    /// The names of the materials.
    pub(super) names: Vec<String>,
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

/// The supported statements, in the case that tobj expects.
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

impl Checked {
    pub(super) fn new(bytes: &[u8]) -> Self {
        let mut checked = Self::default();
        for statement in Statements::new(bytes, text::after_bom(bytes), 0) {
            checked.statement(&statement);
        }
        checked
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
            self.push("newmtl", &self.names.len().to_string());
            self.names.push(name);
            return;
        }
        let same = |name: &str| name.as_bytes().eq_ignore_ascii_case(keyword);
        let known = STATEMENTS.iter().find(|(name, _)| same(name));
        let Some(&(name, kind)) = known.filter(|_| !self.names.is_empty()) else {
            self.statements.insert(quote(keyword));
            return;
        };
        let taken = match kind {
            Kind::Color => color(statement),
            Kind::Number => number(statement).map(|x| digits(&[x])),
            Kind::Model => model(statement),
            Kind::Texture | Kind::OtherTexture => {
                let map = map(statement.name());
                map.map(|map| {
                    self.paths.insert(map.path.clone());
                    if matches!(kind, Kind::Texture) {
                        self.options.extend(map.options);
                    }
                    map.path
                })
            }
        };
        match (taken, kind) {
            (Some(_), Kind::OtherTexture) => {
                self.statements.insert(name.to_owned());
            }
            (Some(text), _) => self.push(name, &text),
            (None, _) => self.wrong(statement),
        }
    }

    fn push(&mut self, keyword: &str, text: &str) {
        self.text.push_str(keyword);
        self.text.push(' ');
        // The parts of a name that continues on the next line are joined by spaces.
        self.text.extend(text.chars().map(|c| match c {
            '\n' | '\r' => ' ',
            c => c,
        }));
        self.text.push('\n');
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
fn color(statement: &Statement<'_>) -> Option<String> {
    let mut numbers = Vec::with_capacity(3);
    for token in statement.arguments().take(3) {
        numbers.push(finite(token.text)?);
    }
    match numbers[..] {
        [x] => Some(digits(&[x; 3])),
        [_, _, _] => Some(digits(&numbers)),
        _ => None,
    }
}

/// The first number.
fn number(statement: &Statement<'_>) -> Option<f32> {
    finite(statement.arguments().next()?.text)
}

/// The number of an illumination model.
fn model(statement: &Statement<'_>) -> Option<String> {
    let text = std::str::from_utf8(statement.arguments().next()?.text).ok()?;
    Some(text.parse::<u8>().ok()?.to_string())
}

fn finite(text: &[u8]) -> Option<f32> {
    let number: f32 = std::str::from_utf8(text).ok()?.parse().ok()?;
    number.is_finite().then_some(number)
}

/// Formats numbers with the digits that parse back to the same bits, separated by spaces.
fn digits(numbers: &[f32]) -> String {
    let mut text = String::new();
    for (k, &x) in numbers.iter().enumerate() {
        if k > 0 {
            text.push(' ');
        }
        number::push_f32(&mut text, x);
    }
    text
}
