//! Printable text for a terminal.
//!
//! Everything written to standard output or standard error is a [`Text`], whose lines are escaped
//! one by one: a name from a file can neither control the terminal nor start a line of its own.

use std::fmt::Display;

use cotan_io::{Printable, printable_json};
use serde::Serialize;

/// Lines of printable text.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Text(String);

impl Text {
    /// A single line.
    pub(crate) fn of(line: impl Display) -> Self {
        let mut text = Self::default();
        text.line(line);
        text
    }

    /// Adds a line.
    pub(crate) fn line(&mut self, line: impl Display) {
        self.0.push_str(Printable(line).to_string().trim_end());
        self.0.push('\n');
    }

    /// Adds the lines of another text.
    pub(crate) fn append(&mut self, other: &Self) {
        self.0.push_str(&other.0);
    }

    /// A value as indented JSON, with control characters in strings escaped.
    ///
    /// # Errors
    /// Returns the error of the value's serialization.
    pub(crate) fn json(value: &impl Serialize) -> Result<Self, serde_json::Error> {
        let json = serde_json::to_string_pretty(value)?;
        Ok(Self(printable_json(&json).into_owned() + "\n"))
    }

    pub(crate) fn as_str(&self) -> &str {
        &self.0
    }
}
