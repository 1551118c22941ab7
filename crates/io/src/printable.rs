//! Sanitizing of text from files for output on a terminal.
//!
//! Names, attributes, error messages and file names may contain anything. On a terminal, control
//! characters have effects: they set colours and titles, clear the screen, or end a line and
//! start one that looks like our own output. Bidirectional formatting reorders the surrounding
//! text. All of these are turned into visible escapes here, and nowhere else.

use std::borrow::Cow;
use std::fmt::{self, Write as _};

/// Returns the text on one line, with every character that a terminal interprets replaced by an
/// escape: `\n`, `\t`, `\u{1b}`.
///
/// Control characters (C0, DEL and C1), line and paragraph separators, and bidirectional
/// formatting characters are escaped. Joiners and other invisible characters are kept, because
/// scripts and emoji need them.
///
/// ```
/// use cotan_io::printable;
/// assert_eq!(printable("bunny.obj"), "bunny.obj");
/// assert_eq!(printable("a\u{1b}[2Jb\nclosed  yes"), r"a\u{1b}[2Jb\nclosed  yes");
/// ```
pub fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_unprintable) {
        return Cow::Borrowed(text);
    }
    let mut printable = String::with_capacity(text.len() + 8);
    for c in text.chars() {
        if is_unprintable(c) {
            printable.extend(escape(c));
        } else {
            printable.push(c);
        }
    }
    Cow::Owned(printable)
}

/// Displays a value through [`printable`]; for paths and errors in messages.
///
/// ```
/// use cotan_io::Printable;
/// let path = std::path::Path::new("a\rb.obj");
/// assert_eq!(Printable(path.display()).to_string(), r"a\rb.obj");
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Printable<T>(pub T);

impl<T: fmt::Display> fmt::Display for Printable<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        write!(text, "{}", self.0)?;
        f.pad(&printable(&text))
    }
}

/// Returns equivalent JSON whose strings contain no character that a terminal interprets.
///
/// JSON writers already escape C0; the remaining characters are replaced by `\uXXXX` here. They
/// can occur only inside strings, so the result is valid JSON.
pub fn printable_json(json: &str) -> Cow<'_, str> {
    let acts = |c: char| is_unprintable(c) && !matches!(c, '\n' | '\t' | '\r');
    if !json.contains(acts) {
        return Cow::Borrowed(json);
    }
    let mut printable = String::with_capacity(json.len() + 8);
    for c in json.chars() {
        match acts(c) {
            // All of them are in the basic multilingual plane: one UTF-16 unit each.
            true => {
                let _ = write!(printable, "\\u{:04x}", u32::from(c));
            }
            false => printable.push(c),
        }
    }
    Cow::Owned(printable)
}

/// The escape as Rust writes it: a short form for common characters, otherwise the code point.
fn escape(c: char) -> impl Iterator<Item = char> {
    let short = matches!(c, '\n' | '\r' | '\t').then(|| c.escape_default());
    let number = short.is_none().then(|| c.escape_unicode());
    short
        .into_iter()
        .flatten()
        .chain(number.into_iter().flatten())
}

/// Returns `true` if a terminal would interpret the character rather than display it.
fn is_unprintable(c: char) -> bool {
    c.is_control()
        || matches!(
            c,
            // Line and paragraph separators.
            '\u{2028}' | '\u{2029}'
            // Arabic letter mark, left-to-right and right-to-left marks.
            | '\u{61c}' | '\u{200e}' | '\u{200f}'
            // Embeddings, overrides and isolates.
            | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
        )
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn what_a_terminal_acts_on_becomes_visible() {
        assert_eq!(
            printable("\u{1b}]0;title\u{7}\r\n\t\0"),
            r"\u{1b}]0;title\u{7}\r\n\t\u{0}"
        );
        assert_eq!(printable("\u{9b}2J\u{7f}"), r"\u{9b}2J\u{7f}");
        assert_eq!(
            printable("a\u{202e}b\u{2066}c\u{2028}"),
            r"a\u{202e}b\u{2066}c\u{2028}"
        );
    }

    #[test]
    fn words_of_all_scripts_stay() {
        for text in [
            "C:\\meshes\\bunny.obj",
            "Hase",
            "ウサギ",
            "خرگوش",
            "👩‍🔬",
            "zero\u{200c}width",
        ] {
            assert!(
                matches!(printable(text), Cow::Borrowed(same) if same == text),
                "{text}"
            );
        }
    }

    proptest! {
        #[test]
        fn nothing_that_acts_is_left(text in any::<String>()) {
            let shown = printable(&text);
            prop_assert!(!shown.contains(is_unprintable));
            prop_assert_eq!(printable(&shown), shown.as_ref());
        }

        #[test]
        fn json_says_the_same(text in any::<String>(), name in "[\u{80}-\u{9f}\u{202a}-\u{202e}\n]{0,5}") {
            let value = serde_json::json!({ "text": text, "name": name });
            let json = serde_json::to_string_pretty(&value).expect("JSON");
            let shown = printable_json(&json);
            prop_assert!(!shown.contains(|c| is_unprintable(c) && c != '\n'));
            prop_assert_eq!(serde_json::from_str::<serde_json::Value>(&shown).expect("JSON"), value);
        }
    }
}
