//! Edits of a JSON text that preserve every other byte.

use std::ops::Range;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue;

use crate::error::IoError;

/// A JSON text with pending edits.
///
/// Spans are byte ranges of the original text.
#[derive(Debug)]
pub(super) struct Editor<'a> {
    text: &'a str,
    /// The replacements by span. Spans do not overlap, and insertions at one position keep their
    /// order.
    edits: Vec<(Range<usize>, String)>,
}

/// The members of an object, in order.
pub(super) type Members = Vec<(String, Range<usize>)>;

impl<'a> Editor<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            text,
            edits: Vec::new(),
        }
    }

    /// The span of the whole text.
    pub(super) fn root(&self) -> Range<usize> {
        0..self.text.len()
    }

    pub(super) fn text(&self, span: &Range<usize>) -> &'a str {
        self.text.get(span.clone()).unwrap_or_default()
    }

    fn span(&self, value: &RawValue) -> Range<usize> {
        // Both point into the text.
        let start = (value.get().as_ptr() as usize).wrapping_sub(self.text.as_ptr() as usize);
        start..start.saturating_add(value.get().len())
    }

    pub(super) fn members(&self, object: &Range<usize>) -> Result<Members, IoError> {
        let members: Object<'a> = parse(self.text(object))?;
        let members = members.0.into_iter();
        Ok(members
            .map(|(key, value)| (key, self.span(value)))
            .collect())
    }

    pub(super) fn elements(&self, array: &Range<usize>) -> Result<Vec<Range<usize>>, IoError> {
        let elements: Vec<&'a RawValue> = parse(self.text(array))?;
        Ok(elements.into_iter().map(|value| self.span(value)).collect())
    }

    /// The elements of an array that is a member of an object; empty if it is missing.
    pub(super) fn list(
        &self,
        object: &Range<usize>,
        key: &str,
    ) -> Result<Vec<Range<usize>>, IoError> {
        let members = self.members(object)?;
        member(&members, key).map_or(Ok(Vec::new()), |array| self.elements(array))
    }

    pub(super) fn replace(&mut self, span: Range<usize>, value: String) {
        if self.text(&span) != value {
            self.edits.push((span, value));
        }
    }

    /// Sets a member of an object.
    pub(super) fn set(
        &mut self,
        object: &Range<usize>,
        key: &str,
        value: String,
    ) -> Result<(), IoError> {
        let members = self.members(object)?;
        match (member(&members, key), members.last()) {
            (Some(span), _) => self.replace(span.clone(), value),
            (None, Some((_, last))) => {
                self.edits
                    .push((last.end..last.end, format!(",\"{key}\":{value}")));
            }
            (None, None) => {
                let at = object.start + 1;
                self.edits.push((at..at, format!("\"{key}\":{value}")));
            }
        }
        Ok(())
    }

    /// Removes members from an object.
    pub(super) fn remove(
        &mut self,
        object: &Range<usize>,
        is_removed: impl Fn(&str) -> bool,
    ) -> Result<(), IoError> {
        let members = self.members(object)?;
        let kept: Vec<bool> = members.iter().map(|(key, _)| !is_removed(key)).collect();
        let values: Vec<_> = members.into_iter().map(|(_, value)| value).collect();
        self.keep(object, &values, &kept);
        Ok(())
    }

    /// Removes elements from an array.
    pub(super) fn remove_elements(
        &mut self,
        array: &Range<usize>,
        is_removed: impl Fn(usize) -> bool,
    ) -> Result<(), IoError> {
        let elements = self.elements(array)?;
        let kept: Vec<bool> = (0..elements.len()).map(|i| !is_removed(i)).collect();
        self.keep(array, &elements, &kept);
        Ok(())
    }

    /// Keeps some values of an object or an array.
    fn keep(&mut self, container: &Range<usize>, values: &[Range<usize>], kept: &[bool]) {
        let mut is_behind_kept = false;
        for (i, value) in values.iter().enumerate() {
            if kept[i] {
                is_behind_kept = true;
                continue;
            }
            let before = i.checked_sub(1).map(|before| values[before].end);
            // The preceding comma is removed with a value if an earlier value is kept, otherwise
            // the following comma, if there is one.
            let span = match before {
                Some(before) if is_behind_kept => before..value.end,
                _ => {
                    let start = before.map_or(container.start + 1, |before| self.comma(before));
                    let is_last = i + 1 == values.len();
                    let end = if is_last {
                        value.end
                    } else {
                        self.comma(value.end)
                    };
                    start..end
                }
            };
            self.edits.push((span, String::new()));
        }
    }

    /// The offset after the next comma.
    fn comma(&self, from: usize) -> usize {
        let rest = self.text.as_bytes().get(from..).unwrap_or(&[]);
        rest.iter()
            .position(|&b| b == b',')
            .map_or(from, |at| from + at + 1)
    }

    /// Appends elements to an array that is a member of an object.
    pub(super) fn append(
        &mut self,
        object: &Range<usize>,
        key: &str,
        elements: &[String],
    ) -> Result<(), IoError> {
        if elements.is_empty() {
            return Ok(());
        }
        let text = elements.join(",");
        let members = self.members(object)?;
        let Some(array) = member(&members, key) else {
            return self.set(object, key, format!("[{text}]"));
        };
        let (at, text) = match self.elements(array)?.last() {
            Some(last) => (last.end, format!(",{text}")),
            None => (array.start + 1, text),
        };
        self.edits.push((at..at, text));
        Ok(())
    }

    /// Returns the text with all edits applied.
    pub(super) fn finish(mut self) -> String {
        // The sort is stable, so insertions at one position keep their order.
        self.edits.sort_by_key(|(span, _)| (span.start, span.end));
        let added: usize = self.edits.iter().map(|(_, text)| text.len()).sum();
        let mut out = String::with_capacity(self.text.len() + added);
        let mut copied = 0;
        for (span, text) in &self.edits {
            out.push_str(self.text.get(copied..span.start).unwrap_or_default());
            out.push_str(text);
            copied = copied.max(span.end);
        }
        out.push_str(self.text.get(copied..).unwrap_or_default());
        out
    }
}

