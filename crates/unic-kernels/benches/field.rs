//! Time of the published field on one frame of the smallest garment of the paper, and of AdamW for
//! as many parameters as the motion encoder has.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use unic_kernels::*;

/// Number of points of a frame.
const POINTS: usize = 3_653;

/// Number of parameters of the motion encoder.
const ENCODER_PARAMETERS: usize = 23_400_000;

fn main() {
    divan::main();
}

#[divan::bench]
fn infer(bencher: Bencher) {
    let Setup {
        field,
        points,
        latent,
    } = setup();
    let batch = Batch {
        points: &points,
        latents: &latent,
        points_per_group: POINTS,
    };
    let mut outputs = vec![0.0; POINTS * field.shape().outputs];
    bencher
        .counter(ItemsCount::new(POINTS))
        .bench_local(|| field.infer(black_box(&batch), &mut outputs));
}

#[divan::bench]
fn forward_and_backward(bencher: Bencher) {
    let Setup {
        field,
        points,
        latent,
    } = setup();
    let batch = Batch {
        points: &points,
        latents: &latent,
        points_per_group: POINTS,
    };
    let mut outputs = vec![0.0; POINTS * field.shape().outputs];
    let (mut point_gradients, mut latent_gradients) = (vec![0.0; points.len()], vec![0.0; latent.len()]);
    let mut parameter_gradients = vec![0.0; field.shape().parameter_count()];
    let (mut saved, mut scratch) = (SavedActivations::default(), BackwardScratch::default());
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        field.forward(black_box(&batch), &mut outputs, &mut saved)?;
        let gradients = Gradients {
            points: &mut point_gradients,
            latents: &mut latent_gradients,
            parameters: &mut parameter_gradients,
        };
        field.backward(&batch, &saved, &outputs, gradients, &mut scratch)
    });
}

#[divan::bench]
fn adamw(bencher: Bencher) {
    let zeros = || vec![0.0; ENCODER_PARAMETERS];
    let (mut parameters, gradients, mut m, mut v) =
        (zeros(), vec![1e-3; ENCODER_PARAMETERS], zeros(), zeros());
    bencher
        // Seven accesses of four bytes: all four slices are read, all but the gradients are
        // written.
        .counter(BytesCount::new(7 * 4 * ENCODER_PARAMETERS))
        .bench_local(|| {
            adamw_step(
                &mut parameters,
                black_box(&gradients),
                &mut m,
                &mut v,
                &AdamW::default(),
                1,
                1.0,
            )
        });
}

/// The published field with inputs for one frame.
struct Setup {
    field: Field,
    points: Vec<f32>,
    latent: Vec<f32>,
}

fn setup() -> Setup {
    let shape = FieldShape::PAPER;
    let numbers = |count: usize, scale: f32| -> Vec<f32> {
        (0..count)
            .map(|i| scale * ((i as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0) as f32)
            .collect()
    };
    let mut field = Field::new(shape).unwrap();
    field.load(&numbers(shape.parameter_count(), 0.15)).unwrap();
    Setup {
        field,
        points: numbers(POINTS * shape.point_inputs, 1.0),
        latent: numbers(shape.latent, 1.0),
    }
}
