//! pbrt's words, strings and brackets, each with its place.

use super::error::{Location, Result, SceneError};
use std::borrow::Cow;
use std::sync::Arc;

/// One token.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token<'a> {
    /// A directive, a number, `true` or `false`.
    Word(&'a str),
    /// A string between double quotes.
    Quoted(Cow<'a, str>),
    /// `[`
    Open,
    /// `]`
    Close,
}

impl Token<'_> {
    /// For "found …".
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Word(w) => format!("{:.40}", w),
            Self::Quoted(s) => format!("\"{:.60}\"", s),
            Self::Open => "[".into(),
            Self::Close => "]".into(),
        }
    }
}

/// Walks over the bytes of one file.
pub(super) struct Tokenizer<'a> {
    text: &'a str,
    file: Arc<str>,
    pos: usize,
    line: u32,
    line_start: usize,
    /// Start of the token handed out last.
    last: (u32, u32),
}

impl<'a> Tokenizer<'a> {
    pub(super) fn new(text: &'a str, file: Arc<str>) -> Self {
        Self {
            text,
            file,
            pos: 0,
            line: 1,
            line_start: 0,
            last: (1, 1),
        }
    }

    /// Where the token handed out last begins.
    pub(super) fn at(&self) -> Location {
        Location {
            file: self.file.clone(),
            line: self.last.0,
            column: self.last.1,
        }
    }

    /// The first byte of the next token.
    pub(super) fn peek(&mut self) -> Option<u8> {
        self.skip();
        self.text.as_bytes().get(self.pos).copied()
    }

    /// The next token is `true` or `false`.
    pub(super) fn at_truth_value(&mut self) -> bool {
        self.skip();
        ["true", "false"].iter().any(|w| {
            let rest = self.text.as_bytes()[self.pos..].strip_prefix(w.as_bytes());
            rest.is_some_and(|r| !r.first().is_some_and(u8::is_ascii_alphanumeric))
        })
    }

    /// The next token, `None` at the end of the file.
    pub(super) fn next(&mut self) -> Result<Option<Token<'a>>> {
        let first = self.peek();
        self.last = (self.line, (self.pos - self.line_start + 1) as u32);
        let Some(first) = first else {
            return Ok(None);
        };
        let token = match first {
            b'[' => {
                self.pos += 1;
                Token::Open
            }
            b']' => {
                self.pos += 1;
                Token::Close
            }
            b'"' => Token::Quoted(self.quoted()?),
            _ => {
                let start = self.pos;
                let end = self.text.as_bytes()[start..]
                    .iter()
                    .position(|b| b.is_ascii_whitespace() || matches!(b, b'[' | b']' | b'"' | b'#'))
                    .map_or(self.text.len(), |n| start + n);
                self.pos = end;
                Token::Word(&self.text[start..end])
            }
        };
        Ok(Some(token))
    }

    /// A string that must come next.
    pub(super) fn string(&mut self, what: &str) -> Result<String> {
        match self.next()? {
            Some(Token::Quoted(s)) => Ok(s.into_owned()),
            other => Err(self.wrong(other, format!("{what} in double quotes"))),
        }
    }

    /// A number that must come next.
    pub(super) fn number(&mut self, what: &str) -> Result<f64> {
        match self.next()? {
            Some(Token::Word(w)) => match parse_number(w) {
                Some(v) if v.is_finite() => Ok(v),
                _ => Err(self.wrong(Some(Token::Word(w)), format!("a number ({what})"))),
            },
            other => Err(self.wrong(other, format!("a number ({what})"))),
        }
    }

    /// `N` numbers, in brackets or bare.
    pub(super) fn numbers<const N: usize>(&mut self, what: &str) -> Result<[f64; N]> {
        let bracket = self.peek() == Some(b'[');
        if bracket {
            self.next()?;
        }
        let mut out = [0.0; N];
        for (i, v) in out.iter_mut().enumerate() {
            *v = self.number(&format!("{} of {N} of {what}", i + 1))?;
        }
        if bracket {
            match self.next()? {
                Some(Token::Close) => {}
                other => return Err(self.wrong(other, format!("] after {N} numbers of {what}"))),
            }
        }
        Ok(out)
    }

    /// An unexpected token.
    pub(super) fn wrong(
        &self,
        token: Option<Token<'_>>,
        expected: impl Into<String>,
    ) -> SceneError {
        let found = token.map_or("the end of the file".into(), |t| t.describe());
        SceneError::syntax(&self.at(), "unexpected text")
            .found(found)
            .expected(expected.into())
    }

    fn skip(&mut self) {
        let bytes = self.text.as_bytes();
        while let Some(b) = bytes.get(self.pos) {
            match b {
                b'\n' => {
                    self.pos += 1;
                    self.line += 1;
                    self.line_start = self.pos;
                }
                b'#' => {
                    while self.pos < bytes.len() && bytes[self.pos] != b'\n' {
                        self.pos += 1;
                    }
                }
                b if b.is_ascii_whitespace() || *b == 0x0b => self.pos += 1,
                _ => break,
            }
        }
    }

    fn quoted(&mut self) -> Result<Cow<'a, str>> {
        let bytes = self.text.as_bytes();
        let start = self.pos + 1;
        let mut i = start;
        let mut escaped = false;
        loop {
            match bytes.get(i) {
                None | Some(b'\n') => {
                    return Err(SceneError::syntax(
                        &self.at(),
                        "a string without closing quote",
                    ));
                }
                Some(b'"') => break,
                Some(b'\\') => {
                    escaped = true;
                    i += 2;
                }
                Some(_) => i += 1,
            }
        }
        self.pos = i + 1;
        let raw = &self.text[start..i];
        if !escaped {
            return Ok(Cow::Borrowed(raw));
        }
        let mut out = String::with_capacity(raw.len());
        let mut chars = raw.chars();
        while let Some(c) = chars.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            match chars.next() {
                Some('n') => out.push('\n'),
                Some('t') => out.push('\t'),
                Some('r') => out.push('\r'),
                Some(c @ ('\\' | '"' | '\'')) => out.push(c),
                other => {
                    return Err(SceneError::syntax(&self.at(), "unknown escape in a string")
                        .found(format!("\\{}", other.unwrap_or(' '))));
                }
            }
        }
        Ok(Cow::Owned(out))
    }
}

