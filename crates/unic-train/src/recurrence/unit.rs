//! A linear recurrent unit in training.

use super::{
    head::Head,
    pretrained::UnitStart,
    scan::oscillations,
    sizes::{LEAST_RATE, Sizes},
    windows::WindowBatch,
};
use crate::{
    elu_op::elu,
    layers::parameter,
    noise::normal,
    parameters::{replaced, values},
    stream::{Stream, generator},
};
use burn::module::{Module, Param};
use burn::tensor::{Device, Tensor, TensorData};
use std::f32::consts::TAU;

/// Factor on the mean error over a window, before squaring. What is constant over the seconds of a
/// window is mostly how the cloth came to lie, which the motion does not tell.
pub(super) const SLOW_SHARE: f64 = 0.3;

/// Time constants of the oscillators at the start, seconds: from a flutter to a slow slide.
const TIME_CONSTANTS_S: [f32; 2] = [0.05, 2.0];
/// Initial frequencies of the oscillators, in turn, in Hz: those at which cloth swings, and zero.
const FREQUENCIES_HZ: [f32; 8] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 5.0];

/// Linear recurrent unit with poles λ = exp(−exp(rate) + i angle). exp(rate) is at least
/// [`LEAST_RATE`], so that the oscillators decay for all values of the parameters.
#[derive(Module, Debug)]
pub(super) struct Unit {
    rates: Param<Tensor<1>>,
    angles: Param<Tensor<1>>,
    /// `[in, out]`, in the order of [`Recurrence::layers`].
    weights: Vec<Param<Tensor<2>>>,
    biases: Vec<Param<Tensor<1>>>,
}

