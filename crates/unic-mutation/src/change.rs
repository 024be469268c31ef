//! Random changes of a file's bytes.

use super::{npy, random::Random};
use std::ops::Range;

/// Extreme values of counts, offsets and floats.
///
/// The last four are the bits of NaN, infinity, the largest and the smallest positive f32.
const NUMBERS: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    1 << 40,
    u64::MAX,
    0x7fc0_0000,
    0x7f80_0000,
    0x7f7f_ffff,
    0x0000_0001,
];

/// Extreme numbers as text, and texts that are no numbers.
const TEXTS: [&str; 24] = [
    "0",
    "-1",
    "1",
    "2",
    "7",
    "1000000",
    "999999999",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "99999999999999999999",
    "-9223372036854775808",
    "nan",
    "inf",
    "-inf",
    "3e38",
    "-3e38",
    "1e20",
    "1e-45",
    "1e999",
    ".",
    "",
    "\u{1b}[31m",
    "é",
];

/// Makes one to four random changes.
pub(super) fn damage(bytes: &mut Vec<u8>, random: &mut Random) {
    for _ in 0..=random.below(4) {
        match npy::is_array(bytes) && random.once_in(2) {
            true => npy::damage(bytes, random),
            false => change(bytes, random),
        }
    }
}

/// Makes one random change.
fn change(bytes: &mut Vec<u8>, random: &mut Random) {
    match random.below(10) {
        0 | 1 => flip_bits(bytes, random),
        2 | 3 => put_number(bytes, random),
        4 => bytes.truncate(random.below(bytes.len())),
        5 => drop(bytes.drain(random.range(bytes.len()))),
        6 => repeat(bytes, random),
        7 => swap_parts(bytes, random),
        8 => change_number(bytes, random),
        _ => swap_words(bytes, random),
    }
}

/// Flips one to eight bits.
fn flip_bits(bytes: &mut [u8], random: &mut Random) {
    for _ in 0..=random.below(8) {
        let at = random.below(bytes.len());
        if let Some(byte) = bytes.get_mut(at) {
            *byte ^= 1 << random.below(8);
        }
    }
}

/// Overwrites one, two, four or eight bytes with an extreme number, in either byte order.
fn put_number(bytes: &mut [u8], random: &mut Random) {
    let mut number = random.pick(&NUMBERS).to_le_bytes();
    let width = random.pick(&[1, 2, 4, 8]);
    if random.once_in(4) {
        number[..width].reverse();
    }
    let at = random.below(bytes.len());
    (bytes[at..].iter_mut().zip(&number[..width])).for_each(|(byte, new)| *byte = *new);
}

/// Inserts a copy of a part of the file at a random place.
fn repeat(bytes: &mut Vec<u8>, random: &mut Random) {
    let part = bytes[random.range(bytes.len())].to_vec();
    let at = random.below(bytes.len());
    bytes.splice(at..at, part);
}

/// Exchanges two parts of equal length, which may overlap.
fn swap_parts(bytes: &mut [u8], random: &mut Random) {
    let (a, b) = (random.range(bytes.len()), random.range(bytes.len()));
    let length = a.len().min(b.len());
    for i in 0..length {
        bytes.swap(a.start + i, b.start + i);
    }
}

/// Replaces a number in a text by an extreme text or by another number of the file.
pub(super) fn change_number(bytes: &mut Vec<u8>, random: &mut Random) {
    let Some(number) = token(bytes, random, is_of_number) else {
        return;
    };
    let other = token(bytes, random, is_of_number);
    let new = match (other, random.once_in(2)) {
        (Some(other), true) => bytes[other].to_vec(),
        _ => random.pick(&TEXTS).as_bytes().to_vec(),
    };
    bytes.splice(number, new);
}

/// Exchanges two words or two lines.
fn swap_words(bytes: &mut Vec<u8>, random: &mut Random) {
    let is_inside: fn(u8) -> bool = match random.once_in(2) {
        true => |b| b != b'\n',
        false => |b| !b.is_ascii_whitespace(),
    };
    let (a, b) = (token(bytes, random, is_inside), token(bytes, random, is_inside));
    let (Some(a), Some(b)) = (a, b) else { return };
    let (first, second) = if a.start <= b.start { (a, b) } else { (b, a) };
    if first.end > second.start {
        return;
    }
    let (one, two) = (bytes[first.clone()].to_vec(), bytes[second.clone()].to_vec());
    // The later one first, so that the place of the earlier one stays valid.
    bytes.splice(second, one);
    bytes.splice(first, two);
}

fn is_of_number(byte: u8) -> bool {
    byte.is_ascii_digit() || matches!(byte, b'.' | b'-' | b'+')
}

/// Longest run of bytes of a kind around the first such byte at or after a random place.
fn token(bytes: &[u8], random: &mut Random, is_inside: fn(u8) -> bool) -> Option<Range<usize>> {
    let from = random.below(bytes.len());
    let hit = from + bytes.get(from..)?.iter().position(|&b| is_inside(b))?;
    let before = bytes[..hit].iter().rev().take_while(|&&b| is_inside(b)).count();
    let behind = bytes[hit..].iter().take_while(|&&b| is_inside(b)).count();
    Some(hit - before..hit + behind)
}