/// A number as pbrt writes it; "nan" and "inf" are numbers too, so that they can be named where they stand.
pub(super) fn parse_number(word: &str) -> Option<f64> {
    word.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(Token<'_>, u32, u32)> {
        let mut t = Tokenizer::new(text, "t".into());
        let mut out = Vec::new();
        while let Some(token) = t.next().unwrap() {
            let at = t.at();
            out.push((token, at.line, at.column));
        }
        out
    }

    #[test]
    fn tokens_carry_their_place() {
        let got = all("Shape \"a b\" # note [\n  [1 -2e3]# end");
        let want = vec![
            (Token::Word("Shape"), 1, 1),
            (Token::Quoted("a b".into()), 1, 7),
            (Token::Open, 2, 3),
            (Token::Word("1"), 2, 4),
            (Token::Word("-2e3"), 2, 6),
            (Token::Close, 2, 10),
        ];
        assert_eq!(got, want);
    }

    #[test]
    fn escapes_and_open_strings() {
        assert_eq!(all(r#""a\"b\\""#)[0].0, Token::Quoted(r#"a"b\"#.into()));
        let e = Tokenizer::new("  \"abc\n\"", "t".into())
            .next()
            .unwrap_err();
        assert_eq!(e.to_string(), "t:1:3: a string without closing quote");
        assert!(Tokenizer::new("\"abc\\", "t".into()).next().is_err());
    }

    #[test]
    fn bracketed_and_bare_numbers_are_the_same() {
        for text in ["1 2 3", "[1 2 3]"] {
            let got: [f64; 3] = Tokenizer::new(text, "t".into()).numbers("x").unwrap();
            assert_eq!(got, [1.0, 2.0, 3.0]);
        }
        let e = Tokenizer::new("[1 2 ]", "t".into())
            .numbers::<3>("Scale")
            .unwrap_err();
        assert_eq!(
            e.to_string(),
            "t:1:6: unexpected text (found ], expected a number (3 of 3 of Scale))"
        );
    }
}
