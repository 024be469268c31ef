//! Linear maps from motion vectors to coefficients.

use unic_core::network::Linear;
use unic_eval::LinearMap;

/// Ridge strengths to choose from, in units of an input's variance.
pub(super) const STRENGTHS: [f64; 9] = [0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0];

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