/// The value of a member; the last one if there are several with this name, as in serde.
pub(super) fn member<'a>(members: &'a Members, key: &str) -> Option<&'a Range<usize>> {
    let mut members = members.iter().rev();
    members.find_map(|(name, span)| (name == key).then_some(span))
}

fn parse<'a, T: Deserialize<'a>>(text: &'a str) -> Result<T, IoError> {
    // The text was parsed when the file was read, so this finds only errors in skipped parts.
    serde_json::from_str(text).map_err(|error| IoError::Gltf {
        path: "JSON".to_owned(),
        problem: error.to_string(),
    })
}

struct Object<'a>(Vec<(String, &'a RawValue)>);

impl<'de: 'a, 'a> Deserialize<'de> for Object<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Vec<(String, &'de RawValue)>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    members.push(member);
                }
                Ok(members)
            }
        }
        deserializer.deserialize_map(Pairs).map(Object)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_spans_that_change_are_touched() {
        let text = r#" { "a" : [ 1, {"b" : 2} ] , "c":[],"d":{} }"#;
        let mut editor = Editor::new(text);
        let root = editor.root();
        let list = editor.list(&root, "a").unwrap();
        editor.set(&list[1], "b", "3".to_owned()).unwrap();
        editor.set(&list[1], "x", "4".to_owned()).unwrap();
        editor
            .append(&root, "a", &["5".to_owned(), "6".to_owned()])
            .unwrap();
        editor.append(&root, "c", &["7".to_owned()]).unwrap();
        editor.append(&root, "e", &["8".to_owned()]).unwrap();
        let members = editor.members(&root).unwrap();
        let d = member(&members, "d").unwrap().clone();
        editor.set(&d, "y", "9".to_owned()).unwrap();
        assert_eq!(
            editor.finish(),
            r#" { "a" : [ 1, {"b" : 3,"x":4},5,6 ] , "c":[7],"d":{"y":9},"e":[8] }"#
        );
    }

    #[test]
    fn members_are_removed_with_their_commas() {
        let removed = |text: &str, keys: &[&str]| {
            let mut editor = Editor::new(text);
            let root = editor.root();
            editor.remove(&root, |key| keys.contains(&key)).unwrap();
            editor.finish()
        };
        let text = r#"{"a": 1, "b" : 2 ,"c":3}"#;
        assert_eq!(removed(text, &["a"]), r#"{ "b" : 2 ,"c":3}"#);
        assert_eq!(removed(text, &["b"]), r#"{"a": 1 ,"c":3}"#);
        assert_eq!(removed(text, &["c"]), r#"{"a": 1, "b" : 2}"#);
        assert_eq!(removed(text, &["a", "b"]), r#"{"c":3}"#);
        assert_eq!(removed(text, &["a", "b", "c"]), "{}");
        assert_eq!(removed(text, &["a", "c"]), r#"{ "b" : 2}"#);
    }
}
