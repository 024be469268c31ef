//! Blend of the linear map and the recurrence, weighted by what they predict of motions left out.
//!
//! The linear map is better at what the present motion determines, the recurrence at what its past
//! does. Both differ between coefficients, so groups of them have shares of their own (stacked
//! regression, Breiman 1996). A blend lies between its two predictions: larger weights extrapolate
//! on motion that is livelier than that of training. Shares by group are used where they gain more on
//! motions left out than a common one does.

use super::sequence::{Sequence, motion_count};
use std::iter::zip;
use unic_core::recurrence::Recurrence;

/// Blends with a smaller gain are noise ([`Gain::mean`]).
const LEAST_GAIN: f64 = 0.02;

/// Strength of the pull of a group's share towards the common share, as a multiple of the group's
/// |c|² (see [`Products`]).
const PULL: f64 = 0.1;

/// Linear map and recurrences on motions that they were not trained on.
pub(super) struct Blend {
    /// Share of the recurrence in each of K coefficients, 0 to 1; the linear map has the rest.
    pub(super) recurrence_shares: Vec<f32>,
    /// Blended coefficients of each sequence, T × K.
    pub(super) left_out: Vec<Vec<f32>>,
}

/// Dependence of the shares on the coefficient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Freedom {
    /// All coefficients have the same share.
    Common,
    /// Each group of coefficients has a share of its own.
    ByGroup,
}

impl Blend {
    /// Finds the shares with the least error. Returns none if the recurrences add nothing
    /// significant.
    pub(super) fn fit(sequences: &[Sequence], recurrent: Vec<Vec<f32>>) -> Option<Self> {
        let motions = by_motion(sequences, &recurrent);
        let freedoms = [Freedom::Common, Freedom::ByGroup];
        let gains = freedoms.map(|freedom| (Gain::measure(&motions, freedom), freedom));
        let groups = shares(&sum(&motions), best(gains)?);
        let count = sequences.first().map_or(0, Sequence::outputs);
        let recurrence_shares: Vec<f32> = (0..count).map(|k| groups[group_of(k)] as f32).collect();
        let mut left_out = recurrent;
        for (s, left_out) in zip(sequences, &mut left_out) {
            let pairs = zip(left_out, &s.linear).zip(recurrence_shares.iter().cycle());
            pairs.for_each(|((x, linear), share)| *x = linear + share * (*x - linear));
        }
        Some(Self {
            recurrence_shares,
            left_out,
        })
    }

    /// Scales a recurrence's outputs by its shares.
    pub(super) fn weighted(&self, mut recurrence: Recurrence) -> Recurrence {
        recurrence.head.scale_outputs(&self.recurrence_shares);
        recurrence
    }

    /// Share of the linear map in each coefficient.
    pub(super) fn linear_shares(&self) -> Vec<f32> {
        self.recurrence_shares.iter().map(|share| 1.0 - share).collect()
    }
}

/// Returns the freedom with the largest gain among those whose gain is significant.
fn best(gains: [(Gain, Freedom); 2]) -> Option<Freedom> {
    let significant = gains.into_iter().filter(|(gain, _)| gain.is_significant());
    let better = |a: (Gain, Freedom), b: (Gain, Freedom)| if b.0.mean > a.0.mean { b } else { a };
    significant.reduce(better).map(|(_, freedom)| freedom)
}

/// Group of a coefficient: the first two, two more, then four, eight and so on.
fn group_of(coefficient: usize) -> usize {
    coefficient.max(1).ilog2() as usize
}

/// Products of the change c from the linear map to the recurrence and the wanted change w from the
/// linear map to the truth, summed over frames and coefficients.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Products {
    /// ⟨c, w⟩.
    along: f64,
    /// |c|².
    change: f64,
    /// |w|², which the linear map leaves.
    left: f64,
}

impl Products {
    fn of(linear: f32, recurrent: f32, truth: f32) -> Self {
        let (c, w) = (f64::from(recurrent - linear), f64::from(truth - linear));
        Self {
            along: c * w,
            change: c * c,
            left: w * w,
        }
    }

