//! Samples that a fit's errors are measured on.

use crate::{
    batch::{Batch, Sample},
    error::TrainError,
    field_data::FieldData,
    network::Network,
    rollout::Rollout,
    validation::JUDGED_S,
};
use burn::tensor::{Device, Tensor};

/// Pairs of frames, and vertices of each, that the error on training clips is measured on. They are
/// the same in every measurement.
const SAMPLE: Sample = Sample {
    windows: 512,
    points: 64,
    frames: 1,
};

/// RMSE, in metres, of single steps on a fixed sample of the training clips.
pub(super) fn training_rmse(
    data: &FieldData,
    seed: u64,
    rollout: &Rollout,
    network: &Network,
    device: &Device,
) -> Result<f64, TrainError> {
    let batch = Batch::sample(data, seed, SAMPLE);
    let states = rollout.states(network, &batch, None, device)?;
    // States are made of f32 tensors alone.
    let values = |state: Tensor<2>| state.inner().try_into_vec_as::<f32>().expect("f32 states");
    let predicted = states.into_iter().flat_map(values);
    let pairs = predicted.zip(batch.targets.iter().flatten());
    let squares: f64 = pairs.map(|(x, target)| f64::from(x - target).powi(2)).sum();
    Ok((squares / batch.rows().max(1) as f64).sqrt())
}

/// Number of frames at the start of each validation clip that single steps and shares of the field
/// are measured on.
pub(super) fn judged_frames(data: &FieldData) -> usize {
    (JUDGED_S * data.config.fps) as usize
}
