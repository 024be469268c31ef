//! Histograms with fixed bins: percentiles of numbers that are not kept.

/// Histogram of equal bins. Counts of several clips add up, in any order.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Histogram {
    /// Lower end of the first bin.
    first: f64,
    /// Width of a bin.
    width: f64,
    /// Numbers in each bin.
    counts: Vec<u64>,
    /// Numbers below the first bin.
    below: u64,
    /// Numbers above the last bin.
    above: u64,
    /// Numbers that are NaN or infinite.
    not_finite: u64,
}

impl Histogram {
    /// Makes an empty histogram.
    pub(super) fn new(first: f64, width: f64, bins: usize) -> Self {
        Self {
            first,
            width,
            counts: vec![0; bins],
            below: 0,
            above: 0,
            not_finite: 0,
        }
    }

    /// Counts a number.
    pub(super) fn add(&mut self, number: f64) {
        // The quotient may be far outside of the bins; it is compared as a float, because casts
        // saturate.
        let place = ((number - self.first) / self.width).floor();
        if !number.is_finite() {
            self.not_finite += 1;
        } else if place < 0.0 {
            self.below += 1;
        } else if place >= self.counts.len() as f64 {
            self.above += 1;
        } else {
            self.counts[place as usize] += 1;
        }
    }

    /// Counts a number below all bins.
    fn add_below(&mut self) {
        self.below += 1;
    }

    /// Adds the counts of a histogram with the same bins.
    pub(super) fn pool(&mut self, other: &Self) {
        for (count, more) in self.counts.iter_mut().zip(&other.counts) {
            *count += more;
        }
        self.below += other.below;
        self.above += other.above;
        self.not_finite += other.not_finite;
    }

    /// Returns the number below which the share `share` of all numbers lies, interpolated within
    /// its bin.
    ///
    /// The result is infinite outside of the bins. It is NaN without numbers, and where any is not
    /// finite.
    pub(super) fn percentile(&self, share: f64) -> f64 {
        let counted = self.below + self.counts.iter().sum::<u64>() + self.above;
        if counted == 0 || self.not_finite > 0 {
            return f64::NAN;
        }
        let rank = share * counted as f64;
        let mut before = self.below as f64;
        if rank < before {
            return f64::NEG_INFINITY;
        }
        for (bin, &count) in self.counts.iter().enumerate() {
            let count = count as f64;
            if count > 0.0 && rank <= before + count {
                return self.first + self.width * (bin as f64 + (rank - before) / count);
            }
            before += count;
        }
        if self.above > 0 {
            f64::INFINITY
        } else {
            f64::NEG_INFINITY
        }
    }
}

/// Bins for each doubling of a length: a bin is 2 % wide.
const BINS_OF_DOUBLING: usize = 32;
/// Shortest length in a bin of its own, as a power of two of a metre: 1 µm, the size of rounding
/// errors. Shorter ones count as 0.
const SHORTEST: i32 = -20;
/// Longest length in a bin, as a power of two of a metre.
const LONGEST: i32 = 20;

/// Histogram of lengths in bins of equal ratios.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LengthHistogram {
    /// Histogram of the binary logarithms of the lengths in metres.
    logarithms: Histogram,
}

impl LengthHistogram {
    /// Makes an empty histogram.
    pub(super) fn new() -> Self {
        let bins = (LONGEST - SHORTEST) as usize * BINS_OF_DOUBLING;
        let logarithms = Histogram::new(f64::from(SHORTEST), 1.0 / BINS_OF_DOUBLING as f64, bins);
        Self { logarithms }
    }

    /// Counts a length, given its square in m².
    pub(super) fn add_squared(&mut self, squared: f64) {
        // The logarithm of 0 is not finite, but 0 is a length.
        if squared == 0.0 {
            self.logarithms.add_below();
        } else {
            self.logarithms.add(0.5 * squared.log2());
        }
    }

    /// Adds the counts of another histogram.
    pub(super) fn pool(&mut self, other: &Self) {
        self.logarithms.pool(&other.logarithms);
    }

    /// Returns the length below which the share `share` of all lengths lies, metres. Lengths under
    /// 1 µm give 0.
    pub(super) fn percentile(&self, share: f64) -> f64 {
        self.logarithms.percentile(share).exp2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_agree_with_a_sorted_list() {
        let numbers: Vec<f64> = (0..1000).map(|i| -0.5 + f64::from(i * i) * 1e-6).collect();
        let mut all = Histogram::new(-1.0, 5e-4, 8000);
        let mut half = all.clone();
        numbers[..500].iter().for_each(|&x| half.add(x));
        numbers[500..].iter().for_each(|&x| all.add(x));
        all.pool(&half);
        for share in [0.01, 0.5, 0.99] {
            let expected = numbers[(share * 1000.0) as usize];
            assert!((all.percentile(share) - expected).abs() < 2.5e-3, "{share}");
        }
    }

    #[test]
    fn numbers_outside_of_the_bins_are_not_hidden() {
        let mut numbers = Histogram::new(0.0, 1.0, 2);
        assert!(numbers.percentile(0.5).is_nan());
        numbers.add(5.0);
        assert_eq!(numbers.percentile(0.5), f64::INFINITY);
        (0..9).for_each(|_| numbers.add(-1.0));
        assert_eq!(numbers.percentile(0.5), f64::NEG_INFINITY);
        numbers.add(f64::NAN);
        assert!(numbers.percentile(0.5).is_nan());
    }

    #[test]
    fn lengths_are_found_within_a_bin() {
        let mut lengths = LengthHistogram::new();
        lengths.add_squared(0.0);
        assert_eq!(lengths.percentile(0.5), 0.0);
        (0..99).for_each(|_| lengths.add_squared(0.003_f64.powi(2)));
        assert!((lengths.percentile(0.99) / 0.003 - 1.0).abs() < 0.03);
        lengths.add_squared(f64::INFINITY);
        assert!(lengths.percentile(0.99).is_nan());
    }
}