    /// Adds `factor` times `other`.
    fn add(&mut self, factor: f64, other: &Self) {
        self.along += factor * other.along;
        self.change += factor * other.change;
        self.left += factor * other.left;
    }

    /// Squares that a blend with this share of the recurrence removes from those that the linear map
    /// leaves: |w|² − |w − share · c|².
    fn removed(&self, share: f64) -> f64 {
        share * (2.0 * self.along - share * self.change)
    }

    /// Share with the least error, 0 to 1, with a pull of this strength towards `common`.
    fn share(&self, pull: f64, common: f64) -> f64 {
        let share = (self.along + pull * self.change * common) / ((1.0 + pull) * self.change);
        // Predictions that agree have no best share.
        if self.change > 0.0 {
            share.clamp(0.0, 1.0)
        } else {
            common
        }
    }
}

/// Products of one motion by group, divided so that neither a lively motion nor a calm one decides
/// alone (see [`balanced`]).
type MotionProducts = Vec<Products>;

/// Sums of the motions' products, by group.
fn sum<'a>(motions: impl IntoIterator<Item = &'a MotionProducts>) -> MotionProducts {
    motions
        .into_iter()
        .fold(MotionProducts::new(), |mut sum, motion| {
            sum.resize(motion.len(), Products::default());
            zip(&mut sum, motion).for_each(|(sum, p)| sum.add(1.0, p));
            sum
        })
}

/// Share of the recurrence in each group.
fn shares(groups: &[Products], freedom: Freedom) -> Vec<f64> {
    let mut all = Products::default();
    groups.iter().for_each(|p| all.add(1.0, p));
    let common = all.share(0.0, 0.0);
    let of_group = |p: &Products| match freedom {
        Freedom::Common => common,
        Freedom::ByGroup => p.share(PULL, common),
    };
    groups.iter().map(of_group).collect()
}

/// Gain of a blend over the linear map on motions left out, the shares for each being those of the
/// other motions.
#[derive(Clone, Copy, Debug)]
struct Gain {
    /// Share of the squares left by the linear map that the blend removes, averaged over motions, the
    /// squares being those of [`balanced`].
    mean: f64,
    /// Standard error of that average.
    error: f64,
}

impl Gain {
    fn measure(motions: &[MotionProducts], freedom: Freedom) -> Self {
        let gain = |(i, motion): (usize, &MotionProducts)| {
            let others = motions.iter().enumerate().filter(|(j, _)| *j != i);
            // A lone motion has no others, and no gain.
            let shares = shares(&sum(others.map(|(_, motion)| motion)), freedom);
            zip(motion, shares).map(|(p, share)| p.removed(share)).sum()
        };
        let gains: Vec<f64> = motions.iter().enumerate().map(gain).collect();
        let count = gains.len().max(1) as f64;
        let mean = gains.iter().sum::<f64>() / count;
        let variance = gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self {
            mean,
            error: (variance / count).sqrt(),
        }
    }

    /// Returns whether the gain exceeds both [`LEAST_GAIN`] and its own standard error.
    fn is_significant(&self) -> bool {
        self.mean > LEAST_GAIN.max(self.error)
    }
}

