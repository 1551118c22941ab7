//! The options of a texture statement (`map_Kd -s 2 2 1 wood.png`) and the path after them.

use crate::obj::statement::decode;
use crate::text::{Token, Tokens};

/// The contents of a texture statement.
pub(super) struct Map {
    /// The path with slashes, otherwise as in the file; not empty.
    pub(super) path: String,
    /// The names of the options that change the appearance of the image.
    pub(super) options: Vec<&'static str>,
}

/// An option, the arguments it takes, and the values that have no effect.
const OPTIONS: [(&str, Arguments); 14] = [
    ("-blendu", Arguments::Word("on")),
    ("-blendv", Arguments::Word("on")),
    ("-cc", Arguments::Word("off")),
    ("-clamp", Arguments::Word("off")),
    ("-type", Arguments::Word("")),
    ("-imfchan", Arguments::Word("")),
    ("-texres", Arguments::Word("")),
    ("-colorspace", Arguments::Word("")),
    ("-boost", Arguments::Numbers(1, 0.0)),
    ("-bm", Arguments::Numbers(1, 1.0)),
    ("-mm", Arguments::Base),
    ("-o", Arguments::Numbers(3, 0.0)),
    ("-s", Arguments::Numbers(3, 1.0)),
    ("-t", Arguments::Numbers(3, 0.0)),
];

#[derive(Clone, Copy)]
enum Arguments {
    /// One word, without effect if it is this one.
    Word(&'static str),
    /// Up to this many numbers, without effect if all have this value.
    Numbers(usize, f64),
    /// A base and a gain, without effect if they are 0 and 1.
    Base,
}

/// Parses the arguments of a texture statement.
pub(super) fn map(arguments: &[u8]) -> Option<Map> {
    let tokens: Vec<Token<'_>> = Tokens::new(arguments).collect();
    let mut options = Vec::new();
    let mut at = 0;
    // The last word is the path, whatever it looks like.
    let words = tokens.split_last().map_or(&[][..], |(_, words)| words);
    while let Some(&(name, expected)) = words.get(at).and_then(|token| {
        let word = token.text.to_ascii_lowercase();
        OPTIONS.iter().find(|(name, _)| name.as_bytes() == word)
    }) {
        let rest = words.get(at + 1..).unwrap_or(&[]);
        let (count, has_effect) = effect(expected, rest);
        if has_effect && !options.contains(&name) {
            options.push(name);
        }
        at += 1 + count;
    }
    // A path may contain spaces and `#`, so it extends to the end of the line.
    let start = tokens.get(at)?.start;
    let path = decode(arguments.get(start..)?);
    let path = path.trim_matches(|c: char| c <= ' ');
    let path = path
        .strip_prefix('"')
        .and_then(|path| path.strip_suffix('"'))
        .unwrap_or(path);
    (!path.is_empty()).then(|| Map {
        path: path.replace('\\', "/"),
        options,
    })
}

/// Returns the number of words that belong to an option, and `true` if they have an effect.
fn effect(expected: Arguments, rest: &[Token<'_>]) -> (usize, bool) {
    let number = |token: &Token<'_>| std::str::from_utf8(token.text).ok()?.parse::<f64>().ok();
    match expected {
        Arguments::Word(neutral) => match rest.first() {
            Some(word) => (1, !word.text.eq_ignore_ascii_case(neutral.as_bytes())),
            None => (0, false),
        },
        Arguments::Numbers(most, neutral) => {
            let numbers: Vec<f64> = rest.iter().take(most).map_while(number).collect();
            (numbers.len(), numbers.iter().any(|&x| x != neutral))
        }
        Arguments::Base => {
            let numbers: Vec<f64> = rest.iter().take(2).map_while(number).collect();
            (
                numbers.len(),
                !matches!(numbers[..], [] | [0.0] | [0.0, 1.0]),
            )
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(text: &str) -> Option<(String, Vec<&'static str>)> {
        map(text.as_bytes()).map(|map| (map.path, map.options))
    }

    #[test]
    fn options_are_told_from_paths_with_blanks() {
        for (text, path, options) in [
            ("wood.png", "wood.png", &[][..]),
            ("  my wood #2.png\t", "my wood #2.png", &[]),
            ("-s 1 1 1 wood.png", "wood.png", &[]),
            ("-S 2 wood.png", "wood.png", &["-s"]),
            (
                "-o 0 0.5 -clamp on -bm 1.0 my wood.png",
                "my wood.png",
                &["-o", "-clamp"],
            ),
            ("-s 1 1 1 2", "2", &[]),
            ("-s 1 1 2", "2", &[]),
            ("-mm 0 1 -blendu on a.png", "a.png", &[]),
            ("-mm 0.5 a.png", "a.png", &["-mm"]),
            ("-foo.png", "-foo.png", &[]),
            ("-clamp", "-clamp", &[]),
            ("tex\\sub\\wood.png", "tex/sub/wood.png", &[]),
            ("\"my wood.png\"", "my wood.png", &[]),
            ("-type sphere env.png", "env.png", &["-type"]),
        ] {
            let expected = Some((path.to_owned(), options.to_vec()));
            assert_eq!(split(text), expected, "{text}");
        }
        for nothing in ["", "  ", "# wood.png", "\"\""] {
            assert_eq!(split(nothing), None, "{nothing}");
        }
    }
}
