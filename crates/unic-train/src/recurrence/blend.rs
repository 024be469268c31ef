//! Blend of the linear map and the recurrence, weighted by what they predict of motions left out.
//!
//! The linear map is better at what the present motion determines, the recurrence at what its past
//! does. Both differ between coefficients: the first ones move most, the last ones are hardly
//! predictable. So groups of coefficients have weights of their own (stacked regression, Breiman
//! 1996). They are not negative, and their sum may differ from 1: predictions of little use become
//! smaller. Where that is no better on motions left out, all coefficients share one weight.

use super::sequence::{Sequence, motion_count};
use std::iter::zip;
use unic_core::recurrence::Recurrence;

/// Blends with a smaller gain are noise: share of the squares left by the linear map that the blend
/// removes.
const LEAST_GAIN: f64 = 0.02;

/// Pull of a group's share of the recurrence towards that of all coefficients, by the squares that
/// the share is found from.
const PULL_TO_COMMON: f64 = 0.1;

/// Pull of a group's two weights towards that share and the rest of 1, by the mean square of the
/// predictions.
const PULL_TO_SHARE: f64 = 0.3;

/// Linear map and recurrences on motions that they were not trained on.
pub(super) struct Blend {
    /// Weights by coefficient.
    pub(super) weights: Weights,
    /// Blended coefficients of each sequence, T × K.
    pub(super) left_out: Vec<Vec<f32>>,
}

/// Weights of the two predictions of each of K coefficients.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Weights {
    /// Of the linear map, not negative.
    pub(super) linear: Vec<f32>,
    /// Of the recurrence, not negative.
    pub(super) recurrence: Vec<f32>,
}

/// What the weights may depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Freedom {
    /// One share of the recurrence for all coefficients; the linear map has the rest of 1.
    Common,
    /// Two weights for each group of coefficients.
    ByGroup,
}

impl Blend {
    /// Finds the weights with the least error. Returns none if the recurrences add nothing
    /// significant.
    pub(super) fn fit(sequences: &[Sequence], recurrent: Vec<Vec<f32>>) -> Option<Self> {
        let motions = by_motion(sequences, &recurrent);
        let freedoms = [Freedom::Common, Freedom::ByGroup];
        let gains = freedoms.map(|freedom| (Gain::measure(&motions, freedom), freedom));
        let better = |a: (Gain, Freedom), b: (Gain, Freedom)| if b.0.mean > a.0.mean { b } else { a };
        let (gain, freedom) = gains.into_iter().reduce(better)?;
        if !gain.is_significant() {
            return None;
        }
        let count = sequences.first().map_or(0, Sequence::outputs);
        let weights = Weights::by_coefficient(&weights(&sum(&motions), freedom), count);
        let mut left_out = recurrent;
        for (s, left_out) in zip(sequences, &mut left_out) {
            for (x, linear) in zip(left_out.chunks_exact_mut(count), s.linear.chunks_exact(count)) {
                weights.apply(linear, x);
            }
        }
        Some(Self { weights, left_out })
    }

    /// Scales a recurrence's outputs by its weights.
    pub(super) fn weighted(&self, mut recurrence: Recurrence) -> Recurrence {
        recurrence.head.scale_outputs(&self.weights.recurrence);
        recurrence
    }
}

impl Weights {
    /// Weights of K coefficients from those of their groups.
    fn by_coefficient(groups: &[[f64; 2]], count: usize) -> Self {
        let column = |i: usize| (0..count).map(|k| groups[group_of(k)][i] as f32).collect();
        Self {
            linear: column(0),
            recurrence: column(1),
        }
    }

    /// Blends predictions of one frame by the linear map into those of the recurrence.
    fn apply(&self, linear: &[f32], recurrent: &mut [f32]) {
        let weights = zip(&self.linear, &self.recurrence);
        for ((x, linear), (a, b)) in zip(zip(recurrent, linear), weights) {
            *x = a * linear + b * *x;
        }
    }

    /// Share of the recurrence in the sum of both weights, by coefficient, 0 to 1.
    pub(super) fn recurrence_shares(&self) -> Vec<f32> {
        let share = |(a, b): (&f32, &f32)| if *b > 0.0 { b / (a + b) } else { 0.0 };
        zip(&self.linear, &self.recurrence).map(share).collect()
    }
}

/// Group of a coefficient: the first two, two more, then four, eight and so on.
fn group_of(coefficient: usize) -> usize {
    coefficient.max(1).ilog2() as usize
}

