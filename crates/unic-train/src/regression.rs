//! Ridge regressions whose strength is the best one for motions left out.

use rayon::prelude::*;
use std::collections::BTreeSet;
use unic_eval::{LinearMap, Moments};

/// Inputs and outputs in consecutive frames of one motion.
pub(crate) trait Pairs: Sync {
    /// Number of the motion.
    fn motion_number(&self) -> usize;

    /// Sums over the frames.
    fn moments(&self) -> Moments;

    /// Square of what a map leaves of the outputs, summed over frames and outputs. Without a map,
    /// that of the outputs.
    fn squared_error(&self, map: Option<&LinearMap>) -> f64;
}

/// Map fitted to all pairs, and to all but those of each motion.
pub(crate) struct LeaveOneOut {
    /// Map fitted to all motions.
    pub(crate) all: Option<LinearMap>,
    /// Maps, one per motion, each fitted to all other motions.
    pub(crate) maps: Vec<Option<LinearMap>>,
}

impl LeaveOneOut {
    /// Fits the maps with the strength that has the least error on motions left out. A lone motion
    /// has the strength in the middle.
    pub(crate) fn fit<P: Pairs>(pairs: &[P], strengths: &[f64]) -> Self {
        let moments: Vec<Moments> = pairs.par_iter().map(P::moments).collect();
        let pooled = |left_out: Option<usize>| {
            let kept = (moments.iter().zip(pairs)).filter(|(_, p)| Some(p.motion_number()) != left_out);
            Moments::pooled(kept.map(|(m, _)| m))
        };
        let motions: BTreeSet<usize> = pairs.iter().map(P::motion_number).collect();
        let numbers = 0..motions.last().map_or(0, |last| last + 1);
        let folds: Vec<Option<Moments>> = numbers.map(|motion| pooled(Some(motion))).collect();
        let at = |strength: f64| -> Self {
            let solved = |m: &Option<Moments>| m.as_ref().and_then(|m| m.solve(strength));
            Self {
                all: None,
                maps: folds.par_iter().map(solved).collect(),
            }
        };
        let error = |strength: f64| -> f64 {
            let fitted = at(strength);
            let squared = |p: &P| p.squared_error(fitted.without(p));
            // Collected first and summed in order: the result does not depend on the number of
            // threads.
            let errors: Vec<f64> = pairs.par_iter().map(squared).collect();
            errors.into_iter().sum()
        };
        let strength = match motions.len() {
            0 | 1 => middle(strengths),
            _ => {
                let errors = strengths.iter().map(|strength| (error(*strength), *strength));
                let best = errors.min_by(|a, b| a.0.total_cmp(&b.0));
                best.map_or_else(|| middle(strengths), |best| best.1)
            }
        };
        Self {
            all: pooled(None).and_then(|m| m.solve(strength)),
            ..at(strength)
        }
    }

    /// The map fitted without the motion of `pairs`.
    pub(crate) fn without(&self, pairs: &impl Pairs) -> Option<&LinearMap> {
        self.maps[pairs.motion_number()].as_ref()
    }
}

/// Strength where there is nothing to choose it by.
pub(crate) fn middle(strengths: &[f64]) -> f64 {
    strengths.get(strengths.len() / 2).copied().unwrap_or(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs y = 2 x + noise, where the noise of a motion is constant.
    struct Line {
        motion: usize,
        noise: f64,
    }

    const FRAMES: usize = 20;

    impl Line {
        fn rows(&self) -> [Vec<f64>; 2] {
            let x = (0..FRAMES).map(|t| ((t + 5 * self.motion) as f64).sin());
            let y = x.clone().map(|x| 2.0 * x + self.noise);
            [x.collect(), y.collect()]
        }
    }

    impl Pairs for Line {
        fn motion_number(&self) -> usize {
            self.motion
        }

        fn moments(&self) -> Moments {
            let [x, y] = self.rows();
            Moments::new(&x, &y, FRAMES)
        }

        fn squared_error(&self, map: Option<&LinearMap>) -> f64 {
            let [x, y] = self.rows();
            let predicted = map.map_or_else(|| vec![0.0; FRAMES], |m| m.apply_rows(&x));
            y.iter().zip(predicted).map(|(y, p)| (y - p).powi(2)).sum()
        }
    }

    #[test]
    fn the_strength_is_the_best_for_motions_left_out_and_the_middle_for_a_lone_one() {
        let lines = [0, 2, 3].map(|motion| Line {
            motion,
            noise: 0.01 * motion as f64,
        });
        let strengths = [1e-6, 1.0, 100.0];
        let fitted = LeaveOneOut::fit(&lines, &strengths);
        let slope = fitted.all.unwrap().coefficient(0, 0);
        assert!((slope - 2.0).abs() < 0.05, "{slope}");
        // Numbers of motions that are not there have a map of all.
        assert_eq!(fitted.maps.len(), 4);
        let alone = LeaveOneOut::fit(&lines[..1], &strengths);
        assert!(alone.maps[0].is_none());
        let slope = alone.all.unwrap().coefficient(0, 0);
        assert!(slope < 1.5, "{slope} of the strength in the middle");
        assert!(LeaveOneOut::fit::<Line>(&[], &strengths).all.is_none());
    }
}
