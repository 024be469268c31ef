//! The optimiser's update and the norm of a gradient.

use rayon::prelude::*;

use crate::KernelError;
use crate::error::expect_length;

/// Numbers in a task: small enough to share work out, large enough that a task outweighs its start.
const CHUNK: usize = 1 << 14;

/// Settings of AdamW.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AdamW {
    /// Step size of this step, after the schedule.
    pub lr: f32,
    /// Decay of the gradient's mean.
    pub beta1: f32,
    /// Decay of the squared gradient's mean.
    pub beta2: f32,
    /// Added to the root of the squared gradient's mean.
    pub eps: f32,
    /// Decoupled decay: a step multiplies parameters by 1 − lr · weight_decay.
    pub weight_decay: f32,
}

/// PyTorch's defaults with the published field's rate and decay.
impl Default for AdamW {
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

/// What is the same for every number of a step.
#[derive(Clone, Copy)]
struct Factors {
    grad_scale: f32,
    beta1: f32,
    beta2: f32,
    keep: f32,
    rate: f32,
    root_scale: f32,
    eps: f32,
}

/// One step of AdamW (Loshchilov and Hutter 2019, algorithm 2, with the step size multiplying the decay as in
/// PyTorch), in one pass over memory.
///
/// `m` and `v` are the running means, zero before the first step; `step` counts from 1. Gradients are multiplied by
/// `grad_scale` first: clipping by the global norm, or a loss scale. The same bytes on any number of threads.
///
/// # Errors
/// [`KernelError::Length`] when the slices differ in length.
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
    let factors = Factors::new(settings, step, grad_scale);
    let chunks = parameters.par_chunks_mut(CHUNK).zip(gradients.par_chunks(CHUNK));
    let chunks = chunks.zip(m.par_chunks_mut(CHUNK)).zip(v.par_chunks_mut(CHUNK));
    chunks.for_each(|(((parameters, gradients), m), v)| update(&factors, parameters, gradients, m, v));
    Ok(())
}

/// Root of the sum of squares of all numbers in all slices, summed in f64 in a fixed order.
pub fn global_norm(slices: &[&[f32]]) -> f64 {
    slices
        .iter()
        .map(|slice| sum_of_squares(slice))
        .sum::<f64>()
        .sqrt()
}

impl Factors {
    fn new(settings: &AdamW, step: u32, grad_scale: f32) -> Self {
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

fn update(factors: &Factors, parameters: &mut [f32], gradients: &[f32], m: &mut [f32], v: &mut [f32]) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        // SAFETY: detected in the line above.
        return unsafe { update_avx2(factors, parameters, gradients, m, v) };
    }
    update_each(factors, parameters, gradients, m, v);
}

/// The same loop compiled for 8 lanes. Without fused multiply-adds, so that it rounds as the scalar loop does.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn update_avx2(factors: &Factors, parameters: &mut [f32], gradients: &[f32], m: &mut [f32], v: &mut [f32]) {
    update_each(factors, parameters, gradients, m, v);
}

#[inline(always)]
fn update_each(factors: &Factors, parameters: &mut [f32], gradients: &[f32], m: &mut [f32], v: &mut [f32]) {
    let f = *factors;
    let numbers = parameters.iter_mut().zip(gradients).zip(m.iter_mut().zip(v));
    for ((parameter, gradient), (m, v)) in numbers {
        let gradient = gradient * f.grad_scale;
        *m = f.beta1 * *m + (1.0 - f.beta1) * gradient;
        *v = f.beta2 * *v + (1.0 - f.beta2) * (gradient * gradient);
        *parameter = f.keep * *parameter - f.rate * *m / (v.sqrt() * f.root_scale + f.eps);
    }
}

fn sum_of_squares(values: &[f32]) -> f64 {
    let sums: Vec<f64> = values.par_chunks(CHUNK).map(chunk_sum_of_squares).collect();
    sums.iter().sum()
}

/// Eight interleaved sums, which compilers turn into lanes.
fn chunk_sum_of_squares(values: &[f32]) -> f64 {
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
