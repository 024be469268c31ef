//! Contents of a pane.

use super::prediction::{Prediction, Progress, rmse};
use super::source::{AnimatedMesh, ClipSource, ModelSource, ShapeFrames};
use crate::Mesh;
use glam::Vec3;
use std::{ops::Deref, sync::Arc};
use unic_core::{Model, character::Garment, clip::Clip, skinning::SkinningWeights};

/// Garment over time in one pane.
pub struct Track {
    name: String,
    kind: TrackKind,
    /// Index of its body among those of the session.
    pub(super) body: usize,
    mesh: Arc<Mesh>,
    shapes: Shapes,
    /// Newer prediction, which is shown when it is complete.
    pending: Option<(Arc<Model>, Prediction)>,
    truth: Option<Arc<dyn ShapeFrames>>,
}

/// Kind of a [`Track`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackKind {
    /// Ground truth of a capture.
    Truth,
    /// Model in free running.
    Prediction,
    /// Rest shape, skinned to the motion.
    Skinning,
    /// Animation from a file.
    Animation,
}

enum Shapes {
    Known {
        frames: Arc<dyn ShapeFrames>,
        weights: Option<Arc<Garment>>,
        rmse_m: Vec<f32>,
    },
    Predicted {
        model: Arc<Model>,
        motion: Arc<Clip>,
        prediction: Prediction,
    },
    Skinned {
        garment: Arc<Garment>,
        prediction: Prediction,
    },
}

/// Positions of a frame.
pub(super) enum Positions<'a> {
    Known(&'a [Vec3]),
    Computed(Arc<[Vec3]>),
}

impl Deref for Positions<'_> {
    type Target = [Vec3];

    fn deref(&self) -> &[Vec3] {
        match self {
            Self::Known(positions) => positions,
            Self::Computed(positions) => positions,
        }
    }
}

impl Track {
    pub(super) fn of_truth(clip: &ClipSource, body: usize) -> Self {
        Self {
            name: format!("{}: ground truth", clip.name),
            kind: TrackKind::Truth,
            body,
            mesh: Arc::new(Mesh::new(&clip.garment.rest)),
            shapes: Shapes::Known {
                frames: Arc::clone(&clip.truth),
                weights: Some(Arc::clone(&clip.garment)),
                rmse_m: Vec::new(),
            },
            pending: None,
            truth: None,
        }
    }

    pub(super) fn of_skinning(clip: &ClipSource, body: usize) -> Self {
        let truth = Some(Arc::clone(&clip.truth));
        let (character, garment) = (Arc::clone(&clip.character), Arc::clone(&clip.garment));
        let motion = Arc::clone(&clip.motion);
        Self {
            name: "skinning".into(),
            kind: TrackKind::Skinning,
            body,
            mesh: Arc::new(Mesh::new(&clip.garment.rest)),
            shapes: Shapes::Skinned {
                prediction: Prediction::of_skinning(character, Arc::clone(&garment), motion, truth.clone()),
                garment,
            },
            pending: None,
            truth,
        }
    }

    /// Runs a model on a motion, with the true positions if they are of its mesh.
    pub(super) fn of_model(
        source: &ModelSource,
        motion: &Arc<Clip>,
        truth: Option<&Arc<dyn ShapeFrames>>,
        body: usize,
    ) -> Self {
        let model = Arc::clone(&source.model);
        let truth = truth.filter(|truth| truth.positions(0).len() == model.vertex_count());
        let prediction = Prediction::of_model(Arc::clone(&model), Arc::clone(motion), truth.cloned());
        Self {
            name: source.name.clone(),
            kind: TrackKind::Prediction,
            body,
            mesh: Arc::new(Mesh::new(&model.garment().rest)),
            shapes: Shapes::Predicted {
                model,
                motion: Arc::clone(motion),
                prediction,
            },
            pending: None,
            truth: truth.cloned(),
        }
    }

    /// Shows an animation, and compares it with true positions that are of its mesh and length.
    pub(super) fn of_animation(
        name: &str,
        garment: &AnimatedMesh,
        truth: Option<&Arc<dyn ShapeFrames>>,
        body: usize,
    ) -> Self {
        let (frames, vertices) = (&garment.frames, garment.mesh.vertices.len());
        let truth = truth.filter(|truth| {
            truth.frame_count() == frames.frame_count() && truth.positions(0).len() == vertices
        });
        let error = |truth: &Arc<dyn ShapeFrames>| {
            let all = 0..frames.frame_count();
            all.map(|frame| rmse(frames.positions(frame), truth.positions(frame)))
                .collect()
        };
        Self {
            name: name.to_owned(),
            kind: TrackKind::Animation,
            body,
            mesh: Arc::new(Mesh::new(&garment.mesh)),
            shapes: Shapes::Known {
                frames: Arc::clone(frames),
                weights: None,
                rmse_m: truth.map(error).unwrap_or_default(),
            },
            pending: None,
            truth: truth.cloned(),
        }
    }

