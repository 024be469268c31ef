//! Counts with their nouns.

/// Formats a count with its noun: `1 clip`, `2 clips`. `noun` is the singular.
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}
