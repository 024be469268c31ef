//! Linear maps from motion vectors to coefficients, with and without each motion.

use super::series::Series;
use rayon::prelude::*;
use unic_core::network::Linear;
use unic_eval::{LinearMap, Moments};

/// Ridge strengths to choose from, in units of an input's variance.
const STRENGTHS: [f64; 9] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

/// Strength where there is nothing to choose it by.
pub(super) const MIDDLE_STRENGTH: f64 = STRENGTHS[STRENGTHS.len() / 2];

/// Linear map of all series, and of all but those of each motion.
pub(super) struct LeaveOneOut {
    /// Map fitted to all motions.
    pub(super) all: Option<LinearMap>,
    /// Maps, one per motion, each fitted to all other motions.
    pub(super) maps: Vec<Option<LinearMap>>,
}

impl LeaveOneOut {
    /// Fits ridge regressions whose strength has the least error on motions left out.
    pub(super) fn fit(series: &[Series]) -> Self {
        let moments: Vec<Moments> = series.iter().map(Series::moments).collect();
        let pooled = |left_out: Option<usize>| {
            let kept = (moments.iter().zip(series)).filter(|(_, s)| Some(s.motion_number()) != left_out);
            Moments::pooled(kept.map(|(m, _)| m))
        };
        let motions = series.iter().map(|s| s.motion_number() + 1).max().unwrap_or(0);
        let folds: Vec<Option<Moments>> = (0..motions).map(|motion| pooled(Some(motion))).collect();
        let at = |strength: f64| -> Self {
            let solved = |m: &Option<Moments>| m.as_ref().and_then(|m| m.solve(strength));
            Self {
                all: None,
                maps: folds.par_iter().map(solved).collect(),
            }
        };
        let error = |strength: f64| -> f64 {
            let fitted = at(strength);
            let squared = |s: &Series| s.residual(fitted.without(s)).map(|e| e * e).sum::<f64>();
            // Collected first and summed in order: the result does not depend on the number of
            // threads.
            let errors: Vec<f64> = series.par_iter().map(squared).collect();
            errors.into_iter().sum()
        };
        let errors = STRENGTHS.map(|strength| (error(strength), strength));
        let best = errors.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let strength = best.map_or(MIDDLE_STRENGTH, |best| best.1);
        Self {
            all: pooled(None).and_then(|m| m.solve(strength)),
            ..at(strength)
        }
    }

    /// The map fitted without the motion of `series`.
    pub(super) fn without(&self, series: &Series) -> Option<&LinearMap> {
        self.maps[series.motion_number()].as_ref()
    }
}

/// Converts a map to the runtime's form. Without a map, all coefficients are zero.
pub(super) fn runtime_map(map: Option<&LinearMap>, inputs: usize, outputs: usize) -> Linear {
    let weight = |(k, i)| map.map_or(0.0, |m| m.coefficient(i, k) as f32);
    // The value of an affine map at zero is its constant part.
    let bias = map.map_or_else(|| vec![0.0; outputs], |m| m.apply(&vec![0.0; inputs]));
    Linear {
        inputs,
        outputs,
        weight: (0..outputs)
            .flat_map(|k| (0..inputs).map(move |i| (k, i)))
            .map(weight)
            .collect(),
        bias: bias.into_iter().map(|b| b as f32).collect(),
    }
}