impl Default for Unit {
    /// Empty unit: a placeholder while a unit is moved out to be updated.
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
    /// Draws normal weights with variance 1 / inputs, and a hundredth of it in the head.
    pub(super) fn new(sizes: Sizes, fps: f32, seed: u64, device: &Device) -> Self {
        let count = sizes.oscillators;
        // The maximum avoids 0 / 0 for a single oscillator.
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

    /// Replaces the values of all parameters but those of the last map.
    pub(super) fn started(self, start: &UnitStart) -> Self {
        let mut values = values(&self);
        let maps = self.weights.len();
        let [rates, angles] = [&start.rates, &start.angles];
        values[..2].clone_from_slice(&[rates.clone(), angles.clone()]);
        values[2..][..start.weights.len()].clone_from_slice(&start.weights);
        values[2 + maps..][..start.biases.len()].clone_from_slice(&start.biases);
        replaced(self, &values)
    }

    /// Replaces the values of the last map.
    pub(super) fn with_head(self, head: Head) -> Self {
        let mut values = values(&self);
        let maps = self.weights.len();
        values[1 + maps] = head.weight;
        values[1 + 2 * maps] = head.bias;
        replaced(self, &values)
    }

    /// Mean over frames and windows of the squared error, summed over the outputs. The mean error
    /// over a window has the factor [`SLOW_SHARE`].
    pub(super) fn loss(&self, mut batch: WindowBatch, device: &Device) -> Tensor<1> {
        let (outputs, shape) = (batch.sizes.outputs, batch.shape(batch.sizes.outputs));
        let targets = tensor(std::mem::take(&mut batch.targets), shape, device);
        let error = self.outputs(batch, device) - targets;
        // `mean` divides by the number of outputs too; the factor turns that into their sum.
        let slow = error.clone().mean_dim(0) * (1.0 - SLOW_SHARE);
        (error - slow).powi_scalar(2).mean() * outputs as f64
    }

    /// Computes the outputs `[frames, windows, outputs]` of a batch.
    fn outputs(&self, batch: WindowBatch, device: &Device) -> Tensor<3> {
        let (windows, width, shape) = (batch.windows, batch.sizes.width, batch.shape(batch.sizes.inputs));
        let [embedding_mask, memory_mask] = batch.masks.map(|mask| tensor(mask, [1, windows, width], device));
        let embedding = elu(self.map(0, tensor(batch.inputs, shape, device))) * embedding_mask;
        let states = self.remembered(self.drive(embedding.clone()));
        let memory = elu(self.map(2, states)) * memory_mask;
        let hidden = elu(self.map(3, Tensor::cat(vec![memory, embedding], 2)));
        self.map(4, hidden)
    }

    fn map(&self, i: usize, x: Tensor<3>) -> Tensor<3> {
        mapped(x, self.weights[i].val(), self.biases[i].val())
    }

    /// Drive of the oscillators `[frames, windows, 2 M]`, scaled so that the size of their states
    /// does not depend on how long they remember.
    fn drive(&self, embedding: Tensor<3>) -> Tensor<3> {
        // √(1 − |λ|²): under white noise the states have the same variance for every time constant.
        let gain: Tensor<1> = (-(self.rates() * -2.0).exp() + 1.0).sqrt();
        let gain = Tensor::cat(vec![gain.clone(), gain], 0);
        let weight = self.weights[1].val() * gain.clone().unsqueeze();
        mapped(embedding, weight, self.biases[1].val() * gain)
    }

    /// States of the oscillators `[frames, windows, 2 M]`, real parts before imaginary ones, for
    /// their drive.
    fn remembered(&self, drive: Tensor<3>) -> Tensor<3> {
        let state = drive.dims()[2];
        let decay = (-self.rates()).exp();
        let angle = self.angles.val();
        let poles = [decay.clone() * angle.clone().cos(), decay * angle.sin()];
        let first = started(drive.clone().narrow(0, 0, 1).reshape([-1, state as i64]), &poles);
        oscillations(Tensor::cat(poles.into(), 0), first, drive)
    }

    fn rates(&self) -> Tensor<1> {
        self.rates.val().exp().clamp_min(LEAST_RATE)
    }
}

fn tensor(values: Vec<f32>, shape: [usize; 3], device: &Device) -> Tensor<3> {
    Tensor::from_data(TensorData::new(values, shape), device)
}

/// Applies a linear map to the last axis of `[frames, windows, inputs]`.
fn mapped(x: Tensor<3>, weight: Tensor<2>, bias: Tensor<1>) -> Tensor<3> {
    let [frames, windows, inputs] = x.dims();
    let outputs = bias.dims()[0];
    let y = x.reshape([frames * windows, inputs]).matmul(weight) + bias.unsqueeze::<2>();
    y.reshape([frames, windows, outputs])
}

/// Steady states u / (1 − λ) under a constant drive u `[windows, 2 M]`, that of the first frame.
fn started(drive: Tensor<2>, [pole_re, pole_im]: &[Tensor<1>; 2]) -> Tensor<2> {
    let count = pole_re.dims()[0];
    let [re, im] = [0, count].map(|part| drive.clone().narrow(1, part, count));
    // 1 / (1 − λ) = (a + i b) / |1 − λ|² with 1 − λ = a − i b.
    let [a, b] = [-pole_re.clone() + 1.0, pole_im.clone()];
    // Above zero: every pole decays, so |λ| is below 1.
    let norm = a.clone().powi_scalar(2) + b.clone().powi_scalar(2);
    let [a, b]: [Tensor<2>; 2] = [a / norm.clone(), b / norm].map(Tensor::unsqueeze);
    let turned = [re.clone() * a.clone() - im.clone() * b.clone(), re * b + im * a];
    Tensor::cat(turned.into(), 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{dataset::MotionVectors, mirror::View, recurrence::Sequence};

    /// Compares the outputs in training with those of the runtime.
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
            masks: [5, 5].map(|width| vec![1.0; width]),
        };
        let trained = unit.outputs(batch, &device).into_data();
        let trained = trained.try_to_vec::<f32>().unwrap();
        let scale = 0.3;
        let run = sequence.predicted_by(&sizes.recurrence(&values(&unit), scale));
        let size = run.iter().fold(0.0f32, |most, x| most.max(x.abs()));
        assert!(size > 1e-3, "{size}: nothing is compared");
        for (a, b) in trained.iter().zip(&run) {
            assert!((a * scale - b).abs() < 1e-5, "{a} {b} of {frames} frames");
        }
    }

