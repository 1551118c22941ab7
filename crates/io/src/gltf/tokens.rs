//! Tokenizer for a JSON text that was parsed before, in one pass and without building a tree.

/// A token of JSON.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Token<'a> {
    /// `{` or `[`.
    Open,
    /// `}` or `]`.
    Close,
    /// The key of a member, verbatim with its quotes.
    Key(&'a str),
    /// A string, verbatim with its quotes.
    Text(&'a str),
    /// A number, `true`, `false` or `null`.
    Word(&'a str),
}

impl Token<'_> {
    /// The unescaped content of a string.
    pub(super) fn string(&self) -> Option<String> {
        match self {
            Self::Key(literal) | Self::Text(literal) => serde_json::from_str(literal).ok(),
            _ => None,
        }
    }
}

/// The tokens of a JSON text.
#[derive(Clone, Debug)]
pub(super) struct Tokens<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> Tokens<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { text, at: 0 }
    }

    /// Skips the value that follows.
    pub(super) fn skip_value(&mut self) {
        let mut depth = 0usize;
        for token in self.by_ref() {
            match token {
                Token::Open => depth += 1,
                Token::Close => depth = depth.saturating_sub(1),
                _ => {}
            }
            if depth == 0 && !matches!(token, Token::Key(_)) {
                return;
            }
        }
    }

    fn cut(&mut self, end: usize) -> &'a str {
        let token = self.text.get(self.at..end).unwrap_or_default();
        self.at = end;
        token
    }

    fn string_end(&self) -> usize {
        let bytes = self.text.as_bytes();
        let mut at = self.at + 1;
        while let Some(&byte) = bytes.get(at) {
            match byte {
                b'"' => return at + 1,
                b'\\' => at += 2,
                _ => at += 1,
            }
        }
        bytes.len()
    }
}

impl<'a> Iterator for Tokens<'a> {
    type Item = Token<'a>;

    fn next(&mut self) -> Option<Token<'a>> {
        let bytes = self.text.as_bytes();
        let is_between = |b: u8| b.is_ascii_whitespace() || matches!(b, b',' | b':');
        while bytes.get(self.at).is_some_and(|&b| is_between(b)) {
            self.at += 1;
        }
        Some(match *bytes.get(self.at)? {
            b'{' | b'[' => {
                self.at += 1;
                Token::Open
            }
            b'}' | b']' => {
                self.at += 1;
                Token::Close
            }
            b'"' => {
                let literal = self.cut(self.string_end());
                let rest = bytes.get(self.at..).unwrap_or(&[]);
                let behind = rest.iter().find(|b| !b.is_ascii_whitespace());
                match behind {
                    Some(b':') => Token::Key(literal),
                    _ => Token::Text(literal),
                }
            }
            _ => {
                let rest = bytes.get(self.at..).unwrap_or(&[]);
                let is_end = |b: &u8| is_between(*b) || matches!(b, b'}' | b']' | b'"');
                let length = rest.iter().position(is_end).unwrap_or(rest.len());
                // A word has at least one byte, so this terminates.
                Token::Word(self.cut(self.at + length.max(1)))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_taken_apart() {
        let text = r#"{ "a\"b" : [1e999, "x:\\", true],"c":{"d" :null}, "e":"\u0041"}"#;
        use Token::{Close, Key, Open, Text, Word};
        let tokens = [
            Open,
            Key(r#""a\"b""#),
            Open,
            Word("1e999"),
            Text(r#""x:\\""#),
            Word("true"),
            Close,
            Key(r#""c""#),
            Open,
            Key(r#""d""#),
            Word("null"),
            Close,
            Key(r#""e""#),
            Text(r#""\u0041""#),
            Close,
        ];
        assert!(Tokens::new(text).eq(tokens));
        assert_eq!(tokens[1].string().as_deref(), Some("a\"b"));
        assert_eq!(tokens[13].string().as_deref(), Some("A"));
    }

    #[test]
    fn a_value_is_skipped() {
        for value in ["1", "\"x\"", "{}", r#"{"a":[1,{"b":2}],"c":3}"#, "[[],[1]]"] {
            let text = format!("{{\"k\":{value},\"next\":5}}");
            let mut tokens = Tokens::new(&text);
            assert_eq!(tokens.by_ref().take(2).count(), 2);
            tokens.skip_value();
            assert_eq!(tokens.next(), Some(Token::Key("\"next\"")), "{value}");
        }
    }
}
