//! Sizes and steps of a field that a time has room for.

use crate::sizing::{LEAST_STEPS, rungs};

/// Durations that a plan is made from, in seconds.
pub(super) struct FieldPace {
    /// Optimiser step of each size of the settings, from small to large.
    pub(super) step_by_size: Vec<f64>,
    /// Judgement of one candidate on all folds.
    pub(super) judgement: f64,
    /// Measurements and validations of the run's fits.
    pub(super) validation: f64,
    /// Number of folds of a sizing.
    pub(super) folds: usize,
    /// Number of fits of the run.
    pub(super) fits: usize,
}

/// Plan of a run's field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct FieldPlan {
    /// Number of sizes that are tried, the smallest ones.
    pub(super) sizes: usize,
    /// Largest number of steps.
    pub(super) steps: u64,
}

/// Factor between the numbers of steps that are considered.
const SHRINK: f64 = 0.9;

impl FieldPace {
    /// The plan with most sizes, and of these most steps up to `most`, that takes at most `seconds`
    /// if every rung is reached. Returns none where not even the smallest size fits.
    pub(super) fn plan(&self, seconds: f64, most: u64) -> Option<FieldPlan> {
        let least = most.min(LEAST_STEPS);
        let steps = std::iter::successors(Some(most), |steps| Some((*steps as f64 * SHRINK) as u64));
        let steps: Vec<u64> = steps.take_while(|steps| *steps >= least.max(1)).collect();
        let sizes = (1..=self.step_by_size.len()).rev();
        let plans = sizes.flat_map(|sizes| steps.iter().map(move |&steps| FieldPlan { sizes, steps }));
        plans.into_iter().find(|plan| self.seconds(*plan) <= seconds)
    }

    /// Seconds of a plan in which the largest sizes climb all rungs, and the largest one is chosen.
    fn seconds(&self, plan: FieldPlan) -> f64 {
        let mut left = &self.step_by_size[..plan.sizes];
        let mut seconds = self.validation;
        for steps in rungs(plan.steps) {
            let in_a_step: f64 = left.iter().sum();
            seconds += self.folds as f64 * steps as f64 * in_a_step + left.len() as f64 * self.judgement;
            left = &left[left.len() / 2..];
        }
        let largest = left.last().copied().unwrap_or(0.0);
        seconds + self.fits as f64 * plan.steps as f64 * largest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pace() -> FieldPace {
        FieldPace {
            step_by_size: vec![0.1, 0.2, 0.5],
            judgement: 1.0,
            validation: 10.0,
            folds: 3,
            fits: 2,
        }
    }

    #[test]
    fn plans_cost_what_they_say() {
        // 10 s, three sizes for 100 steps on three folds, three judgements, two fits.
        let all = FieldPlan { sizes: 3, steps: 100 };
        assert!((pace().seconds(all) - (10.0 + 240.0 + 3.0 + 100.0)).abs() < 1e-9);
        // A second rung has two of the three.
        let longer = FieldPlan { sizes: 3, steps: 300 };
        let second = 3.0 * 300.0 * 0.7 + 2.0;
        assert!((pace().seconds(longer) - (10.0 + 240.0 + 3.0 + second + 300.0)).abs() < 1e-9);
    }

    #[test]
    fn short_times_try_fewer_steps_then_fewer_sizes() {
        let plan = |seconds| pace().plan(seconds, 1000);
        assert_eq!(
            plan(1e9),
            Some(FieldPlan {
                sizes: 3,
                steps: 1000
            })
        );
        let shorter = plan(1500.0).unwrap();
        assert!(shorter.sizes == 3 && shorter.steps < 1000 && pace().seconds(shorter) <= 1500.0);
        assert_eq!(plan(300.0).unwrap().sizes, 2);
        assert_eq!(plan(100.0).unwrap().sizes, 1);
        assert_eq!(plan(30.0), None);
        // Settings with few steps are no reason to try nothing.
        assert_eq!(pace().plan(1e9, 5), Some(FieldPlan { sizes: 3, steps: 5 }));
    }
}