/// Inner products of the linear map's predictions l, the recurrence's r and the truth t, over
/// frames and coefficients.
#[derive(Clone, Copy, Debug, Default)]
struct Products {
    ll: f64,
    rr: f64,
    lr: f64,
    lt: f64,
    rt: f64,
    tt: f64,
}

impl Products {
    fn of(l: f32, r: f32, t: f32) -> Self {
        let [l, r, t] = [l, r, t].map(f64::from);
        Self {
            ll: l * l,
            rr: r * r,
            lr: l * r,
            lt: l * t,
            rt: r * t,
            tt: t * t,
        }
    }

    /// Adds `factor` times others.
    fn add(&mut self, factor: f64, other: &Self) {
        self.ll += factor * other.ll;
        self.rr += factor * other.rr;
        self.lr += factor * other.lr;
        self.lt += factor * other.lt;
        self.rt += factor * other.rt;
        self.tt += factor * other.tt;
    }

    /// Square of t − a l − b r.
    fn error(&self, [a, b]: [f64; 2]) -> f64 {
        a * a * self.ll + b * b * self.rr + 2.0 * (a * b * self.lr - a * self.lt - b * self.rt) + self.tt
    }

    /// Share of the recurrence with the least error, 0 to 1, with a pull of this strength towards
    /// `common`.
    fn share(&self, strength: f64, common: f64) -> f64 {
        // Of the wanted change t − l along the change r − l, and of the latter.
        let along = self.rt - self.lt - self.lr + self.ll;
        let squares = self.rr - 2.0 * self.lr + self.ll;
        let share = (along + strength * squares * common) / ((1.0 + strength) * squares);
        // Predictions that agree have no best share.
        if squares > 0.0 {
            share.clamp(0.0, 1.0)
        } else {
            common
        }
    }

    /// Weights of both predictions with the least error that are not negative, with a pull towards
    /// those of a share of the recurrence.
    fn weights(&self, share: f64) -> [f64; 2] {
        let pull = PULL_TO_SHARE * 0.5 * (self.ll + self.rr);
        let (ll, rr) = (self.ll + pull, self.rr + pull);
        let (lt, rt) = (self.lt + pull * (1.0 - share), self.rt + pull * share);
        // Above zero with the pull, by Cauchy-Schwarz.
        let determinant = ll * rr - self.lr * self.lr;
        if determinant <= 0.0 {
            return [1.0 - share, share];
        }
        let a = (lt * rr - rt * self.lr) / determinant;
        let b = (rt * ll - lt * self.lr) / determinant;
        match (a < 0.0, b < 0.0) {
            (false, false) => [a, b],
            (true, _) => [0.0, (rt / rr).max(0.0)],
            (_, true) => [(lt / ll).max(0.0), 0.0],
        }
    }
}

/// Products of one motion by group, relative to the squares that the linear map leaves of it: a
/// lively motion does not decide alone.
type ByGroup = Vec<Products>;

fn sum<'a>(motions: impl IntoIterator<Item = &'a ByGroup>) -> ByGroup {
    motions.into_iter().fold(ByGroup::new(), |mut sum, motion| {
        sum.resize(motion.len(), Products::default());
        zip(&mut sum, motion).for_each(|(sum, p)| sum.add(1.0, p));
        sum
    })
}

/// Weights of the linear map and the recurrence in each group.
fn weights(groups: &[Products], freedom: Freedom) -> Vec<[f64; 2]> {
    let mut all = Products::default();
    groups.iter().for_each(|p| all.add(1.0, p));
    let common = all.share(0.0, 0.0);
    let of_group = |p: &Products| match freedom {
        Freedom::Common => [1.0 - common, common],
        Freedom::ByGroup => p.weights(p.share(PULL_TO_COMMON, common)),
    };
    groups.iter().map(of_group).collect()
}

/// Gain of a blend over the linear map, on motions left out: the weights for each are those of the
/// other motions.
#[derive(Clone, Copy, Debug)]
struct Gain {
    /// Share of the squares left by the linear map that the blend removes, averaged over motions.
    mean: f64,
    /// Standard error of that average.
    error: f64,
}

