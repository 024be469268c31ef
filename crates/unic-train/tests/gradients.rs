//! Contract: the gradient of a whole rollout is the slope of its loss.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use common::{dataset, device, network, numbers, small};
use unic_core::config::StateConfig;
use unic_train::*;

/// Frames that are rolled out.
const UNROLL: usize = 3;

/// One batch with fixed noise: the loss is a function of the parameters.
struct Fixture {
    data: FieldData,
    config: TrainConfig,
    shape: NetworkShape,
    network: Network,
    batch: Batch,
    noise: StepNoise,
}

impl Fixture {
    fn new(mut config: TrainConfig, frames: usize) -> Self {
        config.batch.unroll_first = frames;
        config.batch.unroll_last = frames;
        let data = dataset(&config);
        let (shape, network) = network(&data, 5);
        let batch = Batch::gather(&data, &config, 0);
        let noise = StepNoise::draw(&shape, &config.regularisation, batch.encoder_rows(), 1, 0);
        Self {
            data,
            config,
            shape,
            network,
            batch,
            noise,
        }
    }

    fn rollout(&self) -> Rollout<'_> {
        Rollout {
            shape: &self.shape,
            config: &self.data.config,
            loss: &self.config.loss,
            products: Products::F32,
        }
    }

    fn loss(&self, rollout: &Rollout, network: &Network, batch: &Batch) -> Tensor<1> {
        rollout
            .loss(network, batch, Some(&self.noise), &device())
            .unwrap()
    }

    /// Gradient g, read from the optimiser: after one step from zero the first moment is g / 10.
    fn gradient(&self, rollout: &Rollout, batch: &Batch) -> Vec<f32> {
        let mut config = self.config.optimiser.clone();
        config.clip_norm = 0.0;
        let (mut network, mut moments) = (self.network.clone(), Moments::new(&self.network));
        let gradients = GradientsParams::from_grads(self.loss(rollout, &network, batch).backward(), &network);
        update(&mut network, gradients, &mut moments, &config, 1e-3, 0).unwrap();
        moments.first.concat().iter().map(|m| 10.0 * m).collect()
    }

    /// Loss with the parameters moved along a direction.
    fn moved(&self, direction: &[f32], step: f32) -> f64 {
        let mut rest = direction;
        let mut values = self.network.values();
        for tensor in &mut values {
            let (own, others) = rest.split_at(tensor.len());
            tensor.iter_mut().zip(own).for_each(|(x, d)| *x += step * d);
            rest = others;
        }
        let network = Network::with_parameters(&self.shape, &values, &device());
        f64::from(
            self.loss(&self.rollout(), &network, &self.batch)
                .into_scalar::<f32>(),
        )
    }
}

/// Compares slopes along random halves of the gradient, where they are large against rounding.
fn assert_gradient_is_slope(fixture: &Fixture) {
    let gradient = fixture.gradient(&fixture.rollout(), &fixture.batch);
    let norm = gradient.iter().map(|g| g * g).sum::<f32>().sqrt();
    assert!(norm > 0.0);
    for seed in 0..4 {
        let chosen = numbers(gradient.len(), 1.0, seed);
        let direction: Vec<f32> = gradient
            .iter()
            .zip(chosen)
            .map(|(g, c)| if c > 0.0 { g / norm } else { 0.0 })
            .collect();
        let expected: f64 = gradient
            .iter()
            .zip(&direction)
            .map(|(g, d)| f64::from(*g) * f64::from(*d))
            .sum();
        // Small against the parameters, so that few ReLUs and no picked category change.
        let step = 1e-3;
        let slope =
            (fixture.moved(&direction, step) - fixture.moved(&direction, -step)) / f64::from(2.0 * step);
        assert!(
            (slope / expected - 1.0).abs() < 0.01,
            "direction {seed}: slope {slope}, gradient {expected}"
        );
    }
}

#[test]
fn the_gradient_of_a_position_rollout_is_its_slope() {
    assert_gradient_is_slope(&Fixture::new(small(Preset::Paper), UNROLL));
}

/// The output limit of a displacement state, in units of its scale.
fn displacement(output_limit: f32) -> Fixture {
    let mut fixture = Fixture::new(small(Preset::Tiny), UNROLL);
    let StateConfig::Displacement(config) = &mut fixture.data.config.state else {
        panic!("a position state")
    };
    config.output_limit = output_limit;
    fixture
}

#[test]
fn the_gradient_of_a_displacement_rollout_is_its_slope_far_below_the_limit() {
    assert_gradient_is_slope(&displacement(1e3));
}

#[test]
fn the_gradient_of_a_displacement_rollout_is_its_slope_at_the_limit() {
    let (limited, free) = (displacement(0.02), displacement(1e3));
    let loss = |f: &Fixture| f.moved(&vec![0.0; f.network.values().concat().len()], 0.0);
    assert!(loss(&limited) != loss(&free), "the limit is not reached");
    assert_gradient_is_slope(&limited);
}
