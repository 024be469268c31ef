//! Loaded data that a viewer shows.

use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Model,
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
};

/// Positions of a mesh in every frame, in memory or mapped from a file.
pub trait ShapeFrames: Send + Sync {
    /// Number of frames.
    fn frame_count(&self) -> usize;

    /// World positions of all vertices in a frame, metres.
    fn positions(&self, frame: usize) -> &[Vec3];
}

impl ShapeFrames for Vec<Vec<Vec3>> {
    fn frame_count(&self) -> usize {
        self.len()
    }

    fn positions(&self, frame: usize) -> &[Vec3] {
        &self[frame]
    }
}

/// Something to show.
#[derive(Clone)]
pub enum Source {
    /// Clip of a capture. The newest one is the motion and the ground truth of all models that fit.
    Clip(ClipSource),
    /// Model, which is shown in free running.
    Model(ModelSource),
    /// Animation whose positions are known.
    Animation(AnimationSource),
}

/// Clip of a capture.
#[derive(Clone)]
pub struct ClipSource {
    /// Name to show.
    pub name: String,
    /// Body and skeleton.
    pub character: Arc<Character>,
    /// Garment in its rest shape.
    pub garment: Arc<Garment>,
    /// Motion of the character.
    pub motion: Arc<Clip>,
    /// True positions of the garment.
    pub truth: Arc<dyn ShapeFrames>,
    /// Positions of the body, if they differ from those of skinning.
    pub body: Option<Arc<dyn ShapeFrames>>,
}

/// Model with a motion.
#[derive(Clone)]
pub struct ModelSource {
    /// Name to show, and by which a newer model of the same name replaces it.
    pub name: String,
    /// Model.
    pub model: Arc<Model>,
    /// Motion where no clip is shown whose character is the model's; at the model's frame rate.
    pub motion: Option<Arc<Clip>>,
}

/// Animation of a garment, with its body if that is known.
#[derive(Clone)]
pub struct AnimationSource {
    /// Name to show.
    pub name: String,
    /// Frames a second.
    pub fps: f32,
    /// Garment.
    pub garment: AnimatedMesh,
    /// Body.
    pub body: Option<AnimatedMesh>,
}

/// Mesh with its positions in every frame.
#[derive(Clone)]
pub struct AnimatedMesh {
    /// Faces, and a shape that gives the cloth its pattern.
    pub mesh: Arc<TriMesh>,
    /// Positions of the mesh's vertices.
    pub frames: Arc<dyn ShapeFrames>,
}

impl Source {
    /// Name to show.
    pub fn name(&self) -> &str {
        match self {
            Self::Clip(clip) => &clip.name,
            Self::Model(model) => &model.name,
            Self::Animation(animation) => &animation.name,
        }
    }
}

impl AnimatedMesh {
    /// Whether every frame has as many positions as the mesh has vertices.
    pub(super) fn is_consistent(&self) -> bool {
        let vertices = self.mesh.vertices.len();
        let count = self.frames.frame_count();
        count > 0 && (0..count).all(|frame| self.frames.positions(frame).len() == vertices)
    }
}
