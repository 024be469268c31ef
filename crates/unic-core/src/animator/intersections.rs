//! The posed body, and vertices that are inside of it.

use super::{Animator, place::Places, tiles::for_each_tile};
use crate::{
    character::Character, config::IntersectionMode, intersection::PaperIntersection, transform::Rigid,
};
use glam::Vec3;

impl Animator {
    /// Moves vertices out of the body where the mode in force asks for it.
    pub(super) fn handle_intersections(&mut self) {
        let IntersectionMode::Paper { relaxation_m } = self.intersection else {
            return;
        };
        let rule = PaperIntersection { relaxation_m };
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let character = &model.character;
        pose_body(character, &scratch.world_from_rest, &mut scratch.body_vertices);
        scratch
            .body
            .prepare(&scratch.body_vertices, &character.body.faces);
        let body = &scratch.body;
        let at = Places::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_frame(),
        );
        for_each_tile(&mut state.vertices, |first, vertices| {
            for (i, vertex) in vertices.iter_mut().enumerate() {
                let place = at.of(first + i);
                if let Some(corrected) = rule.correct(body, place.to_world(vertex.value)) {
                    vertex.value = place.to_state(corrected);
                }
            }
        });
    }
}

/// Skinned body, world space, on all threads.
pub(super) fn pose_body(character: &Character, world_from_rest: &[Rigid], positions: &mut Vec<Vec3>) {
    let (weights, rest) = (&character.weights, &character.body.vertices);
    positions.resize(rest.len(), Vec3::ZERO);
    for_each_tile(positions, |first, tile| {
        for (vertex, position) in (first..).zip(tile) {
            *position = weights.position(vertex, rest[vertex], world_from_rest);
        }
    });
}