impl Gain {
    fn measure(motions: &[ByGroup], freedom: Freedom) -> Self {
        let gain = |(i, motion): (usize, &ByGroup)| {
            let others = motions.iter().enumerate().filter(|(j, _)| *j != i);
            let weights = weights(&sum(others.map(|(_, motion)| motion)), freedom);
            let errors = zip(motion, weights).map(|(p, w)| p.error(w));
            // A lone motion has no others to weigh by.
            if motions.len() > 1 {
                1.0 - errors.sum::<f64>()
            } else {
                0.0
            }
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

fn by_motion(sequences: &[Sequence], recurrent: &[Vec<f32>]) -> Vec<ByGroup> {
    let count = sequences.first().map_or(0, Sequence::outputs);
    let groups = count.checked_sub(1).map_or(0, |last| group_of(last) + 1);
    let mut motions = vec![vec![Products::default(); groups]; motion_count(sequences)];
    for (sequence, recurrent) in zip(sequences, recurrent) {
        let motion = &mut motions[sequence.motion_number];
        let numbers = zip(zip(&sequence.linear, recurrent), &sequence.coefficients);
        for (i, ((l, r), t)) in numbers.enumerate() {
            motion[group_of(i % count)].add(1.0, &Products::of(*l, *r, *t));
        }
    }
    motions.into_iter().filter_map(relative).collect()
}

/// Divides the products of a motion by the squares that the linear map leaves. Returns none for a
/// motion that it predicts exactly, which has nothing left to compare.
fn relative(motion: ByGroup) -> Option<ByGroup> {
    let left: f64 = motion.iter().map(|p| p.error([1.0, 0.0])).sum();
    let scaled = |p: &Products| {
        let mut scaled = Products::default();
        scaled.add(1.0 / left, p);
        scaled
    };
    (left > 0.0).then(|| motion.iter().map(scaled).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Groups of a motion whose truth is a times the linear map's prediction plus b times the
    /// recurrence's, which are unrelated.
    fn motion(weights: &[[f64; 2]]) -> ByGroup {
        let frames = |[a, b]: &[f64; 2]| {
            let mut products = Products::default();
            for t in 0..64 {
                let (l, r) = ((0.7 * f64::from(t)).sin(), (1.3 * f64::from(t)).cos());
                products.add(1.0, &Products::of(l as f32, r as f32, (a * l + b * r) as f32));
            }
            products
        };
        relative(weights.iter().map(frames).collect()).unwrap()
    }

    #[test]
    fn groups_double() {
        let groups: Vec<usize> = [0, 1, 2, 3, 4, 7, 8, 15, 16, 63].map(group_of).to_vec();
        assert_eq!(groups, [0, 0, 1, 1, 2, 2, 3, 3, 4, 5]);
    }

    #[test]
    fn errors_are_squares_of_differences() {
        let p = Products::of(2.0, 3.0, 7.0);
        assert!((p.error([0.5, 1.5]) - (7.0f64 - 1.0 - 4.5).powi(2)).abs() < 1e-12);
    }

    #[test]
    fn weights_of_groups_lie_between_the_common_share_and_the_best() {
        let truth = [[1.0, 0.0], [0.2, 0.8], [0.0, 0.5]];
        let found = weights(&motion(&truth), Freedom::ByGroup);
        let common = weights(&motion(&truth), Freedom::Common);
        assert!(
            common
                .iter()
                .all(|w| *w == common[0] && (w[0] + w[1] - 1.0).abs() < 1e-12)
        );
        for ((found, truth), common) in zip(zip(&found, &truth), &common) {
            let distance = |a: &[f64; 2]| (a[0] - truth[0]).hypot(a[1] - truth[1]);
            assert!(
                distance(found) < 0.5 * distance(common),
                "{found:?}, {truth:?}, {common:?}"
            );
        }
    }

    #[test]
    fn weights_are_not_negative() {
        for truth in [[-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
            let found = weights(&motion(&[truth]), Freedom::ByGroup);
            assert!(found[0].iter().all(|w| *w >= 0.0), "{found:?}");
        }
    }

    #[test]
    fn groups_count_where_motions_left_out_agree_on_them() {
        let same = vec![motion(&[[1.0, 0.0], [0.0, 1.0]]); 4];
        let by_group = Gain::measure(&same, Freedom::ByGroup);
        let common = Gain::measure(&same, Freedom::Common);
        assert!(by_group.mean > 1.5 * common.mean && by_group.is_significant());
        let alone = Gain::measure(&same[..1], Freedom::ByGroup);
        assert!(alone.mean == 0.0 && !alone.is_significant());
        // Motions that ask for opposite weights.
        let opposite = [motion(&[[0.9, 0.1]]), motion(&[[0.1, 0.9]])];
        assert!(!Gain::measure(&opposite, Freedom::ByGroup).is_significant());
    }
}
