//! Valid names for a header.

use std::collections::HashMap;

use foldhash::fast::RandomState;

/// The names of an element that is being declared, each used only once.
#[derive(Default)]
pub(super) struct Names {
    /// Each name with the number last appended to it, so that thousands of equal names are made
    /// unique in one pass.
    taken: HashMap<String, u64, RandomState>,
}

impl Names {
    /// Prevents these names from being assigned.
    pub(super) fn reserve(&mut self, names: &[&str]) {
        let names = names.iter().map(|&name| (name.to_owned(), 1));
        self.taken.extend(names);
    }

    /// Returns a name that every reader accepts, as close to the wanted one as possible.
    pub(super) fn give(&mut self, wanted: &str) -> String {
        // Truncate names that are far longer than any reader supports.
        const LONGEST: usize = 200;
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        let mut name: String = wanted
            .chars()
            .take(LONGEST)
            .map(|c| if is_word(c) { c } else { '_' })
            .collect();
        if !name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
            name.insert(0, '_');
        }
        let mut given = name.clone();
        if let Some(&last) = self.taken.get(&name) {
            let mut number = last;
            while self.taken.contains_key(&given) {
                number += 1;
                given = format!("{name}_{number}");
            }
            self.taken.insert(name, number);
        }
        self.taken.insert(given.clone(), 1);
        given
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ply::header::is_plain_name;

    #[test]
    fn names_are_words_and_given_once() {
        let mut names = Names::default();
        names.reserve(&["x"]);
        let wanted = [
            "x",
            "",
            "a b\n",
            "9",
            "\u{e9}t\u{e9}",
            "a_b_",
            "x_2",
            "ok-1",
        ];
        let given = wanted.map(|name| names.give(name));
        let expected = ["x_2", "_", "a_b_", "_9", "_t_", "a_b__2", "x_2_2", "ok-1"];
        assert_eq!(given, expected);
        assert!(given.iter().all(|name| is_plain_name(name)));
        assert!(is_plain_name(&names.give(&"\u{1}".repeat(100_000))));
    }
}
