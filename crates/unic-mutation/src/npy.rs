//! Damage of NumPy arrays whose headers stay well formed, but disagree with the data or each other.

use super::{change::change_number, random::Random};
use std::ops::Range;

/// Number of bytes before the header's text: magic, version and the length of the text.
const PREFIX: usize = 10;

/// Returns true if the bytes begin like an array of format version 1.
pub(super) fn is_array(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x93NUMPY\x01\x00") && bytes.len() >= PREFIX
}

/// Changes a number in the header, or the number of rows together with the rows.
pub(super) fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let end = (PREFIX + length).min(bytes.len());
    let (mut text, mut data) = (bytes[PREFIX..end].to_vec(), bytes[end..].to_vec());
    match rows(&text).filter(|_| random.once_in(2)) {
        Some(rows) => resize(&mut text, rows, &mut data, random),
        None => change_number(&mut text, random),
    }
    // The length of the text is made right again: the reader gets as far as the text.
    bytes.truncate(PREFIX);
    bytes[8..PREFIX].copy_from_slice(&(text.len() as u16).to_le_bytes());
    bytes.extend(text);
    bytes.extend(data);
}

/// Place of the first number of the array's shape in the header's text.
fn rows(text: &[u8]) -> Option<Range<usize>> {
    let start = text.iter().position(|&b| b == b'(')? + 1;
    let digits = text[start..].iter().take_while(|b| b.is_ascii_digit()).count();
    (digits > 0).then(|| start..start + digits)
}

/// Changes the number of rows in both header and data, so that the array itself stays consistent.
///
/// New rows repeat the old ones.
fn resize(text: &mut Vec<u8>, rows: Range<usize>, data: &mut Vec<u8>, random: &mut Random) {
    let before: usize = std::str::from_utf8(&text[rows.clone()])
        .ok()
        .and_then(|digits| digits.parse().ok())
        .unwrap_or(0);
    let row = data.len() / before.max(1);
    let after = random.below(before.min(1000) + 3);
    let filling = data.clone();
    data.resize(row * after, 0);
    if row * after > filling.len() && !filling.is_empty() {
        let more = filling.iter().cycle().skip(filling.len());
        (data[filling.len()..].iter_mut().zip(more)).for_each(|(new, old)| *new = *old);
    }
    text.splice(rows, after.to_string().into_bytes());
}
