//! Sizes of a recurrent unit, and its conversion to the runtime's form.

use super::sequence::Sequence;
use crate::{config::RecurrenceSettings, layers::transposed};
use unic_core::{network::Linear, recurrence::Recurrence};

/// Smallest share of its state that an oscillator forgets in a tick. Much smaller ones round to
/// none in f32.
pub(super) const LEAST_RATE: f32 = 1e-3;

/// Sizes of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sizes {
    /// Numbers in a pair of motion vectors.
    pub(super) inputs: usize,
    /// Width of the embedding and of the hidden layer.
    pub(super) width: usize,
    /// Oscillators M.
    pub(super) oscillators: usize,
    /// Coefficients K.
    pub(super) outputs: usize,
}

impl Sizes {
    /// Sizes of a unit that is trained on sequences like this one.
    pub(super) fn new(settings: &RecurrenceSettings, sequence: &Sequence) -> Self {
        Self {
            inputs: 2 * sequence.motion.len,
            width: settings.width,
            oscillators: settings.oscillators,
            outputs: sequence.outputs(),
        }
    }

    /// Inputs and outputs of the linear maps, in the order of [`Recurrence::layers`].
    pub(super) fn maps(self) -> [(usize, usize); 5] {
        let (width, state) = (self.width, 2 * self.oscillators);
        [
            (self.inputs, width),
            (width, state),
            (state, width),
            (2 * width, width),
            (width, self.outputs),
        ]
    }

    /// Converts a unit's parameters to the runtime's form. One unit of output is `scale` metres.
    pub(super) fn recurrence(self, values: &[Vec<f32>], scale: f32) -> Recurrence {
        let (rates, angles) = (&values[0], &values[1]);
        let decays: Vec<f32> = (rates.iter().map(|rate| (-rate.exp().max(LEAST_RATE)).exp())).collect();
        let (weights, biases) = values[2..].split_at(self.maps().len());
        let maps = self.maps();
        let [embedding, mut drive, memory, hidden, mut head] = std::array::from_fn(|i| Linear {
            inputs: maps[i].0,
            outputs: maps[i].1,
            weight: transposed(&weights[i], maps[i].1),
            bias: biases[i].clone(),
        });
        let gains = decays.iter().map(|decay| (1.0 - decay.powi(2)).sqrt());
        let gains: Vec<f32> = gains.cycle().take(drive.outputs).collect();
        // Both factors are folded into the weights: a frame at runtime does not compute them.
        drive.scale_outputs(&gains);
        head.scale(scale);
        let pole = |(decay, angle): (&f32, &f32)| [decay * angle.cos(), decay * angle.sin()];
        Recurrence {
            poles: decays.iter().zip(angles).map(pole).collect(),
            embedding,
            drive,
            memory,
            hidden,
            head,
        }
    }
}
