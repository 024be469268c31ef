//! A linear recurrent unit in training.

use super::windows::WindowBatch;
use crate::{
    network::{elu, host, parameter, transposed},
    noise::normal,
    stream::{Stream, generator},
};
use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use std::f32::consts::TAU;
use unic_core::{network::Linear, recurrence::Recurrence};

/// Time constants of the oscillators at the start, seconds: from a flutter to a slow slide.
const TIME_CONSTANTS_S: [f32; 2] = [0.05, 2.0];
/// Frequencies that they begin with, in turn, Hz: what cloth swings at, and none.
const FREQUENCIES_HZ: [f32; 8] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0];

/// Share that an oscillator forgets in a tick at least; much less of it is none in f32.
const LEAST_RATE: f32 = 1e-3;

/// Numbers of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Sizes {
    pub(super) inputs: usize,
    pub(super) width: usize,
    pub(super) oscillators: usize,
    pub(super) outputs: usize,
}

impl Sizes {
    /// (inputs, outputs) of the maps, in the order of [`Recurrence::layers`].
    fn maps(self) -> [(usize, usize); 5] {
        let (width, state) = (self.width, 2 * self.oscillators);
        [
            (self.inputs, width),
            (width, state),
            (state, width),
            (2 * width, width),
            (width, self.outputs),
        ]
    }

    /// As the runtime has it, from a unit's [`Unit::values`]; one unit of output is `scale` metres.
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
        let gain = |row: usize| (1.0 - decays[row % self.oscillators].powi(2)).sqrt();
        scale_rows(&mut drive, gain);
        scale_rows(&mut head, |_| scale);
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

fn scale_rows(map: &mut Linear, factor: impl Fn(usize) -> f32) {
    for (row, (weights, bias)) in (map.weight.chunks_exact_mut(map.inputs).zip(&mut map.bias)).enumerate() {
        weights.iter_mut().for_each(|w| *w *= factor(row));
        *bias *= factor(row);
    }
}

/// λ = exp(−exp(rate) + i angle), exp(rate) at least [`LEAST_RATE`]: every value of the parameters
/// forgets.
#[derive(Module, Debug)]
pub(super) struct Unit {
    rates: Param<Tensor<1>>,
    angles: Param<Tensor<1>>,
    /// `[in, out]`, in the order of [`Recurrence::layers`].
    weights: Vec<Param<Tensor<2>>>,
    biases: Vec<Param<Tensor<1>>>,
}

impl Default for Unit {
    /// Nothing: what stands in while a unit is moved out to be updated.
    fn default() -> Self {
        let nothing = |id| parameter(id, vec![0.0], [1], &Device::flex());
        Self {
            rates: nothing(RATES_ID),
            angles: nothing(ANGLES_ID),
            weights: Vec::new(),
            biases: Vec::new(),
        }
    }
}

/// Parameter ids, far from those of [`crate::Network`].
const RATES_ID: u64 = 2000;
const ANGLES_ID: u64 = 2001;
const MAPS_ID: u64 = 2002;

impl Unit {
    /// Weights normal with variance 1 / inputs, the head's a hundredth of it.
    pub(super) fn new(sizes: Sizes, fps: f32, seed: u64, device: &Device) -> Self {
        let count = sizes.oscillators;
        let share = |k: usize| k as f32 / (count - 1).max(1) as f32;
        let [short, long] = TIME_CONSTANTS_S;
        let rate = |k: usize| -(short * (long / short).powf(share(k)) * fps).ln();
        let angle = |k: usize| TAU * FREQUENCIES_HZ[k % FREQUENCIES_HZ.len()] / fps;
        let maps = sizes.maps();
        let last = maps.len() - 1;
        let weights = |(i, (inputs, outputs)): (usize, &(usize, usize))| {
            let mut rng = generator(seed, Stream::Parameters, MAPS_ID + i as u64);
            let gain = if i == last { 0.1 } else { 1.0 } / (*inputs as f32).sqrt();
            let values = (0..inputs * outputs).map(|_| gain * normal(&mut rng)).collect();
            parameter(MAPS_ID + 2 * i as u64, values, [*inputs, *outputs], device)
        };
        let biases = |(i, (_, outputs)): (usize, &(usize, usize))| {
            parameter(
                MAPS_ID + 2 * i as u64 + 1,
                vec![0.0; *outputs],
                [*outputs],
                device,
            )
        };
        Self {
            rates: parameter(RATES_ID, (0..count).map(rate).collect(), [count], device),
            angles: parameter(ANGLES_ID, (0..count).map(angle).collect(), [count], device),
            weights: maps.iter().enumerate().map(weights).collect(),
            biases: maps.iter().enumerate().map(biases).collect(),
        }
    }

