//! Linear recurrent unit of the prior, which remembers the motion up to now: swing, lag and
//! flutter.
//!
//! For training and tools. [`Prior`](crate::prior::Prior) holds it in a model.

use crate::network::{LayerError, LayerSize, Linear, apply, check_layers, elu};

/// Linear recurrent unit (Orvieto et al. 2023) that adds to the coefficients of a
/// [`Prior`](crate::prior::Prior).
///
/// It has M oscillators, each a complex number with h_t = λ h_{t−1} + u_t. The pole λ sets
/// frequency and damping, and the motion drives the oscillator by u. For a normalised pair of
/// motion vectors c:
///
/// - embedding e = elu(E c),
/// - drive u = Q e,
/// - memory m = elu(X h),
/// - added coefficients Z elu(Y (m, e)).
///
/// All poles have |λ| < 1, so that |h| ≤ max|u| / (1 − |λ|) for ever. The initial state decays: two
/// motions that become the same give the same garment in the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Recurrence {
    /// Poles λ = (re, im) of the oscillators, for one tick of the model.
    pub poles: Vec<[f32; 2]>,
    /// Map E from a pair of motion vectors, 2 D numbers, to the embedding.
    pub embedding: Linear,
    /// Map Q from the embedding to 2 M drives, real parts before imaginary parts.
    pub drive: Linear,
    /// Map X from the state, 2 M numbers in the same order, to the hidden width.
    pub memory: Linear,
    /// Map Y from memory and embedding, side by side, to the hidden width.
    pub hidden: Linear,
    /// Map Z from the hidden width to K coefficients.
    pub head: Linear,
}

/// Scratch memory of one tick of a [`Recurrence`].
#[derive(Clone, Debug, Default)]
pub struct RecurrenceScratch {
    /// Embedding e of the motion that was read last.
    embedding: Vec<f32>,
    /// Drive u.
    drive: Vec<f32>,
    /// Memory m and embedding e, side by side.
    joined: Vec<f32>,
    /// Input of the head.
    hidden: Vec<f32>,
    /// Output of the head.
    added: Vec<f32>,
}

impl Recurrence {
    /// Length 2 M of the state: real parts before imaginary parts.
    pub fn state_len(&self) -> usize {
        2 * self.poles.len()
    }

    /// Lists the linear maps with their names in a model file.
    pub fn layers(&self) -> [(&'static str, &Linear); 5] {
        [
            ("embedding", &self.embedding),
            ("drive", &self.drive),
            ("memory", &self.memory),
            ("hidden", &self.hidden),
            ("head", &self.head),
        ]
    }

    /// Returns true if all poles lie within the unit circle.
    pub fn is_stable(&self) -> bool {
        // False for NaN.
        self.poles.iter().all(|[re, im]| re.hypot(*im) < 1.0)
    }

    /// Checks that the maps fit together, for motion pairs of `inputs` numbers and `outputs`
    /// coefficients.
    ///
    /// # Errors
    /// A map of another size than its neighbours ask for.
    pub fn check(&self, inputs: usize, outputs: usize) -> Result<(), LayerError> {
        let (embedding, hidden, state) = (self.embedding.outputs, self.memory.outputs, self.state_len());
        let size = |inputs: usize, outputs: usize| LayerSize { inputs, outputs };
        let sizes = [
            size(inputs, embedding),
            size(embedding, state),
            size(state, hidden),
            size(hidden + embedding, hidden),
            size(hidden, outputs),
        ];
        for ((name, layer), size) in self.layers().into_iter().zip(sizes) {
            check_layers(
                &format!("recurrence.{name}"),
                std::slice::from_ref(layer),
                &[size],
            )?;
        }
        Ok(())
    }

    /// Computes the embedding of a normalised pair of motion vectors, which the other calls use.
    pub fn embed(&self, pair: &[f32], scratch: &mut RecurrenceScratch) {
        map_into(&self.embedding, pair, &mut scratch.embedding);
        scratch.embedding.iter_mut().for_each(|x| *x = elu(*x));
    }

    /// Writes the steady state of the embedded motion: h = u / (1 − λ).
    pub fn start(&self, scratch: &mut RecurrenceScratch, state: &mut Vec<f32>) {
        state.clear();
        state.resize(self.state_len(), 0.0);
        self.for_each_oscillator(scratch, state, |[re, im], u, h| {
            // Complex division by 1 − λ. The norm is above zero, for |λ| < 1.
            let (a, b) = (1.0 - re, -im);
            let norm = a * a + b * b;
            *h = [(u[0] * a + u[1] * b) / norm, (u[1] * a - u[0] * b) / norm];
        });
    }

    /// Advances the state by one tick, driven by the embedded motion.
    ///
    /// `state` has [`state_len`](Self::state_len) numbers.
    pub fn advance(&self, scratch: &mut RecurrenceScratch, state: &mut [f32]) {
        self.for_each_oscillator(scratch, state, |[re, im], u, h| {
            // h = λ h + u.
            *h = [re * h[0] - im * h[1] + u[0], re * h[1] + im * h[0] + u[1]];
        });
    }

    /// Computes the drive and calls `update` with pole, drive and state of each oscillator.
    fn for_each_oscillator(
        &self,
        scratch: &mut RecurrenceScratch,
        state: &mut [f32],
        update: impl Fn([f32; 2], [f32; 2], &mut [f32; 2]),
    ) {
        let RecurrenceScratch { embedding, drive, .. } = scratch;
        map_into(&self.drive, embedding, drive);
        let count = self.poles.len();
        for (k, &pole) in self.poles.iter().enumerate() {
            let mut h = [state[k], state[count + k]];
            update(pole, [drive[k], drive[count + k]], &mut h);
            [state[k], state[count + k]] = h;
        }
    }

    /// Adds the coefficients for the state and the embedded motion to K `coefficients`.
    pub fn add_to(&self, state: &[f32], scratch: &mut RecurrenceScratch, coefficients: &mut [f32]) {
        self.hidden(state, scratch);
        let RecurrenceScratch { hidden, added, .. } = scratch;
        map_into(&self.head, hidden, added);
        coefficients.iter_mut().zip(added).for_each(|(a, z)| *a += *z);
    }

    /// Computes the input elu(Y (m, e)) of the head for the state and the embedded motion.
    pub fn hidden<'a>(&self, state: &[f32], scratch: &'a mut RecurrenceScratch) -> &'a [f32] {
        let RecurrenceScratch {
            embedding,
            joined,
            hidden,
            ..
        } = scratch;
        map_into(&self.memory, state, joined);
        joined.iter_mut().for_each(|x| *x = elu(*x));
        // `map_into` has resized `joined` to the memory, after which the embedding follows.
        joined.extend_from_slice(embedding);
        map_into(&self.hidden, joined, hidden);
        hidden.iter_mut().for_each(|x| *x = elu(*x));
        hidden
    }
}

