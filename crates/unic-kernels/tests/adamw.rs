//! Contract: AdamW follows its definition, has the bits of a scalar loop, and gives the same bytes
//! for any number of threads. The global norm is exact to f64 rounding.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

mod common;

use common::numbers;
use unic_kernels::*;

const SETTINGS: AdamW = AdamW {
    lr: 1e-2,
    beta1: 0.9,
    beta2: 0.99,
    eps: 1e-6,
    weight_decay: 0.1,
};

/// Number of parameters: longer than several chunks, and a multiple of no vector length.
const COUNT: usize = 50_021;

/// Parameters with their moments.
#[derive(PartialEq)]
struct State {
    parameters: Vec<f32>,
    m: Vec<f32>,
    v: Vec<f32>,
}

impl State {
    fn new() -> Self {
        Self {
            parameters: numbers(COUNT, 1.0, 1),
            m: vec![0.0; COUNT],
            v: vec![0.0; COUNT],
        }
    }
}

/// State after three steps, each with other random gradients.
fn three_steps(scale: f32) -> State {
    let mut state = State::new();
    for step in 1..=3 {
        let State { parameters, m, v } = &mut state;
        let gradients = numbers(COUNT, 0.1, 10 + u64::from(step));
        adamw_step(parameters, &gradients, m, v, &SETTINGS, step, scale).unwrap();
    }
    state
}

/// Compares with algorithm 2 of Loshchilov and Hutter 2019 in f64.
#[test]
fn adamw_follows_its_definition() {
    let scale = 0.5;
    let parameters = three_steps(scale).parameters;
    let gradients: Vec<_> = (1..=3).map(|step| numbers(COUNT, 0.1, 10 + step)).collect();
    let [lr, beta1, beta2, eps, decay] = [
        SETTINGS.lr,
        SETTINGS.beta1,
        SETTINGS.beta2,
        SETTINGS.eps,
        SETTINGS.weight_decay,
    ]
    .map(f64::from);
    for (index, start) in numbers(COUNT, 1.0, 1).into_iter().enumerate() {
        let (mut parameter, mut m, mut v) = (f64::from(start), 0.0, 0.0);
        for (step, gradients) in gradients.iter().enumerate() {
            let gradient = f64::from(scale) * f64::from(gradients[index]);
            let power = step as i32 + 1;
            m = beta1 * m + (1.0 - beta1) * gradient;
            v = beta2 * v + (1.0 - beta2) * gradient * gradient;
            let direction = m / (1.0 - beta1.powi(power)) / ((v / (1.0 - beta2.powi(power))).sqrt() + eps);
            parameter -= lr * decay * parameter + lr * direction;
        }
        assert!((f64::from(parameters[index]) - parameter).abs() < 1e-6, "{index}");
    }
}

/// Slices of a single value take the scalar path of the loop.
#[test]
fn vectorised_steps_have_the_bits_of_scalar_steps() {
    let all = three_steps(0.7);
    let mut alone = State::new();
    for step in 1..=3 {
        let gradients = numbers(COUNT, 0.1, 10 + u64::from(step));
        let State { parameters, m, v } = &mut alone;
        for i in 0..COUNT {
            let one = i..i + 1;
            let (p, m, v) = (
                &mut parameters[one.clone()],
                &mut m[one.clone()],
                &mut v[one.clone()],
            );
            adamw_step(p, &gradients[one], m, v, &SETTINGS, step, 0.7).unwrap();
        }
    }
    assert!(all == alone);
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let on = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
    };
    let values = numbers(COUNT, 1.0, 3);
    let run = || (three_steps(1.0), global_norm(&[&values]).to_bits());
    assert!(on(1).install(run) == on(5).install(run));
}

#[test]
fn global_norm_is_that_of_the_joined_slices() {
    assert_eq!(global_norm(&[&[3.0], &[], &[0.0, 4.0]]), 5.0);
    let values = numbers(COUNT, 1.0, 3);
    let expected = values
        .iter()
        .map(|&value| f64::from(value).powi(2))
        .sum::<f64>()
        .sqrt();
    assert!((global_norm(&[&values[..100], &values[100..]]) - expected).abs() < 1e-9 * expected);
}

#[test]
fn slices_of_different_lengths_are_an_error() {
    let result = adamw_step(
        &mut [0.0; 2],
        &[0.0; 2],
        &mut [0.0; 3],
        &mut [0.0; 2],
        &SETTINGS,
        1,
        1.0,
    );
    assert_eq!(
        result,
        Err(KernelError::Length {
            what: "m",
            expected: 2,
            found: 3
        })
    );
}
