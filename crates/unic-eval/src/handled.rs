//! Intersection handling of what is not a model.

use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    character::{Character, Garment},
    config::IntersectionMode,
    intersection::GarmentHandling,
};

/// Intersection handling in a mode, for a garment on a character.
#[derive(Clone, Debug)]
pub struct Handler {
    character: Arc<Character>,
    handling: GarmentHandling,
}

impl Handler {
    /// Handling as an animator in this mode does it; `None` where the mode leaves vertices as they are.
    pub fn new(mode: IntersectionMode, character: &Character, garment: &Garment) -> Option<Self> {
        if mode == IntersectionMode::Off {
            return None;
        }
        Some(Self {
            character: Arc::new(character.clone()),
            handling: GarmentHandling::new(mode, character, garment),
        })
    }
}

/// A predictor whose positions are moved out of the body as a model's are.
///
/// Without it a comparison with a model that handles intersections counts vertices inside the body
/// that nobody has tried to move out.
#[derive(Clone, Debug)]
pub struct HandledPredictor<P> {
    inner: P,
    handler: Handler,
}

impl<P> HandledPredictor<P> {
    /// Handles each frame for itself: what `inner` remembers is not moved.
    pub fn new(inner: P, handler: Handler) -> Self {
        Self { inner, handler }
    }
}

impl<P: Predictor> Predictor for HandledPredictor<P> {
    fn modes(&self) -> &[Mode] {
        self.inner.modes()
    }

    fn start(&mut self, clip: &PreparedClip, mode: Mode) -> Result<(), PredictorError> {
        self.inner.start(clip, mode)
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        self.inner.predict(clip, frame, positions)?;
        let Handler { character, handling } = &mut self.handler;
        handling.pose(character, clip.kinematics.world_from_rest(frame));
        handling.apply(positions);
        Ok(())
    }
}
