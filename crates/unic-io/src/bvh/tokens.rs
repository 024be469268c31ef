//! Words of a text with the lines that they stand in.

/// Reads a text word by word.
pub(super) struct Tokens<'a> {
    lines: std::str::Split<'a, char>,
    rest: &'a str,
    /// From 1 on.
    line: usize,
}

impl<'a> Tokens<'a> {
    /// Lines end with a line feed, with a carriage return before it or not; in texts without any
    /// line feed, with a carriage return.
    pub(super) fn new(text: &'a str) -> Self {
        let text = text.trim_start_matches('\u{feff}');
        let end = if text.contains('\n') { '\n' } else { '\r' };
        let mut lines = text.split(end);
        Self {
            rest: lines.next().unwrap_or_default(),
            lines,
            line: 1,
        }
    }

    /// The line of the last word, from 1 on.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Goes on to the next word without taking it.
    fn skip_space(&mut self) -> bool {
        loop {
            self.rest = self.rest.trim_start();
            if !self.rest.is_empty() {
                return true;
            }
            let Some(next) = self.lines.next() else {
                return false;
            };
            self.rest = next;
            self.line += 1;
        }
    }

    /// The next word; braces are words of their own.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        if !self.skip_space() {
            return None;
        }
        let is_brace = self.rest.starts_with(['{', '}']);
        let end = match is_brace {
            true => 1,
            false => (self
                .rest
                .find(|c: char| c.is_whitespace() || c == '{' || c == '}'))
            .unwrap_or(self.rest.len()),
        };
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        Some(word)
    }

    /// What is left of this line up to a brace: a name, which may contain spaces.
    pub(super) fn name(&mut self) -> &'a str {
        let end = self.rest.find(['{', '}']).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        self.rest = rest;
        name.trim()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_braces_and_names_in_any_layout() {
        for text in [
            "ROOT a b{\nX\t1 }",
            "\u{feff}ROOT  a b \r\n\r\n{ X 1}",
            "ROOT a b\r{\rX 1\r}",
        ] {
            let mut tokens = Tokens::new(text);
            assert_eq!(tokens.next(), Some("ROOT"));
            assert_eq!(tokens.name(), "a b");
            let rest: Vec<&str> = std::iter::from_fn(|| tokens.next()).collect();
            assert_eq!(rest, ["{", "X", "1", "}"], "{text:?}");
        }
    }

    #[test]
    fn lines_are_counted() {
        let mut tokens = Tokens::new("a\r\n\r\nb");
        tokens.next();
        tokens.next();
        assert_eq!(tokens.line(), 3);
    }
}