    /// Takes over what an earlier track of the same name has computed: of the same model all of it,
    /// of an earlier one what it shows, until the newer prediction is complete.
    pub(super) fn inherit(&mut self, earlier: Track) {
        let (
            Shapes::Predicted { model, motion, .. },
            Shapes::Predicted {
                model: m, motion: n, ..
            },
        ) = (&self.shapes, &earlier.shapes)
        else {
            return;
        };
        if !Arc::ptr_eq(motion, n) {
            return;
        }
        if Arc::ptr_eq(model, m) {
            self.shapes = earlier.shapes;
            self.pending = earlier.pending;
            return;
        }
        let newer = std::mem::replace(&mut self.shapes, earlier.shapes);
        if let Shapes::Predicted {
            model, prediction, ..
        } = newer
        {
            self.pending = Some((model, prediction));
        }
    }

    /// Shows the newer prediction if it is complete. Returns whether it was.
    pub(super) fn promote(&mut self) -> bool {
        let is_ready = |(_, prediction): &(Arc<Model>, Prediction)| prediction.has_ended();
        if !self.pending.as_ref().is_some_and(is_ready) {
            return false;
        }
        let (
            Some((newer, complete)),
            Shapes::Predicted {
                model, prediction, ..
            },
        ) = (self.pending.take(), &mut self.shapes)
        else {
            return false;
        };
        *model = newer;
        *prediction = complete;
        true
    }

    /// Name to show.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Kind of what is shown.
    pub fn kind(&self) -> TrackKind {
        self.kind
    }

    /// State of the prediction; none where positions are known.
    pub fn progress(&self) -> Option<Progress> {
        self.prediction().map(Prediction::progress)
    }

    /// Root mean square distance from the ground truth in each frame that is known so far, metres;
    /// empty without a ground truth.
    pub fn rmse_m(&self) -> Vec<f32> {
        match &self.shapes {
            Shapes::Known { rmse_m, .. } => rmse_m.clone(),
            Shapes::Predicted { prediction, .. } | Shapes::Skinned { prediction, .. } => prediction.rmse_m(),
        }
    }

    /// Blocks until a frame is computed.
    pub(super) fn wait_for(&self, frame: usize) {
        if let Some(prediction) = self.prediction() {
            prediction.wait_for(frame);
        }
    }

    pub(super) fn prediction(&self) -> Option<&Prediction> {
        match &self.shapes {
            Shapes::Known { .. } => None,
            Shapes::Predicted { prediction, .. } | Shapes::Skinned { prediction, .. } => Some(prediction),
        }
    }

    /// Positions in a frame; none as long as they are not computed.
    pub(super) fn positions(&self, frame: usize) -> Option<Positions<'_>> {
        match &self.shapes {
            Shapes::Known { frames, .. } => {
                let is_there = frame < frames.frame_count();
                is_there.then(|| Positions::Known(frames.positions(frame)))
            }
            Shapes::Predicted { prediction, .. } | Shapes::Skinned { prediction, .. } => {
                prediction.positions(frame).map(Positions::Computed)
            }
        }
    }

    /// Whether a frame need not be waited for.
    pub(super) fn is_ready(&self, frame: usize) -> bool {
        self.prediction()
            .is_none_or(|prediction| prediction.is_ready(frame))
    }

    pub(super) fn mesh(&self) -> &Arc<Mesh> {
        &self.mesh
    }

    pub(super) fn truth(&self) -> Option<&Arc<dyn ShapeFrames>> {
        self.truth.as_ref()
    }

    pub(super) fn is_truth(&self) -> bool {
        self.kind == TrackKind::Truth
    }

    pub(super) fn weights(&self) -> Option<&SkinningWeights> {
        match &self.shapes {
            Shapes::Known { weights, .. } => weights.as_ref().map(|garment| &garment.weights),
            Shapes::Predicted { model, .. } => Some(&model.garment().weights),
            Shapes::Skinned { garment, .. } => Some(&garment.weights),
        }
    }
}
