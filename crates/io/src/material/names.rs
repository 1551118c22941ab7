//! Unique names of materials and files.

use std::collections::{HashMap, HashSet};

/// Makes names valid and unique by appending numbers to those that are invalid or already in use.
///
/// Two names are the same if their `key` is. The key of an invalid name is `None`; such a name is
/// replaced by `fallback`.
pub(crate) fn unique_names<'a>(
    names: impl Iterator<Item = &'a str>,
    fallback: &str,
    key: impl Fn(&str) -> Option<String>,
) -> Vec<String> {
    let names: Vec<&str> = names.collect();
    // A valid original name takes precedence over generated ones.
    let mut taken: HashSet<String> = names.iter().filter_map(|name| key(name)).collect();
    let mut used: HashSet<String> = HashSet::new();
    // The last number of each base, so that many equal names need no search.
    let mut numbers: HashMap<&str, usize> = HashMap::new();
    let mut unique = Vec::with_capacity(names.len());
    for name in &names {
        let own = key(name);
        let base = if own.is_some() { name } else { fallback };
        if own.is_some_and(|own| used.insert(own)) {
            unique.push((*name).to_owned());
            continue;
        }
        let number = numbers.entry(base).or_insert(0);
        let made = loop {
            *number += 1;
            let made = format!("{base}.{number}");
            // If the key is `None`, further numbers cannot make the name valid.
            if key(&made).is_none_or(|key| taken.insert(key)) {
                break made;
            }
        };
        used.extend(key(&made));
        unique.push(made);
    }
    unique
}

/// Converts a name to a file name that every system and every MTL reader accepts: without spaces,
/// separators and punctuation, and not long; `image` if nothing is left.
pub(crate) fn file_stem(name: &str) -> String {
    const LONGEST: usize = 64;
    let is_plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | '(' | ')' | '+');
    let mut stem = String::new();
    for c in name.chars() {
        // File systems count bytes.
        if stem.len() + c.len_utf8() > LONGEST {
            break;
        }
        stem.push(if is_plain(c) { c } else { '_' });
    }
    // A leading dot hides a file, and a leading dash makes its name look like an option.
    let stem = stem.trim_start_matches(['.', '-']).trim_end_matches('.');
    if stem.is_empty() {
        "image".to_owned()
    } else {
        stem.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_is_there_once_and_valid_ones_stay() {
        let key = |name: &str| (!name.is_empty()).then(|| name.to_lowercase());
        let unique = |names: &[&str]| unique_names(names.iter().copied(), "material", key);
        assert_eq!(unique(&["red", "blue"]), ["red", "blue"]);
        assert_eq!(
            unique(&["red", "", "Red", "red", "red.2", "material.1"]),
            ["red", "material.2", "Red.1", "red.3", "red.2", "material.1"]
        );
        let same = vec!["x"; 500];
        let found: HashSet<String> = unique(&same).into_iter().collect();
        assert_eq!(found.len(), 500);
    }

    #[test]
    fn names_of_files_are_plain() {
        for (name, stem) in [
            ("wood", "wood"),
            ("my wood #2", "my_wood__2"),
            ("../../etc/passwd", "_.._etc_passwd"),
            ("C:\\a", "C__a"),
            ("-s", "s"),
            ("...", "image"),
            ("", "image"),
            ("a\nmap_Kd b", "a_map_Kd_b"),
            ("\u{e9}t\u{e9}", "\u{e9}t\u{e9}"),
        ] {
            assert_eq!(file_stem(name), stem);
        }
        assert_eq!(file_stem(&"x".repeat(1000)).len(), 64);
        assert!(file_stem(&"\u{20000}".repeat(1000)).len() <= 64);
    }
}
