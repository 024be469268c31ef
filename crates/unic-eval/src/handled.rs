//! Intersection handling for predictors that are no models.

use crate::{
    kinematics::PreparedClip,
    predictor::{Mode, Predictor, PredictorError},
};
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    IntersectionMode,
    character::{Character, Garment},
    intersection::GarmentHandling,
};

/// Moves garment vertices out of a character's body, in one handling mode.
#[derive(Clone, Debug)]
pub struct IntersectionHandler {
    character: Arc<Character>,
    garment: Arc<Garment>,
    handling: GarmentHandling,
}

impl IntersectionHandler {
    /// Prepares the handling that an animator does in this mode. Returns `None` where the mode
    /// leaves vertices as they are.
    pub fn new(mode: IntersectionMode, character: &Character, garment: &Garment) -> Option<Self> {
        if mode == IntersectionMode::Off {
            return None;
        }
        Some(Self {
            character: Arc::new(character.clone()),
            garment: Arc::new(garment.clone()),
            handling: GarmentHandling::new(mode, character, garment),
        })
    }
}

/// Predictor whose positions are moved out of the body as a model's are.
///
/// A model that handles intersections is compared with such a predictor. The vertices of others are
/// inside the body because nothing moves them out.
#[derive(Clone, Debug)]
pub struct HandledPredictor<P> {
    inner: P,
    handler: IntersectionHandler,
}

impl<P> HandledPredictor<P> {
    /// Wraps a predictor. Each frame is handled on its own: the state of `inner` does not change.
    pub fn new(inner: P, handler: IntersectionHandler) -> Self {
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
        let IntersectionHandler {
            character,
            garment,
            handling,
        } = &mut self.handler;
        // The body is the character's by linear blend skinning, as in an animator, also where the
        // clip has its own.
        handling.pose(character, clip.kinematics.world_from_rest(frame));
        handling.apply(garment, positions);
        Ok(())
    }
}
