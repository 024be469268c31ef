//! Text from files on its way to people: for the errors of this project's crates.

use std::fmt::{self, Display, Write};

/// Longest piece of a file that an error repeats, characters.
const LONGEST: usize = 300;

/// Text that may come from a file, in one line: a file must not move the cursor of whoever reads what
/// is wrong with it.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    text: &'a str,
    longest: usize,
}

/// Cut where it is long.
pub fn shortened(text: &str) -> Shown<'_> {
    Shown {
        text,
        longest: LONGEST,
    }
}

/// In full.
pub fn shown(text: &str) -> Shown<'_> {
    Shown {
        text,
        longest: usize::MAX,
    }
}

impl Display for Shown<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, c) in self.text.chars().enumerate() {
            if i == self.longest {
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
    fn one_line_without_commands_to_a_terminal() {
        let hostile = "\u{1b}[2J é\r\nline\u{7f}";
        assert_eq!(shown(hostile).to_string(), "\\u{1b}[2J é\\r line\\u{7f}");
    }

    #[test]
    fn long_text_is_cut() {
        let text = "é".repeat(LONGEST);
        assert_eq!(shortened(&text).to_string(), text);
        let longer = format!("{text}x");
        assert_eq!(shortened(&longer).to_string(), format!("{text}..."));
        assert_eq!(shown(&longer).to_string(), longer);
    }
}
