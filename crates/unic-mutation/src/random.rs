//! Random numbers that are the same on every machine and in every version.

/// Generator SplitMix64 (Steele, Lea and Flood 2014, "Fast Splittable Pseudorandom Number
/// Generators").
pub(super) struct Random(u64);

/// Increment of the generator's state: 2⁶⁴ over the golden ratio, made odd.
const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// Generator for the file of a seed in a named stream.
    pub(super) fn new(stream: &str, seed: u64) -> Self {
        // FNV-1a of the name (Fowler, Noll and Vo).
        let mix = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        let name = stream.bytes().fold(0xcbf2_9ce4_8422_2325, mix);
        let mut start = Self(name ^ seed.wrapping_mul(GAMMA));
        Self(start.next())
    }

    /// Draws 64 random bits.
    pub(super) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GAMMA);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Draws a number from 0 to `end` − 1; 0 if `end` is 0.
    pub(super) fn below(&mut self, end: usize) -> usize {
        match end {
            0 => 0,
            // The remainder is biased towards small numbers, but `end` is tiny against 2⁶⁴.
            _ => (self.next() % end as u64) as usize,
        }
    }

    /// Draws one of the choices.
    pub(super) fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    /// Returns true with the probability 1 / `times`.
    pub(super) fn once_in(&mut self, times: usize) -> bool {
        self.below(times) == 0
    }

    /// Draws a range within `0..length`; short ranges are more frequent than long ones.
    pub(super) fn range(&mut self, length: usize) -> std::ops::Range<usize> {
        let start = self.below(length);
        let longest = 1 << self.below(12);
        let end = start + self.below(longest) + 1;
        start..end.min(length)
    }
}
