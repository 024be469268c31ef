//! The published field on one frame of the smallest garment of the paper, and AdamW on the motion encoder's size.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

use divan::counter::{BytesCount, ItemsCount};
use divan::{Bencher, black_box};
use unic_kernels::*;

const POINTS: usize = 3_653;
const ENCODER_PARAMETERS: usize = 23_400_000;

fn main() {
    divan::main();
}

#[divan::bench]
fn infer(bencher: Bencher) {
    let (field, x, z) = field();
    let batch = Batch {
        points: &x,
        latents: &z,
        points_per_group: POINTS,
    };
    let mut outputs = vec![0.0; x.len()];
    bencher
        .counter(ItemsCount::new(POINTS))
        .bench_local(|| field.infer(black_box(&batch), &mut outputs));
}

#[divan::bench]
fn forward_and_backward(bencher: Bencher) {
    let (field, x, z) = field();
    let batch = Batch {
        points: &x,
        latents: &z,
        points_per_group: POINTS,
    };
    let (mut outputs, mut dx, mut dz) = (vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; z.len()]);
    let mut parameters = vec![0.0; field.shape().parameter_count()];
    let (mut saved, mut scratch) = (Saved::default(), BackwardScratch::default());
    bencher.counter(ItemsCount::new(POINTS)).bench_local(|| {
        field.forward(black_box(&batch), &mut outputs, &mut saved)?;
        let gradients = Gradients {
            points: &mut dx,
            latents: &mut dz,
            parameters: &mut parameters,
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

fn field() -> (Field, Vec<f32>, Vec<f32>) {
    let shape = FieldShape::PAPER;
    let numbers = |count: usize, scale: f32| -> Vec<f32> {
        (0..count)
            .map(|i| scale * ((i as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0) as f32)
            .collect()
    };
    let mut field = Field::new(shape).unwrap();
    field.load(&numbers(shape.parameter_count(), 0.15)).unwrap();
    (
        field,
        numbers(POINTS * shape.point_inputs, 1.0),
        numbers(shape.latent, 1.0),
    )
}