    fn small(outputs: usize, device: &Device) -> (Sizes, Unit) {
        let sizes = Sizes {
            inputs: 6,
            width: 5,
            oscillators: 4,
            outputs,
        };
        (sizes, Unit::new(sizes, 30.0, 1, device))
    }

    #[test]
    fn a_constant_error_counts_less_than_one_that_changes() {
        let device = Device::flex().autodiff();
        let (sizes, unit) = small(1, &device);
        let batch = |targets: Vec<f32>| WindowBatch {
            frames: 4,
            windows: 1,
            sizes,
            inputs: vec![0.0; 24],
            targets,
            masks: [5, 5].map(|width| vec![1.0; width]),
        };
        let outputs = unit.outputs(batch(vec![0.0; 4]), &device).into_data();
        let outputs = outputs.try_to_vec::<f32>().unwrap();
        let loss = |error: [f32; 4]| {
            let targets = outputs.iter().zip(error).map(|(y, e)| y - e).collect();
            unit.loss(batch(targets), &device).into_scalar::<f32>()
        };
        assert!((loss([2.0; 4]) - 0.09 * 4.0).abs() < 1e-4);
        assert!((loss([2.0, -2.0, 2.0, -2.0]) - 4.0).abs() < 1e-4);
    }

    #[test]
    fn a_started_unit_keeps_its_last_map() {
        let (sizes, unit) = small(2, &Device::flex().autodiff());
        let before = values(&unit);
        let start = UnitStart {
            rates: vec![0.5; 4],
            angles: vec![0.25; 4],
            weights: std::array::from_fn(|i| vec![i as f32; before[2 + i].len()]),
            biases: std::array::from_fn(|i| vec![10.0 + i as f32; before[7 + i].len()]),
        };
        assert!(start.fits(sizes));
        let after = values(&unit.started(&start));
        assert_eq!(after[..2], [start.rates, start.angles]);
        assert_eq!(after[2..6], start.weights);
        assert_eq!(after[7..11], start.biases);
        assert_eq!([&after[6], &after[11]], [&before[6], &before[11]]);
    }

    #[test]
    fn a_head_replaces_the_last_map_alone() {
        let (sizes, unit) = small(2, &Device::flex().autodiff());
        let mut expected = values(&unit);
        let head = Head {
            weight: vec![0.5; sizes.width * sizes.outputs],
            bias: vec![-1.0; sizes.outputs],
        };
        expected[6] = head.weight.clone();
        expected[11] = head.bias.clone();
        assert_eq!(values(&unit.with_head(head)), expected);
    }

    #[test]
    fn training_and_runtime_outputs_agree() {
        [1, 2, 20, 64].into_iter().for_each(check_against_the_runtime);
    }

    #[test]
    fn gradients_are_those_of_finite_differences() {
        let device = Device::flex().autodiff();
        let embedding: Vec<f32> = (0..2 * 7).map(|i| (i as f32 * 1.7).sin()).collect();
        let sizes = Sizes {
            inputs: 2,
            width: 2,
            oscillators: 1,
            outputs: 1,
        };
        let unit = Unit::new(sizes, 30.0, 1, &device);
        let of = |unit: &Unit| {
            let states = unit.remembered(unit.drive(tensor(embedding.clone(), [7, 1, 2], &device)));
            let [re, im] = [0, 1].map(|part| states.clone().narrow(2, part, 1));
            (re * 0.7 + im * 0.3).powi_scalar(2).sum()
        };
        let gradients = of(&unit).backward();
        let value = |rate: f32, angle: f32| {
            let mut moved = unit.clone();
            moved.rates = parameter(RATES_ID, vec![rate], [1], &device);
            moved.angles = parameter(ANGLES_ID, vec![angle], [1], &device);
            of(&moved).into_scalar::<f32>()
        };
        let (rate, angle, step) = (values(&unit)[0][0], values(&unit)[1][0], 1e-2);
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
