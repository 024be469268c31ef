//! One frame of a clip as it was simulated and as a model predicts it.

use crate::pictures::{Placement, Snapshot};
use glam::Vec3;
use unic_eval::PreparedClip;
use unic_io::Capture;

/// Simulated and predicted garment of one frame.
#[derive(Clone, Debug)]
pub(super) struct FrameComparison {
    /// Frame of the clip, from 0.
    pub(super) frame: usize,
    /// Time of the frame since the start of the clip.
    pub(super) seconds: f32,
    /// Body and simulated garment.
    pub(super) truth: Snapshot,
    /// Garment vertices that the model predicts, in world space and metres.
    pub(super) model: Vec<Vec3>,
}

impl FrameComparison {
    /// Creates the comparison of `frame`; `model` holds the predicted garment vertices.
    pub(super) fn new(capture: &Capture, clip: &PreparedClip, frame: usize, model: &[Vec3]) -> Self {
        let character = &capture.character;
        let mut body = Vec::new();
        // The body that the garment was simulated on may differ from skinning: the capture's own
        // body takes precedence.
        match &clip.captured.body {
            Some(frames) => body.extend_from_slice(frames.frame(frame)),
            None => (character.weights).skin(
                &character.body.vertices,
                clip.kinematics.world_from_rest(frame),
                &mut body,
            ),
        }
        let motion = &clip.captured.clip;
        Self {
            frame,
            seconds: frame as f32 / motion.fps,
            truth: Snapshot {
                body,
                garment: clip.captured.garment.frame(frame).to_vec(),
                placement: Placement::new(&character.skeleton, &motion.poses[frame]),
            },
            model: model.to_vec(),
        }
    }

    /// Snapshot of the same body with other garment vertices.
    pub(super) fn with_garment(&self, garment: &[Vec3]) -> Snapshot {
        Snapshot {
            garment: garment.to_vec(),
            ..self.truth.clone()
        }
    }

    /// Distances of the predicted vertices from the simulated ones, metres.
    pub(super) fn errors(&self) -> Vec<f32> {
        distances(&self.model, &self.truth.garment)
    }
}

/// Garment vertices by linear blend skinning of the rest shape, in world space and metres.
pub(super) fn skinned(capture: &Capture, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
    let garment = &capture.garment;
    let mut positions = Vec::new();
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    (garment.weights).skin(&garment.rest.vertices, world_from_rest, &mut positions);
    positions
}

/// Distances between the vertices of two garments of the same mesh.
pub(super) fn distances(a: &[Vec3], b: &[Vec3]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).collect()
}

/// Errors at which a colour scale may end, metres. Round numbers make the pictures comparable.
const SCALES_M: [f32; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/// Smallest end of a colour scale, in metres, that is not exceeded by 95 % of the vertex errors.
pub(super) fn heat_scale<'a>(comparisons: impl Iterator<Item = &'a FrameComparison>) -> f32 {
    let mut errors: Vec<f32> = comparisons
        .flat_map(FrameComparison::errors)
        .filter(|e| e.is_finite())
        .collect();
    errors.sort_by(f32::total_cmp);
    // A percentile instead of the maximum: a few diverged vertices would leave the others
    // colourless.
    let most = errors.get(errors.len() * 95 / 100).copied().unwrap_or(0.0);
    let scale = SCALES_M.into_iter().find(|&scale| scale >= most);
    scale.unwrap_or(SCALES_M[SCALES_M.len() - 1])
}