    /// Rates, angles, all weights, all biases: the order of the module's parameters.
    pub(super) fn values(&self) -> Vec<Vec<f32>> {
        let value = |p| host(String::new(), p).values;
        let weights = self.weights.iter().map(|w| host(String::new(), w).values);
        [value(&self.rates), value(&self.angles)]
            .into_iter()
            .chain(weights)
            .chain(self.biases.iter().map(value))
            .collect()
    }

    /// Mean over frames and windows of the squared error, summed over the outputs.
    pub(super) fn loss(&self, batch: &WindowBatch, device: &Device) -> Tensor<1> {
        let error =
            self.outputs(batch, device) - tensor(&batch.targets, batch.shape(batch.sizes.outputs), device);
        error.powi_scalar(2).mean() * batch.sizes.outputs as f64
    }

    /// `[frames, windows, outputs]`.
    fn outputs(&self, batch: &WindowBatch, device: &Device) -> Tensor<3> {
        let inputs = tensor(&batch.inputs, batch.shape(batch.sizes.inputs), device);
        let [inputs_mask, embedding_mask, memory_mask] = &batch.masks;
        let of_windows = |mask: &[f32]| {
            tensor(
                mask,
                [1, batch.windows, mask.len() / batch.windows.max(1)],
                device,
            )
        };
        let embedding = elu(self.map(0, inputs * of_windows(inputs_mask))) * of_windows(embedding_mask);
        let [re, im] = self.remembered(self.map(1, embedding.clone()));
        let memory = elu(self.map(2, Tensor::cat(vec![re, im], 2))) * of_windows(memory_mask);
        let hidden = elu(self.map(3, Tensor::cat(vec![memory, embedding], 2)));
        self.map(4, hidden)
    }

    fn map(&self, i: usize, x: Tensor<3>) -> Tensor<3> {
        let [frames, windows, inputs] = x.dims();
        let y = x
            .reshape([frames * windows, inputs])
            .matmul(self.weights[i].val())
            + self.biases[i].val().unsqueeze::<2>();
        let outputs = y.dims()[1];
        y.reshape([frames, windows, outputs])
    }

    /// States of the oscillators `[frames, windows, M]`, real and imaginary parts, for their drive
    /// `[frames, windows, 2 M]`.
    ///
    /// h_t = Σ_s λ^s u_{t−s}, by doubling: sums over d ticks make sums over 2 d ticks.
    fn remembered(&self, drive: Tensor<3>) -> [Tensor<3>; 2] {
        let [frames, _, state] = drive.dims();
        let count = state / 2;
        let rates = self.rates.val().exp().clamp_min(LEAST_RATE);
        let angles = self.angles.val();
        let power = |ticks: f64| -> [Tensor<3>; 2] {
            let decay = (rates.clone() * -ticks).exp();
            let angle = angles.clone() * ticks;
            [decay.clone() * angle.clone().cos(), decay * angle.sin()].map(Tensor::unsqueeze)
        };
        let gain: Tensor<1> = (-(rates.clone() * -2.0).exp() + 1.0).sqrt();
        let gain = gain.unsqueeze::<3>();
        let part = |first: usize| drive.clone().narrow(2, first, count) * gain.clone();
        let mut h = started([part(0), part(count)], power(1.0));
        let mut ticks = 1;
        while ticks < frames {
            let earlier = h.clone().map(|x| later(x, ticks));
            let [re, im] = times(earlier, power(ticks as f64));
            let [h_re, h_im] = h;
            h = [h_re + re, h_im + im];
            ticks *= 2;
        }
        h
    }
}

fn tensor(values: &[f32], shape: [usize; 3], device: &Device) -> Tensor<3> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}

/// The first frame's drive as if it had lasted for ever: u_0 / (1 − λ).
fn started([re, im]: [Tensor<3>; 2], [pole_re, pole_im]: [Tensor<3>; 2]) -> [Tensor<3>; 2] {
    let frames = re.dims()[0];
    let [a, b] = [-pole_re + 1.0, pole_im];
    let norm = a.clone().powi_scalar(2) + b.clone().powi_scalar(2);
    // 1 / (1 − λ) = (a + i b) / |1 − λ|² with 1 − λ = a − i b.
    let inverse = [a / norm.clone(), b / norm];
    let first = times([re.clone().narrow(0, 0, 1), im.clone().narrow(0, 0, 1)], inverse);
    let [first_re, first_im] = first;
    let joined = |first: Tensor<3>, all: Tensor<3>| match frames {
        1 => first,
        _ => Tensor::cat(vec![first, all.narrow(0, 1, frames - 1)], 0),
    };
    [joined(first_re, re), joined(first_im, im)]
}