/// Products of the motions.
fn by_motion(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Vec<MotionProducts> {
    let count = sequences.first().map_or(0, Sequence::outputs);
    let groups = count.checked_sub(1).map_or(0, |last| group_of(last) + 1);
    let mut motions = vec![(vec![Products::default(); groups], 0); motion_count(sequences)];
    for (sequence, recurrent) in zip(sequences, recurrent) {
        let (motion, frames) = &mut motions[sequence.motion_number];
        *frames += sequence.len();
        let numbers = zip(zip(&sequence.linear, recurrent), &sequence.coefficients);
        for (i, ((l, r), t)) in numbers.enumerate() {
            motion[group_of(i % count)].add(1.0, &Products::of(*l, *r, *t));
        }
    }
    balanced(motions)
}

/// Divides the products of each motion, summed over so many frames, by the mean of two numbers: the
/// squares that the linear map leaves of it, and those that it leaves of as many frames of an
/// average motion. By the first alone, a calm motion that the linear map predicts well outweighs all
/// others: the blend can multiply its small error. By the second alone, the liveliest motion does.
fn balanced(mut motions: Vec<(MotionProducts, usize)>) -> Vec<MotionProducts> {
    motions.retain(|(_, frames)| *frames > 0);
    let left = |(products, frames): &(MotionProducts, usize)| {
        products.iter().map(|p| p.left).sum::<f64>() / *frames as f64
    };
    // A motion without finite numbers is left out.
    motions.retain(|motion| left(motion).is_finite());
    let mean = motions.iter().map(left).sum::<f64>() / motions.len().max(1) as f64;
    // Where the linear map predicts all motions exactly, there is nothing to compare.
    motions.retain(|motion| left(motion) + mean > 0.0);
    let divided = |motion: &(MotionProducts, usize)| {
        let by = 0.5 * (left(motion) + mean) * motion.1 as f64;
        let scaled = |p: &Products| {
            let mut scaled = Products::default();
            scaled.add(1.0 / by, p);
            scaled
        };
        motion.0.iter().map(scaled).collect()
    };
    motions.iter().map(divided).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dataset::MotionVectors, mirror::View};

    /// Frames of four coefficients whose truth is a blend of two predictions with these shares, as
    /// a sequence of motion `number` and what a recurrence predicts.
    fn sequence<'a>(motion: &'a MotionVectors, number: usize, shares: [f32; 4]) -> (Sequence<'a>, Vec<f32>) {
        let frames = 50;
        let wave = |hz: f32| (0..4 * frames).map(move |i| (hz * (i + 7 * number) as f32).sin());
        let (linear, recurrent): (Vec<f32>, Vec<f32>) = (wave(0.9).collect(), wave(1.7).collect());
        let blended = zip(&linear, &recurrent).zip(shares.iter().cycle());
        let sequence = Sequence {
            motion,
            view: View::Direct,
            frames: 0..frames,
            coefficients: blended.map(|((l, r), share)| l + share * (r - l)).collect(),
            linear,
            motion_number: number,
        };
        (sequence, recurrent)
    }

    #[test]
    fn a_blend_has_the_shares_of_its_groups_in_every_frame() {
        let motion = MotionVectors::of_plain(1, vec![0.0; 50]);
        let shares = [0.2, 0.2, 0.9, 0.9];
        let all = [0, 1, 1].map(|number| sequence(&motion, number, shares));
        let (sequences, recurrent): (Vec<_>, Vec<_>) = all.into_iter().unzip();
        let blend = Blend::fit(&sequences, recurrent.clone()).unwrap();
        for (found, expected) in zip(&blend.recurrence_shares, shares) {
            assert!((found - expected).abs() < 0.1, "{found}, {expected}");
        }
        for (s, (found, recurrent)) in zip(&sequences, zip(&blend.left_out, &recurrent)) {
            for (i, x) in found.iter().enumerate() {
                let share = blend.recurrence_shares[i % 4];
                let expected = (1.0 - share) * s.linear[i] + share * recurrent[i];
                assert!((x - expected).abs() < 1e-6, "{i}");
            }
        }
        // A recurrence that predicts what the linear map does adds nothing.
        let linear = sequences.iter().map(|s| s.linear.clone()).collect();
        assert!(Blend::fit(&sequences, linear).is_none());
        let no_number = recurrent.iter().map(|r| vec![f32::NAN; r.len()]).collect();
        assert!(Blend::fit(&sequences, no_number).is_none());
        assert!(Blend::fit(&[], Vec::new()).is_none());
    }

    #[test]
    fn a_common_share_is_taken_where_a_larger_gain_by_group_may_be_noise() {
        let gain = |mean, error| Gain { mean, error };
        let found = |common, by_group| best([(common, Freedom::Common), (by_group, Freedom::ByGroup)]);
        assert_eq!(found(gain(0.05, 0.02), gain(0.06, 0.07)), Some(Freedom::Common));
        assert_eq!(found(gain(0.05, 0.02), gain(0.06, 0.02)), Some(Freedom::ByGroup));
        assert_eq!(found(gain(0.05, 0.06), gain(0.06, 0.07)), None);
    }

    /// Groups of a motion whose truth is a blend with these shares of two predictions that are
    /// unrelated.
    fn motion(shares: &[f32]) -> MotionProducts {
        balanced(vec![(sums(shares), FRAMES)]).remove(0)
    }

    const FRAMES: usize = 64;

    /// Sums of such a motion over its frames.
    fn sums(shares: &[f32]) -> MotionProducts {
        let frames = |share: &f32| {
            let mut products = Products::default();
            for t in 0..FRAMES {
                let (l, r) = ((0.7 * t as f32).sin(), (1.3 * t as f32).cos());
                products.add(1.0, &Products::of(l, r, l + share * (r - l)));
            }
            products
        };
        shares.iter().map(frames).collect()
    }

    #[test]
    fn neither_a_calm_motion_nor_a_lively_one_decides_alone() {
        let sized = |size: f64, shares: &[f32]| {
            let mut products = vec![Products::default(); shares.len()];
            zip(&mut products, sums(shares)).for_each(|(sum, p)| sum.add(size * size, &p));
            (products, FRAMES)
        };
        // One of twice the size has four times the squares and counts twice as much as another.
        let motions = balanced(vec![sized(1.0, &[0.8]), sized(1.0, &[0.8]), sized(2.0, &[0.8])]);
        let ratio = motions[2][0].left / motions[0][0].left;
        assert!((ratio - 2.0).abs() < 1e-9, "{ratio}");
        // A hundredth of the squares does not turn the share of the others around.
        let motions = balanced(vec![sized(1.0, &[0.8]), sized(0.1, &[-0.8])]);
        let share = shares(&sum(&motions), Freedom::Common)[0];
        assert!((0.7..0.8).contains(&share), "{share}");
        let still = (vec![Products::default()], FRAMES);
        assert!(balanced(vec![still]).is_empty());
        assert!(balanced(vec![(vec![Products::default()], 0)]).is_empty());
    }

    #[test]
    fn groups_double() {
        let groups = [0, 1, 2, 3, 4, 7, 8, 15, 16, 63].map(group_of);
        assert_eq!(groups, [0, 0, 1, 1, 2, 2, 3, 3, 4, 5]);
    }

    #[test]
    fn a_share_removes_the_squares_by_which_errors_differ() {
        let p = Products::of(2.0, 3.0, 7.0);
        let error = 7.0f64 - (2.0 + 0.25 * (3.0 - 2.0));
        assert!((p.left - p.removed(0.25) - error * error).abs() < 1e-12);
    }

    #[test]
    fn shares_of_groups_lie_between_the_common_one_and_the_best() {
        let best = [0.1, 0.8, 0.5];
        let found = shares(&motion(&best), Freedom::ByGroup);
        let common = shares(&motion(&best), Freedom::Common);
        assert!(common.iter().all(|share| *share == common[0]));
        for ((found, best), common) in zip(zip(found, best), common) {
            let expected = (f64::from(best) + PULL * common) / (1.0 + PULL);
            assert!((found - expected).abs() < 1e-5, "{found}, {expected}");
        }
    }

    #[test]
    fn shares_are_between_zero_and_one() {
        let found = shares(&motion(&[-1.0, 2.0, 0.5]), Freedom::ByGroup);
        assert_eq!((found[0], found[1]), (0.0, 1.0));
        let agreeing = vec![Products::of(1.0, 1.0, 2.0)];
        assert_eq!(shares(&agreeing, Freedom::ByGroup), [0.0]);
    }

    #[test]
    fn groups_count_where_motions_left_out_agree_on_them() {
        let same = vec![motion(&[0.1, 0.9]); 4];
        let by_group = Gain::measure(&same, Freedom::ByGroup);
        let common = Gain::measure(&same, Freedom::Common);
        assert!(by_group.mean > common.mean + 0.1 && by_group.is_significant());
        let alone = Gain::measure(&same[..1], Freedom::ByGroup);
        assert!(alone.mean == 0.0 && !alone.is_significant());
        // Motions that ask for opposite shares.
        let opposite = [motion(&[0.05, 0.95]), motion(&[0.95, 0.05])];
        assert!(
            Gain::measure(&opposite, Freedom::ByGroup).mean < Gain::measure(&opposite, Freedom::Common).mean
        );
    }
}
