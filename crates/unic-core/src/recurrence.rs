//! What the motion up to now says about the garment: swing, lag and flutter.

use crate::network::{LayerError, Linear, apply, check_layers, elu};

/// A linear recurrent unit (Orvieto et al. 2023) that adds to the coefficients of a
/// [`Prior`](crate::prior::Prior).
///
/// Each of M oscillators is a complex number h with h_t = λ h_{t−1} + u_t: its pole λ says how
/// fast it swings and how soon it forgets, and the motion drives it by u. Of the normalised motion
/// pair c, with e = elu(E c), the drive is u = Q e; with m = elu(X h), what it adds is
/// Z elu(Y (m, e)).
///
/// |λ| < 1, so |h| ≤ max|u| / (1 − |λ|) for ever, and all that has happened is forgotten: two
/// histories that end in the same motion end in the same garment.
#[derive(Clone, Debug, PartialEq)]
pub struct Recurrence {
    /// λ = (re, im) of each oscillator for one tick of the model.
    pub poles: Vec<[f32; 2]>,
    /// E: a motion pair, 2 D numbers, to the embedding.
    pub embedding: Linear,
    /// Q: to 2 M numbers, real parts before imaginary ones.
    pub drive: Linear,
    /// X: 2 M numbers in that order to the hidden width.
    pub memory: Linear,
    /// Y: hidden width and embedding, side by side, to the hidden width.
    pub hidden: Linear,
    /// Z: to K coefficients.
    pub head: Linear,
}

/// Buffers of one tick.
#[derive(Clone, Debug, Default)]
pub struct RecurrenceScratch {
    embedding: Vec<f32>,
    drive: Vec<f32>,
    joined: Vec<f32>,
    hidden: Vec<f32>,
    part: Vec<f32>,
}

impl Recurrence {
    /// Numbers of the state: 2 M, real parts before imaginary ones.
    pub fn state_len(&self) -> usize {
        2 * self.poles.len()
    }

    /// The linear maps by name.
    pub fn layers(&self) -> [(&'static str, &Linear); 5] {
        [
            ("embedding", &self.embedding),
            ("drive", &self.drive),
            ("memory", &self.memory),
            ("hidden", &self.hidden),
            ("head", &self.head),
        ]
    }

    /// Do all poles forget?
    pub fn is_stable(&self) -> bool {
        self.poles.iter().all(|[re, im]| re.hypot(*im) < 1.0)
    }

    /// Sizes for motion pairs of `inputs` numbers and `outputs` coefficients.
    ///
    /// # Errors
    /// A map of another size than its neighbours ask for.
    pub fn check(&self, inputs: usize, outputs: usize) -> Result<(), LayerError> {
        let (embedding, hidden, state) = (self.embedding.outputs, self.memory.outputs, self.state_len());
        let sizes = [
            (inputs, embedding),
            (embedding, state),
            (state, hidden),
            (hidden + embedding, hidden),
            (hidden, outputs),
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

    /// Reads a normalised pair of motion vectors: what the other calls refer to.
    pub fn read(&self, pair: &[f32], scratch: &mut RecurrenceScratch) {
        map_into(&self.embedding, pair, &mut scratch.embedding);
        scratch.embedding.iter_mut().for_each(|x| *x = elu(*x));
    }

    /// The state as if the motion had been what was read for ever: h = u / (1 − λ).
    pub fn start(&self, scratch: &mut RecurrenceScratch, state: &mut Vec<f32>) {
        state.clear();
        state.resize(self.state_len(), 0.0);
        self.for_each_oscillator(scratch, state, |[re, im], u, h| {
            let (a, b) = (1.0 - re, -im);
            let norm = a * a + b * b;
            *h = [(u[0] * a + u[1] * b) / norm, (u[1] * a - u[0] * b) / norm];
        });
    }

    /// One tick, driven by what was read; `state` has [`state_len`](Self::state_len) numbers.
    pub fn advance(&self, scratch: &mut RecurrenceScratch, state: &mut [f32]) {
        self.for_each_oscillator(scratch, state, |[re, im], u, h| {
            *h = [re * h[0] - im * h[1] + u[0], re * h[1] + im * h[0] + u[1]];
        });
    }

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

    /// Adds its part in this state to K coefficients.
    pub fn add_to(&self, state: &[f32], scratch: &mut RecurrenceScratch, coefficients: &mut [f32]) {
        let RecurrenceScratch {
            embedding,
            joined,
            hidden,
            part,
            ..
        } = scratch;
        map_into(&self.memory, state, joined);
        joined.iter_mut().for_each(|x| *x = elu(*x));
        joined.extend_from_slice(embedding);
        map_into(&self.hidden, joined, hidden);
        hidden.iter_mut().for_each(|x| *x = elu(*x));
        map_into(&self.head, hidden, part);
        coefficients.iter_mut().zip(part).for_each(|(a, z)| *a += *z);
    }
}

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

    /// One oscillator that swings once in 20 ticks, driven by a number, read as it is.
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

    /// Corrections while the drive is 1, then as many while it is 0.
    fn swing(unit: &Recurrence, ticks: usize) -> Vec<f32> {
        let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
        unit.read(&[1.0], &mut scratch);
        unit.start(&mut scratch, &mut state);
        let drive = (0..2 * ticks).map(|t| if t < ticks { 1.0 } else { 0.0 });
        let tick = |c: f32| {
            unit.read(&[c], &mut scratch);
            unit.advance(&mut scratch, &mut state);
            let mut a = [0.0];
            unit.add_to(&state, &mut scratch, &mut a);
            a[0]
        };
        drive.map(tick).collect()
    }

    #[test]
    fn a_steady_motion_is_steady_and_a_stop_rings_at_the_poles_rate() {
        let unit = pendulum(0.95);
        unit.check(1, 1).unwrap();
        assert!(unit.is_stable());
        let a = swing(&unit, 60);
        // Re 1 / (1 − λ), by hand.
        let [re, im] = unit.poles[0];
        let steady = (1.0 - re) / ((1.0 - re).powi(2) + im * im);
        assert!(a[..60].iter().all(|a| (a - steady).abs() < 1e-5), "{a:?}");
        // ELU bends what is below zero, so peaks are compared: one a period, smaller by λ^20.
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
    fn what_has_happened_is_forgotten() {
        let unit = pendulum(0.9);
        let mut ends = [vec![], vec![]];
        for (past, end) in [-50.0, 3.0].into_iter().zip(&mut ends) {
            let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
            unit.read(&[past], &mut scratch);
            unit.start(&mut scratch, &mut state);
            unit.read(&[1.0], &mut scratch);
            (0..300).for_each(|_| unit.advance(&mut scratch, &mut state));
            *end = state;
        }
        let gap = |k: usize| (ends[0][k] - ends[1][k]).abs();
        assert!(gap(0) < 1e-5 && gap(1) < 1e-5, "{ends:?}");
    }

    #[test]
    fn sizes_and_poles_that_do_not_fit_are_refused() {
        assert!(!pendulum(1.0).is_stable());
        assert!(!pendulum(f32::NAN).is_stable());
        assert!(pendulum(0.5).check(2, 1).is_err());
        assert!(pendulum(0.5).check(1, 3).is_err());
        let mut unit = pendulum(0.5);
        unit.poles.push([0.0, 0.0]);
        assert!(unit.check(1, 1).unwrap_err().layer.contains("recurrence.drive"));
    }
}
