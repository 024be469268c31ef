//! Numbers and bytes of sections in the format's compressed encodings.
//!
//! Sections are small beside the frames. They are therefore stored: each encoding is used in the
//! form that every number fits into.

/// Byte before a block of LZ4 that is not divided into chunks.
const ONE_CHUNK: u8 = 0;
/// Largest number of literals whose count fits into the first byte of an LZ4 sequence.
const SHORT_LITERALS: usize = 15;
/// Two-bit code of a difference that has four bytes.
const WIDE_CODE: u8 = 0b11;
/// Bits of a code.
const CODE_BITS: usize = 2;
/// Numbers whose codes share a byte.
const CODES_PER_BYTE: usize = 4;

/// Encodes bytes as one LZ4 block of one sequence, all of it literals.
pub(super) fn lz4_of_literals(bytes: &[u8]) -> Vec<u8> {
    let mut out = vec![ONE_CHUNK];
    let count = bytes.len();
    // The upper half of the token is the number of literals; the lower half is of matches.
    out.push((count.min(SHORT_LITERALS) as u8) << 4);
    if let Some(mut rest) = count.checked_sub(SHORT_LITERALS) {
        while rest >= usize::from(u8::MAX) {
            out.push(u8::MAX);
            rest -= usize::from(u8::MAX);
        }
        out.push(rest as u8);
    }
    out.extend(bytes);
    out
}

/// Encodes numbers as their differences, each with four bytes.
///
/// The encoding begins with the most common difference, which needs no bytes but is unused here, and
/// with a two-bit code of the width of each difference.
pub(super) fn integers(numbers: &[u32]) -> Vec<u8> {
    let mut out = 0_i32.to_le_bytes().to_vec();
    // Codes behind the last number stay 0, which has no bytes: some readers decode whole bytes of codes.
    let codes =
        |of_a_byte: &[u32]| (0..of_a_byte.len()).fold(0, |byte, i| byte | WIDE_CODE << (CODE_BITS * i));
    out.extend(numbers.chunks(CODES_PER_BYTE).map(codes));
    let mut before = 0_u32;
    for &number in numbers {
        out.extend(number.wrapping_sub(before).to_le_bytes());
        before = number;
    }
    lz4_of_literals(&out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_of_literals_continue_in_further_bytes() {
        let head = |count: usize| {
            let block = lz4_of_literals(&vec![7; count]);
            let head = block[..block.len() - count].to_vec();
            assert!(block[head.len()..].iter().all(|&b| b == 7));
            head
        };
        assert_eq!(head(0), [0, 0]);
        assert_eq!(head(14), [0, 14 << 4]);
        assert_eq!(head(15), [0, 15 << 4, 0]);
        assert_eq!(head(15 + 254), [0, 15 << 4, 254]);
        assert_eq!(head(15 + 255), [0, 15 << 4, 255, 0]);
        assert_eq!(head(15 + 511), [0, 15 << 4, 255, 255, 1]);
    }

    #[test]
    fn integers_are_differences_that_wrap() {
        let bytes = integers(&[5, 3, u32::MAX]);
        let expected: [&[u8]; 6] = [
            // 17 bytes of literals, two more than the first byte of the sequence can count.
            &[0, 15 << 4, 2],
            &[0; 4],
            &[0b00_11_11_11],
            &5_i32.to_le_bytes(),
            &(-2_i32).to_le_bytes(),
            &(-4_i32).to_le_bytes(),
        ];
        assert_eq!(bytes, expected.concat());
    }
}
