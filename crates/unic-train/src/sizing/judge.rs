//! Free-running errors of a field on stretches that it was not trained on.

use super::{folds::NumberedStretch, gain::SHARES};
use crate::{
    batch::{Batch, Window},
    error::TrainError,
    field_data::FieldData,
    mirror::View,
    network::Network,
    rollout::Rollout,
    stream::{Stream, generator},
    validation::JUDGED_S,
};
use burn::{
    module::Module,
    tensor::{Device, Tensor},
};
use unic_core::{
    animator::{Keeping, Origin, StartMemory, component_sizes},
    config::StateConfig,
};

/// Vertices that are followed: the error of a smooth shape needs no more.
const POINTS: usize = 128;

/// Sums of squares on a stretch, in m².
#[derive(Clone, Debug)]
pub(super) struct MotionError {
    /// Number of the motion.
    pub(super) motion: usize,
    /// With each of [`SHARES`], then with no field.
    pub(super) squares: [f64; SHARES.len() + 1],
}

/// Errors by stretch.
pub(super) type MotionErrors = Vec<MotionError>;

/// Networks that are judged, and their rollout.
pub(super) struct Judge<'a> {
    pub(super) data: &'a FieldData,
    pub(super) seed: u64,
    pub(super) rollout: Rollout<'a>,
    pub(super) device: &'a Device,
}

impl Judge<'_> {
    /// Runs freely from the first frame of a stretch through its first
    /// [`JUDGED_S`](crate::JUDGED_S) seconds, with every share side by side. The prior is the one
    /// that has not seen the motion. Intersections are not handled.
    ///
    /// # Errors
    /// Sizes that do not fit the network.
    pub(super) fn errors(
        &self,
        network: &Network,
        held_out: &NumberedStretch,
    ) -> Result<MotionError, TrainError> {
        let most = (JUDGED_S * self.data.config.fps) as usize;
        let frames = (held_out.frames.len() - 1).min(most.max(1));
        let shares: Vec<f32> = SHARES.iter().copied().chain([0.0]).collect();
        let mut batch = Batch::of_windows(self.data, vec![self.window(held_out)], frames);
        let mask = match batch.shares.is_empty() {
            true => vec![1.0; batch.points],
            false => std::mem::take(&mut batch.shares),
        };
        let mut batch = batch.repeated(shares.len());
        batch.shares = shares
            .iter()
            .flat_map(|s| mask.iter().map(move |m| s * m))
            .collect();
        // Without gradients nothing is kept for a backward pass.
        let network = network.clone().no_grad();
        let states = self.rollout.states(&network, &batch, None, self.device)?;
        let mut squares = [0.0; SHARES.len() + 1];
        let row = 3 * batch.points.max(1);
        let start = batch.start.chunks_exact(row).last().unwrap_or_default();
        let kept = self.kept(held_out);
        for (t, (state, target)) in states.into_iter().zip(&batch.targets).enumerate() {
            let mut values = values(state);
            // Without a field a model keeps more of its start.
            if let (Some(share), Some(last)) = (kept.get(t), values.chunks_exact_mut(row).last()) {
                (last.iter_mut().zip(start)).for_each(|(x, start)| *x = start * share);
            }
            let by_share = values.chunks_exact(row).zip(target.chunks_exact(row));
            for (sum, (x, target)) in squares.iter_mut().zip(by_share) {
                let pairs = x.iter().zip(target);
                *sum += pairs.map(|(x, y)| f64::from(x - y).powi(2)).sum::<f64>();
            }
        }
        Ok(MotionError {
            motion: held_out.motion,
            squares,
        })
    }

    /// Shares of the first frame's displacement that a model without a field keeps, by frame from the
    /// second on; none for states that are no displacements.
    fn kept(&self, held_out: &NumberedStretch) -> Vec<f32> {
        let mut memory = StartMemory::default();
        let (config, data) = (&self.data.config, self.data);
        let StateConfig::Displacement(state) = &config.state else {
            return Vec::new();
        };
        let sizes = component_sizes(&data.prior);
        let coefficients = &data.coefficients[held_out.clip][held_out.frames.clone()];
        memory.begin(Origin::Given, &coefficients[0]);
        let mut advance = |a: &Vec<f32>| {
            memory.advance(state, Keeping::WithinExcursion, &sizes, a, 1.0 / config.fps);
            memory.share
        };
        coefficients[1..].iter().map(&mut advance).collect()
    }

    fn window(&self, held_out: &NumberedStretch) -> Window {
        let vertices = self.data.capture.garment.rest.vertices.len();
        let mut rng = generator(self.seed, Stream::Sizing, held_out.clip as u64);
        Window {
            clip: held_out.clip,
            start: held_out.frames.start,
            view: View::Direct,
            points: crate::batch::draw_points(&mut rng, vertices, POINTS.min(vertices)),
        }
    }
}

fn values(state: Tensor<2>) -> Vec<f32> {
    // States are made of f32 tensors alone.
    state.inner().try_into_vec_as::<f32>().expect("f32 states")
}
