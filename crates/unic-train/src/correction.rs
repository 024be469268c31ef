//! Intersection handling inside training: the runtime's, its corrections without gradient.

use crate::{
    batch::{Batch, Window},
    dataset::Dataset,
};
use burn::tensor::Tensor;
use glam::Vec3;
use rayon::prelude::*;
use std::{
    collections::HashMap,
    sync::{Arc, Mutex},
};
use unic_core::{
    config::StateConfig,
    features::{Place, PointFrame},
    intersection::Handling,
};

/// Posed bodies of training frames, with what the rule needs of them; the most recent ones kept.
#[derive(Default)]
pub struct Bodies(Mutex<HashMap<(usize, usize), Arc<Handling>>>);

/// Posed bodies kept at most: about 0.5 GB for a body of 7 thousand vertices.
const MOST_BODIES: usize = 400;

impl Bodies {
    /// `unposed` is the rule for this character.
    fn of(&self, unposed: &Handling, data: &Dataset, clip: usize, frame: usize) -> Arc<Handling> {
        // A poisoned lock means that a thread panicked in `insert`; the map is sound all the same.
        let lock = || self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(body) = lock().get(&(clip, frame)) {
            return body.clone();
        }
        let character = &data.capture.character;
        let mut vertices = Vec::new();
        let transforms = data.clips[clip].kinematics.world_from_rest(frame);
        character
            .weights
            .skin(&character.body.vertices, transforms, &mut vertices);
        let mut body = unposed.clone();
        body.pose(character, &vertices);
        let body = Arc::new(body);
        let mut bodies = lock();
        if bodies.len() >= MOST_BODIES {
            let any = bodies.keys().next().copied();
            any.and_then(|key| bodies.remove(&key));
        }
        bodies.insert((clip, frame), body.clone());
        body
    }
}

/// The rule and where bodies come from.
pub struct Correction<'a> {
    /// Training data.
    pub data: &'a Dataset,
    /// Posed bodies, kept from step to step: of one rule.
    pub bodies: &'a Bodies,
    /// The rule for the data's garment and character, of any pose.
    pub rule: &'a Handling,
}

impl Correction<'_> {
    /// What has to be added to the states of frame `k` of the rollout [W·n, 3]: zero outside the
    /// body. Plain numbers, so no gradient flows through it.
    pub fn of(&self, batch: &Batch, k: usize, states: Tensor<2>) -> Vec<f32> {
        let states = states.inner().into_data();
        // States are made of f32 tensors alone.
        let states = states.as_slice::<f32>().expect("f32 states");
        let mut corrections = vec![0.0; states.len()];
        let rows = 3 * batch.points;
        (corrections
            .par_chunks_mut(rows)
            .zip(states.par_chunks(rows))
            .zip(&batch.windows))
        .for_each(|((corrections, states), window)| self.window(window, k, states, corrections));
        corrections
    }

    fn window(&self, window: &Window, k: usize, states: &[f32], corrections: &mut [f32]) {
        let frame = window.start + k + 1;
        let body = self.bodies.of(self.rule, self.data, window.clip, frame);
        let points = states.chunks_exact(3).zip(corrections.chunks_exact_mut(3));
        for (&vertex, (state, correction)) in window.points.iter().zip(points) {
            let state = window.view.of(Vec3::from_slice(state));
            let place = self.place(window.clip, frame, vertex as usize);
            let position = place.to_world(state);
            if let Some(moved) = body.correct(vertex as usize, position, &mut Handling::no_seed()) {
                let change = window.view.of(place.pushed(state, moved) - state);
                correction.copy_from_slice(&change.to_array());
            }
        }
    }

    fn place(&self, clip: usize, frame: usize, vertex: usize) -> Place {
        let kinematics = &self.data.clips[clip].kinematics;
        match self.data.config.state {
            StateConfig::RootRelative => Place::in_frame(kinematics.world_from_state(frame)),
            StateConfig::Displacement(_) => {
                let garment = &self.data.capture.garment;
                let point = PointFrame::new(garment, vertex, kinematics.world_from_rest(frame));
                let coefficients = &self.data.coefficients[clip][frame];
                Place::at_point(point, self.data.prior.displacement(vertex, coefficients))
            }
        }
    }
}
