//! The AdamW update and the global norm of gradients.

use rayon::prelude::*;

use crate::KernelError;
use crate::error::expect_length;

/// Number of parameters in a rayon task: small enough to balance the load, large enough to outweigh
/// the cost of scheduling.
const CHUNK: usize = 1 << 14;

/// Settings of AdamW.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamW {
    /// Learning rate of this step, after the schedule.
    pub lr: f32,
    /// Decay rate of the first moment, the running mean of gradients.
    pub beta1: f32,
    /// Decay rate of the second moment, the running mean of squared gradients.
    pub beta2: f32,
    /// Constant added to the root of the second moment.
    pub eps: f32,
    /// Decoupled weight decay: a step multiplies parameters by 1 − lr · weight_decay.
    pub weight_decay: f32,
}

impl Default for AdamW {
    /// Returns PyTorch's defaults, with the learning rate and weight decay of the published field.
    fn default() -> Self {
        Self {
            lr: 1e-4,
            beta1: 0.9,
            beta2: 0.999,
            eps: 1e-8,
            weight_decay: 1e-4,
        }
    }
}

/// Factors of a step that all parameters share.
#[derive(Clone, Copy)]
struct StepFactors {
    grad_scale: f32,
    beta1: f32,
    beta2: f32,
    /// Factor of the weight decay: 1 − lr · weight_decay.
    keep: f32,
    /// Learning rate divided by the bias correction of the first moment.
    rate: f32,
    /// Reciprocal root of the bias correction of the second moment.
    root_scale: f32,
    eps: f32,
}

/// Updates parameters by one step of AdamW, in one pass over memory.
///
/// Follows algorithm 2 of Loshchilov and Hutter 2019. As in PyTorch, the weight decay is multiplied
/// by the learning rate. `m` and `v` are the first and second moments, zero before the first step.
/// `step` counts from 1. Gradients are first multiplied by `grad_scale`, for clipping by the global
/// norm or for a loss scale. Results have the same bytes for any number of threads.
///
/// # Errors
/// Returns [`KernelError::Length`] when the slices differ in length.
pub fn adamw_step(
    parameters: &mut [f32],
    gradients: &[f32],
    m: &mut [f32],
    v: &mut [f32],
    settings: &AdamW,
    step: u32,
    grad_scale: f32,
) -> Result<(), KernelError> {
    expect_length("gradients", parameters.len(), gradients.len())?;
    expect_length("m", parameters.len(), m.len())?;
    expect_length("v", parameters.len(), v.len())?;
    let factors = StepFactors::new(settings, step, grad_scale);
    let chunks = parameters.par_chunks_mut(CHUNK).zip(gradients.par_chunks(CHUNK));
    let chunks = chunks.zip(m.par_chunks_mut(CHUNK)).zip(v.par_chunks_mut(CHUNK));
    chunks.for_each(|(((parameters, gradients), m), v)| update(&factors, parameters, gradients, m, v));
    Ok(())
}

/// Returns the Euclidean norm of all values in all slices, summed in f64 in a fixed order.
pub fn global_norm(slices: &[&[f32]]) -> f64 {
    slices
        .iter()
        .map(|slice| sum_of_squares(slice))
        .sum::<f64>()
        .sqrt()
}

impl StepFactors {
    fn new(settings: &AdamW, step: u32, grad_scale: f32) -> Self {
        // In f64: 1 − βᵗ with β near one cancels most digits of an f32.
        let correction = |beta: f32| 1.0 - f64::from(beta).powf(f64::from(step.max(1)));
        Self {
            grad_scale,
            beta1: settings.beta1,
            beta2: settings.beta2,
            keep: (1.0 - f64::from(settings.lr) * f64::from(settings.weight_decay)) as f32,
            rate: (f64::from(settings.lr) / correction(settings.beta1)) as f32,
            root_scale: (1.0 / correction(settings.beta2).sqrt()) as f32,
            eps: settings.eps,
        }
    }
}

fn update(factors: &StepFactors, parameters: &mut [f32], gradients: &[f32], m: &mut [f32], v: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: detected in the line above.
        return unsafe { update_avx2(factors, parameters, gradients, m, v) };
    }
    update_each(factors, parameters, gradients, m, v);
}

/// Runs [`update_each`] compiled for 8 lanes. Without fused multiply-adds it rounds as the scalar
/// loop does.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn update_avx2(
    factors: &StepFactors,
    parameters: &mut [f32],
    gradients: &[f32],
    m: &mut [f32],
    v: &mut [f32],
) {
    update_each(factors, parameters, gradients, m, v);
}

#[inline(always)]
fn update_each(
    factors: &StepFactors,
    parameters: &mut [f32],
    gradients: &[f32],
    m: &mut [f32],
    v: &mut [f32],
) {
    // A copy: the compiler then knows that no store through the slices changes the factors.
    let f = *factors;
    let each = parameters.iter_mut().zip(gradients).zip(m.iter_mut().zip(v));
    for ((parameter, gradient), (m, v)) in each {
        let gradient = gradient * f.grad_scale;
        *m = f.beta1 * *m + (1.0 - f.beta1) * gradient;
        *v = f.beta2 * *v + (1.0 - f.beta2) * (gradient * gradient);
        *parameter = f.keep * *parameter - f.rate * *m / (v.sqrt() * f.root_scale + f.eps);
    }
}

fn sum_of_squares(values: &[f32]) -> f64 {
    // Chunks are of fixed size and added in order: the sum does not depend on the threads.
    let sums: Vec<f64> = values.par_chunks(CHUNK).map(chunk_sum_of_squares).collect();
    sums.iter().sum()
}

fn chunk_sum_of_squares(values: &[f32]) -> f64 {
    // Eight interleaved sums: compilers vectorise them, but not a single chain of additions.
    let mut sums = [0.0; 8];
    let (eights, rest) = values.as_chunks::<8>();
    for eight in eights {
        for (sum, value) in sums.iter_mut().zip(eight) {
            *sum += f64::from(*value) * f64::from(*value);
        }
    }
    let rest: f64 = rest.iter().map(|value| f64::from(*value).powi(2)).sum();
    sums.iter().sum::<f64>() + rest
}
