//! Text from files made printable, for the error messages of this project's crates.

use std::fmt::{self, Display, Write};

/// Largest number of characters of a file that an error message repeats.
const EXCERPT_CHARACTERS: usize = 300;

/// Text from a file, displayed on one line with its control characters escaped.
///
/// Escape sequences in a damaged or hostile file thus do not reach the terminal.
#[derive(Clone, Copy, Debug)]
pub struct Printable<'a> {
    text: &'a str,
    max_characters: usize,
}

/// Makes text printable, and cuts it where it is long.
pub fn printable_excerpt(text: &str) -> Printable<'_> {
    Printable {
        text,
        max_characters: EXCERPT_CHARACTERS,
    }
}

/// Makes text printable, in full.
pub fn printable(text: &str) -> Printable<'_> {
    Printable {
        text,
        max_characters: usize::MAX,
    }
}

impl Display for Printable<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Characters and not bytes are counted: a cut must not split one.
        for (i, c) in self.text.chars().enumerate() {
            if i == self.max_characters {
                return f.write_str("...");
            }
            match c {
                '\n' | '\t' => f.write_char(' ')?,
                c if c.is_control() => write!(f, "{}", c.escape_default())?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped_on_one_line() {
        let hostile = "\u{1b}[2J é\r\nline\u{7f}";
        assert_eq!(printable(hostile).to_string(), "\\u{1b}[2J é\\r line\\u{7f}");
    }

    #[test]
    fn long_excerpts_are_cut() {
        let text = "é".repeat(EXCERPT_CHARACTERS);
        assert_eq!(printable_excerpt(&text).to_string(), text);
        let longer = format!("{text}x");
        assert_eq!(printable_excerpt(&longer).to_string(), format!("{text}..."));
        assert_eq!(printable(&longer).to_string(), longer);
    }
}
