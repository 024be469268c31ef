//! Splitting a text into words with line numbers.

/// Reader of the words of a text.
pub(super) struct Tokens<'a> {
    lines: std::str::Split<'a, char>,
    rest: &'a str,
    /// Number of the line of the last word; the first line is 1.
    line: usize,
}

impl<'a> Tokens<'a> {
    /// Starts at the beginning of a text. Lines end with LF or CR LF, and with CR in a text without
    /// any LF.
    pub(super) fn new(text: &'a str) -> Self {
        // Byte order mark of some Windows programs.
        let text = text.trim_start_matches('\u{feff}');
        let end = if text.contains('\n') { '\n' } else { '\r' };
        let mut lines = text.split(end);
        Self {
            rest: lines.next().unwrap_or_default(),
            lines,
            line: 1,
        }
    }

    /// Number of the line of the last word; the first line is 1.
    pub(super) fn line(&self) -> usize {
        self.line
    }

    /// Advances to the next word without taking it; returns `false` at the end of the text.
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

    /// Takes the next word; a brace is a word of its own.
    pub(super) fn next(&mut self) -> Option<&'a str> {
        if !self.skip_space() {
            return None;
        }
        // Some programs write a brace behind a name without a blank.
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

    /// Takes the rest of the line up to a brace: a name, which may contain spaces.
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
    fn words_braces_and_names_are_split_in_any_layout() {
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