/// Resizes `output` and writes W x + b.
fn map_into(layer: &Linear, input: &[f32], output: &mut Vec<f32>) {
    output.resize(layer.outputs, 0.0);
    apply(layer, input, output);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn linear(outputs: usize, inputs: usize, weight: &[f32]) -> Linear {
        Linear {
            inputs,
            outputs,
            weight: weight.to_vec(),
            bias: vec![0.0; outputs],
        }
    }

    /// One oscillator with a period of 20 ticks, driven by one number; its output is its real part.
    fn pendulum(decay: f32) -> Recurrence {
        let angle = std::f32::consts::TAU / 20.0;
        Recurrence {
            poles: vec![[decay * angle.cos(), decay * angle.sin()]],
            embedding: linear(1, 1, &[1.0]),
            drive: linear(2, 1, &[1.0, 0.0]),
            memory: linear(1, 2, &[1.0, 0.0]),
            hidden: linear(1, 2, &[1.0, 0.0]),
            head: linear(1, 1, &[1.0]),
        }
    }

    /// Returns the output for `ticks` ticks with a drive of 1 and as many with a drive of 0.
    fn step_response(unit: &Recurrence, ticks: usize) -> Vec<f32> {
        let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
        unit.embed(&[1.0], &mut scratch);
        unit.start(&mut scratch, &mut state);
        let drive = (0..2 * ticks).map(|t| if t < ticks { 1.0 } else { 0.0 });
        let tick = |c: f32| {
            unit.embed(&[c], &mut scratch);
            unit.advance(&mut scratch, &mut state);
            let mut a = [0.0];
            unit.add_to(&state, &mut scratch, &mut a);
            a[0]
        };
        drive.map(tick).collect()
    }

    #[test]
    fn a_steady_motion_gives_a_steady_state_and_a_stop_rings_at_the_pole() {
        let unit = pendulum(0.95);
        unit.check(1, 1).unwrap();
        assert!(unit.is_stable());
        let a = step_response(&unit, 60);
        // The real part of 1 / (1 − λ).
        let [re, im] = unit.poles[0];
        let steady = (1.0 - re) / ((1.0 - re).powi(2) + im * im);
        assert!(a[..60].iter().all(|a| (a - steady).abs() < 1e-5), "{a:?}");
        // ELU changes negative values, so that peaks are compared: one a period, smaller by λ^20.
        let peaks: Vec<usize> = (62..118)
            .filter(|&t| a[t] > a[t - 1] && a[t] > a[t + 1])
            .collect();
        assert!(
            peaks.windows(2).all(|w| w[1] - w[0] == 20) && peaks.len() == 3,
            "{peaks:?}"
        );
        let shrunk = a[peaks[1]] / a[peaks[0]];
        assert!((shrunk - 0.95f32.powi(20)).abs() < 1e-3, "{shrunk}");
    }

    #[test]
    fn the_initial_state_decays() {
        let unit = pendulum(0.9);
        let mut ends = [vec![], vec![]];
        for (past, end) in [-50.0, 3.0].into_iter().zip(&mut ends) {
            let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
            unit.embed(&[past], &mut scratch);
            unit.start(&mut scratch, &mut state);
            unit.embed(&[1.0], &mut scratch);
            (0..300).for_each(|_| unit.advance(&mut scratch, &mut state));
            *end = state;
        }
        let gap = |k: usize| (ends[0][k] - ends[1][k]).abs();
        assert!(gap(0) < 1e-5 && gap(1) < 1e-5, "{ends:?}");
    }

    #[test]
    fn wrong_sizes_and_unstable_poles_are_refused() {
        assert!(!pendulum(1.0).is_stable());
        assert!(!pendulum(f32::NAN).is_stable());
        assert!(pendulum(0.5).check(2, 1).is_err());
        assert!(pendulum(0.5).check(1, 3).is_err());
        let mut unit = pendulum(0.5);
        unit.poles.push([0.0, 0.0]);
        assert!(unit.check(1, 1).unwrap_err().layer.contains("recurrence.drive"));
    }
}