/// Product of complex numbers.
fn times([a, b]: [Tensor<3>; 2], [c, d]: [Tensor<3>; 2]) -> [Tensor<3>; 2] {
    [a.clone() * c.clone() - b.clone() * d.clone(), a * d + b * c]
}

/// Moved `ticks` frames on, zeros before.
fn later(x: Tensor<3>, ticks: usize) -> Tensor<3> {
    let [frames, ..] = x.dims();
    let kept = x.clone().narrow(0, 0, frames - ticks);
    let zeros = x.narrow(0, 0, ticks).zeros_like();
    Tensor::cat(vec![zeros, kept], 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dataset::MotionVectors, mirror::View, recurrence::Sequence};

    /// Outputs in training against those of the runtime.
    fn check_against_the_runtime(frames: usize) {
        let (len, sizes) = (
            3,
            Sizes {
                inputs: 6,
                width: 5,
                oscillators: 4,
                outputs: 2,
            },
        );
        let mut rng = generator(3, Stream::Recurrence, 0);
        let motion = MotionVectors::of_plain(len, (0..len * frames).map(|_| normal(&mut rng)).collect());
        let sequence = Sequence {
            motion: &motion,
            view: View::Direct,
            frames: 0..frames,
            coefficients: vec![0.0; frames * sizes.outputs],
            linear: vec![0.0; frames * sizes.outputs],
            motion_number: 0,
        };
        let device = Device::flex().autodiff();
        let unit = Unit::new(sizes, 30.0, 1, &device);
        let mut inputs = Vec::new();
        (0..frames).for_each(|t| sequence.write_pair(t, &mut inputs));
        let batch = WindowBatch {
            frames,
            windows: 1,
            sizes,
            inputs,
            targets: sequence.coefficients.clone(),
            masks: [6, 5, 5].map(|width| vec![1.0; width]),
        };
        let trained = unit.outputs(&batch, &device).into_data();
        let trained = trained.try_to_vec::<f32>().unwrap();
        let scale = 0.3;
        let run = sequence.said_by(&sizes.recurrence(&unit.values(), scale));
        let size = run.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        assert!(size > 1e-3, "{size}: nothing is compared");
        for (a, b) in trained.iter().zip(&run) {
            assert!((a * scale - b).abs() < 1e-5, "{a} {b} of {frames} frames");
        }
    }

    #[test]
    fn training_and_runtime_remember_the_same() {
        [1, 2, 20, 64].into_iter().for_each(check_against_the_runtime);
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        let device = Device::flex().autodiff();
        let drive: Vec<f32> = (0..2 * 7).map(|i| (i as f32 * 1.7).sin()).collect();
        let sizes = Sizes {
            inputs: 2,
            width: 2,
            oscillators: 1,
            outputs: 1,
        };
        let unit = Unit::new(sizes, 30.0, 1, &device);
        let of = |unit: &Unit| {
            let [re, im] = unit.remembered(tensor(&drive, [7, 1, 2], &device));
            (re * 0.7 + im * 0.3).powi_scalar(2).sum()
        };
        let gradients = of(&unit).backward();
        let value = |rate: f32, angle: f32| {
            let mut moved = unit.clone();
            moved.rates = parameter(RATES_ID, vec![rate], [1], &device);
            moved.angles = parameter(ANGLES_ID, vec![angle], [1], &device);
            of(&moved).into_scalar::<f32>()
        };
        let (rate, angle, step) = (unit.values()[0][0], unit.values()[1][0], 1e-2);
        let by_differences = [
            (value(rate + step, angle) - value(rate - step, angle)) / (2.0 * step),
            (value(rate, angle + step) - value(rate, angle - step)) / (2.0 * step),
        ];
        let by_autodiff =
            [&unit.rates, &unit.angles].map(|p| p.val().grad(&gradients).unwrap().into_scalar::<f32>());
        for (a, b) in by_autodiff.into_iter().zip(by_differences) {
            assert!(
                (a - b).abs() < 1e-2 * (1.0 + b.abs()),
                "{by_autodiff:?} {by_differences:?}"
            );
        }
    }
}
