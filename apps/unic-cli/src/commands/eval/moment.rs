//! One frame of a clip as it is, as a model predicts it, and as skinning gives it.

use crate::pictures::{Place, Shot};
use glam::Vec3;
use unic_eval::PreparedClip;
use unic_io::Capture;

/// One frame, three times.
#[derive(Clone, Debug)]
pub(super) struct Moment {
    /// From 0.
    pub(super) frame: usize,
    pub(super) seconds: f32,
    pub(super) truth: Shot,
    /// Vertices of the garment, world space, metres.
    pub(super) model: Vec<Vec3>,
}

impl Moment {
    pub(super) fn new(capture: &Capture, clip: &PreparedClip, frame: usize, model: &[Vec3]) -> Self {
        let character = &capture.character;
        let mut body = Vec::new();
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
            truth: Shot {
                body,
                garment: clip.captured.garment.frame(frame).to_vec(),
                place: Place::new(&character.skeleton, &motion.poses[frame]),
            },
            model: model.to_vec(),
        }
    }

    /// The same body with another garment.
    pub(super) fn with_garment(&self, garment: &[Vec3]) -> Shot {
        Shot {
            garment: garment.to_vec(),
            ..self.truth.clone()
        }
    }

    /// Distances of the model's vertices from the truth's, metres.
    pub(super) fn errors(&self) -> Vec<f32> {
        distances(&self.model, &self.truth.garment)
    }
}

/// The rest shape carried by the skeleton.
pub(super) fn skinned(capture: &Capture, clip: &PreparedClip, frame: usize) -> Vec<Vec3> {
    let garment = &capture.garment;
    let mut positions = Vec::new();
    let world_from_rest = clip.kinematics.world_from_rest(frame);
    (garment.weights).skin(&garment.rest.vertices, world_from_rest, &mut positions);
    positions
}

pub(super) fn distances(a: &[Vec3], b: &[Vec3]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).collect()
}

/// Ends of a colour scale to choose from, metres.
const SCALES_M: [f32; 7] = [0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5];

/// The first scale that holds 95 % of the model's errors.
pub(super) fn heat_scale<'a>(moments: impl Iterator<Item = &'a Moment>) -> f32 {
    let mut errors: Vec<f32> = moments
        .flat_map(Moment::errors)
        .filter(|e| e.is_finite())
        .collect();
    errors.sort_by(f32::total_cmp);
    let most = errors.get(errors.len() * 95 / 100).copied().unwrap_or(0.0);
    let scale = SCALES_M.into_iter().find(|&scale| scale >= most);
    scale.unwrap_or(SCALES_M[SCALES_M.len() - 1])
}
