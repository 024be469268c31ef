//! The loss of one step: windows rolled out from their start by the model's own predictions.

use crate::{
    batch::Batch,
    config::{LossConfig, Products},
    error::TrainError,
    network::{Network, NetworkShape, StepNoise},
};
use burn::tensor::{Device, Tensor, TensorData};
use unic_core::{
    config::{DisplacementConfig, ModelConfig, StateConfig},
    features::StateInputs,
};

/// Rollout of windows by a network, and its loss.
pub struct Rollout<'a> {
    /// Sizes.
    pub shape: &'a NetworkShape,
    /// State and update rule.
    pub config: &'a ModelConfig,
    /// Weights of the loss terms.
    pub loss: &'a LossConfig,
    /// Number format of the field's matrix products.
    pub products: Products,
}

impl Rollout<'_> {
    /// Predicts the states of every frame, K × `[W·n, 3]`, from the batch's start alone.
    ///
    /// # Errors
    /// Sizes that do not fit the network.
    pub fn states(
        &self,
        network: &Network,
        batch: &Batch,
        noise: Option<&StepNoise>,
        device: &Device,
    ) -> Result<Vec<Tensor<2>>, TrainError> {
        let windows = batch.windows.len();
        let pairs = batch.frames * windows;
        let motion = tensor(&batch.motion, [pairs, batch.motion.len() / pairs.max(1)], device);
        let latents = network.latents(self.shape, motion, noise); // [K · W, C]
        let field = network.field(self.shape, self.products)?;
        let shares = (!batch.shares.is_empty()).then(|| tensor(&batch.shares, [batch.rows(), 1], device));
        let (mut previous, mut state) = (points(&batch.before_start, device), points(&batch.start, device));
        let mut states = Vec::with_capacity(batch.frames);
        for k in 0..batch.frames {
            // Rows are frame-major: the latent vectors of frame k are contiguous.
            let latent = latents.clone().narrow(0, k * windows, windows);
            let inputs = self.inputs(&state, &previous, &batch.frame_inputs[k], device);
            let output = field.forward(inputs, latent)?;
            let next = self.updated(state.clone(), output, shares.as_ref());
            previous = std::mem::replace(&mut state, next.clone());
            states.push(next);
        }
        Ok(states)
    }

    /// Computes the loss: λ times the mean squared error over frames, points and coordinates
    /// (paper, eq. output; the release's mean over coordinates).
    ///
    /// # Errors
    /// Sizes that do not fit the network.
    pub fn loss(
        &self,
        network: &Network,
        batch: &Batch,
        noise: Option<&StepNoise>,
        device: &Device,
    ) -> Result<Tensor<1>, TrainError> {
        let states = self.states(network, batch, noise, device)?;
        let mut total = Tensor::from_data(TensorData::new(vec![0.0f32], [1]), device);
        for (state, target) in states.into_iter().zip(&batch.targets) {
            total = total + mean_square(state - points(target, device)) * self.loss.position;
        }
        Ok(total / batch.frames.max(1) as f64)
    }

    /// Inputs of the field [rows, P]: those of the state, through which gradients flow, then the
    /// rest.
    fn inputs(&self, state: &Tensor<2>, previous: &Tensor<2>, inputs: &[f32], device: &Device) -> Tensor<2> {
        let StateConfig::Displacement(config) = &self.config.state else {
            return state.clone();
        };
        let factors = StateInputs::new(config);
        let rows = state.dims()[0];
        let displacement = factors.displacement.map(|k| state.clone() * k);
        let velocity = factors.velocity.map(|k| (state.clone() - previous.clone()) * k);
        let mut parts: Vec<Tensor<2>> = factors.ordered(displacement, velocity).collect();
        if !inputs.is_empty() {
            parts.push(tensor(inputs, [rows, inputs.len() / rows.max(1)], device));
        }
        Tensor::cat(parts, 1)
    }

    /// Computes the next state. `shares` `[rows, 1]` are the factors of the garment's mask.
    fn updated(&self, state: Tensor<2>, output: Tensor<2>, shares: Option<&Tensor<2>>) -> Tensor<2> {
        match &self.config.state {
            StateConfig::RootRelative => state + output,
            StateConfig::Displacement(config) => {
                let decay = config.decay(1.0 / self.config.fps);
                let moved = limited(output, config) * config.scale_m;
                let moved = shares.map_or(moved.clone(), |shares| moved * shares.clone());
                state * decay + moved
            }
        }
    }
}

/// Limits the length of every output, like `unic_core::features::limited` at runtime.
fn limited(output: Tensor<2>, config: &DisplacementConfig) -> Tensor<2> {
    // The small constant keeps the gradient of the root finite at zero. It is too small to change
    // an output near the limit.
    let length = (output.clone().powi_scalar(2).sum_dim(1) + 1e-12).sqrt(); // [rows, 1]
    let factor = (length.recip() * config.output_limit).clamp_max(1.0);
    output * factor
}

fn mean_square(x: Tensor<2>) -> Tensor<1> {
    x.powi_scalar(2).mean()
}

/// Moves points to the device, three coordinates per row.
fn points(values: &[f32], device: &Device) -> Tensor<2> {
    tensor(values, [values.len() / 3, 3], device)
}

fn tensor(values: &[f32], shape: [usize; 2], device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values.to_vec(), shape), device)
}
