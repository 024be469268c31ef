//! Contract: the fused update is Burn's AdamW, and clipping scales the whole gradient.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use burn::optim::{AdamWConfig, GradientsParams, ModuleOptimizer};
use burn::tensor::Tensor;
use common::{dataset, device, network, relative_error, small};
use unic_train::*;

/// Gradients of the loss of one step's batch, noise included.
fn gradients(
    data: &FieldData,
    config: &TrainConfig,
    shape: &NetworkShape,
    network: &Network,
    step: u64,
) -> GradientsParams {
    let batch = Batch::gather(data, config, step);
    let noise = StepNoise::draw(
        shape,
        &config.regularisation,
        batch.encoder_rows(),
        config.seed,
        step,
    );
    let rollout = Rollout {
        shape,
        config: &data.config,
        loss: &config.loss,
        products: Products::F32,
    };
    let loss: Tensor<1> = rollout.loss(network, &batch, Some(&noise), &device()).unwrap();
    GradientsParams::from_grads(loss.backward(), network)
}

#[test]
fn the_update_is_burns_own_adamw() {
    const STEPS: u64 = 20;
    const RATE: f64 = 1e-3;
    let mut config = small(Preset::Tiny);
    config.optimiser.clip_norm = 0.0;
    let data = dataset(&config);
    let (shape, mut ours) = network(&data, 3);
    let mut theirs = ours.clone();
    let mut moments = Moments::new(&ours);
    let mut burns: ModuleOptimizer = AdamWConfig::new()
        .with_epsilon(1e-8)
        .with_weight_decay(config.optimiser.weight_decay)
        .init();
    let start = ours.values().concat();
    for step in 0..STEPS {
        // The same gradients for both: rounding must not be carried round by the loss.
        let gradient = || gradients(&data, &config, &shape, &theirs, step);
        update(&mut ours, gradient(), &mut moments, &config.optimiser, RATE, step).unwrap();
        let gradient = gradient();
        theirs = burns.step(RATE, theirs, gradient);
    }
    let (ours, theirs) = (ours.values().concat(), theirs.values().concat());
    assert!(relative_error(&theirs, &start) > 1e-2, "nothing has moved");
    let largest = ours
        .iter()
        .zip(&theirs)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f32::max);
    assert!(largest < 1e-6, "{largest}");
}

#[test]
fn clipping_scales_the_gradient_to_the_norm_asked_for() {
    let mut config = small(Preset::Tiny);
    let data = dataset(&config);
    let (shape, network) = network(&data, 3);
    // After one step the first moment is a tenth of the gradient that was used.
    let mut first_moments = |clip_norm: f64| {
        config.optimiser.clip_norm = clip_norm;
        let (mut network, mut moments) = (network.clone(), Moments::new(&network));
        let gradient = gradients(&data, &config, &shape, &network, 0);
        let norm = update(&mut network, gradient, &mut moments, &config.optimiser, 1e-3, 0).unwrap();
        (norm, moments.first.concat())
    };
    let (norm, free) = first_moments(0.0);
    let length = |m: &[f32]| 10.0 * m.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt();
    assert!((length(&free) / norm - 1.0).abs() < 1e-5);
    assert_eq!(first_moments(2.0 * norm), (norm, free.clone()));
    let (reported, clipped) = first_moments(norm / 3.0);
    assert_eq!(reported, norm, "reported before clipping");
    let expected: Vec<f32> = free.iter().map(|m| m / 3.0).collect();
    assert!(relative_error(&clipped, &expected) < 1e-5);
}
