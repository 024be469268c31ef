//! Optimality of the weights; what a fit finds in motion is in `tests/skinning.rs`.

use super::*;
use proptest::prelude::*;

const JOINTS: usize = 4;

proptest! {
    /// No weight can move from one joint to another with a gain, and none is negative.
    #[test]
    fn weights_are_optimal(
        factors in proptest::collection::vec(-1.0f64..1.0, JOINTS * JOINTS),
        targets in proptest::collection::vec(-2.0f64..2.0, JOINTS),
        parts in proptest::collection::vec(0.0f64..1.0, JOINTS),
    ) {
        let sum: f64 = parts.iter().sum();
        prop_assume!(sum > 0.1);
        let given: Vec<f64> = parts.iter().map(|part| part / sum).collect();
        let row = |j: usize| &factors[j * JOINTS..(j + 1) * JOINTS];
        let dot = |j: usize, k: usize| row(j).iter().zip(row(k)).map(|(a, b)| a * b).sum::<f64>();
        let problem = SimplexProblem {
            squares: (0..JOINTS).map(|j| (0..JOINTS).map(|k| dot(j, k)).collect()).collect(),
            targets,
            given: &given,
            stiffness: 0.01,
        };
        let mut weights = given.clone();
        problem.solve(&mut weights);
        prop_assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        let slopes = problem.slopes(&weights);
        for from in 0..JOINTS {
            prop_assert!(weights[from] >= 0.0);
            if weights[from] < 1e-6 {
                continue;
            }
            for to in 0..JOINTS {
                let gain = slopes[from] - slopes[to];
                prop_assert!(gain < 1e-5, "from {from} to {to}: {gain}");
            }
        }
    }
}
