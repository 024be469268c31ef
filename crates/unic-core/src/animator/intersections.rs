//! Intersection handling within a step: of the state, and of the shown positions.

use super::{Animator, start_memory::Keeping, state_frames::StateFrames, tiles::for_each_tile};
use crate::{
    character::Character,
    collider::Collider,
    config::IntersectionMode,
    intersection::{Afterwards, GarmentHandling, Handling, Layers},
    model::Model,
    projection::StrainProjection,
    transform::Rigid,
};
use glam::Vec3;

/// Settings and scratch memory of one animator's intersection handling.
#[derive(Clone, Debug)]
pub(super) struct Intersections {
    /// Ground and props in world space, metres.
    pub(super) colliders: Vec<Collider>,
    layers: Option<Layers>,
    handling: GarmentHandling,
    body_pose: BodyPose,
    /// Queries by garment vertex; empty unless the mode corrects the state.
    queries: Vec<VertexQuery>,
}

/// Pose of the body in the handling's scratch memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum BodyPose {
    /// Pose of an earlier frame.
    Stale,
    /// Pose of the current frame.
    Current,
}

/// Last query of the body for a vertex.
#[derive(Clone, Copy, Debug)]
struct VertexQuery {
    /// Face that was found, where the next search starts.
    seed: u32,
    /// World position that the vertex is moved to, metres; `None` if it stays.
    moved: Option<Vec3>,
}

impl Intersections {
    pub(super) fn new(mode: IntersectionMode, model: &Model) -> Self {
        let handling = GarmentHandling::new(mode, &model.character, &model.garment);
        let initial = VertexQuery {
            seed: Handling::NO_SEED,
            moved: None,
        };
        let query_count = match handling.mode().corrects_state() {
            true => model.vertex_count(),
            false => 0,
        };
        Self {
            colliders: Vec::new(),
            layers: None,
            handling,
            body_pose: BodyPose::Stale,
            queries: vec![initial; query_count],
        }
    }

    /// Returns whether given displacements may stay.
    pub(super) fn keeping(&self) -> Keeping {
        match self.handling.mode().corrects_state() {
            true => Keeping::Fading,
            false => Keeping::WithinExcursion,
        }
    }

    pub(super) fn mode(&self) -> IntersectionMode {
        self.handling.mode()
    }

    /// Changes the mode; colliders and layers stay.
    pub(super) fn set_mode(&mut self, mode: IntersectionMode, model: &Model) {
        let colliders = std::mem::take(&mut self.colliders);
        let layers = self.layers.take();
        *self = Self::new(mode, model);
        self.colliders = colliders;
        // The new handling prepares the layers for itself.
        if let Some(layers) = layers {
            self.set_layers(layers);
        }
    }

    pub(super) fn set_layers(&mut self, layers: Layers) {
        self.handling.set_layers(&layers);
        self.layers = Some(layers);
    }

    /// Marks the body's pose as stale, after the character has moved.
    pub(super) fn invalidate(&mut self) {
        self.body_pose = BodyPose::Stale;
    }

    /// Poses the body, once a frame however often it is called.
    fn pose(&mut self, character: &Character, world_from_rest: &[Rigid]) {
        if self.body_pose == BodyPose::Stale {
            self.handling.pose(character, world_from_rest);
            self.body_pose = BodyPose::Current;
        }
    }
}

impl Animator {
    /// Moves the states of vertices out of the body, if the mode in force corrects the state.
    pub(super) fn correct_state(&mut self) {
        let Self {
            model,
            state,
            scratch,
            intersections,
            ..
        } = self;
        if !intersections.handling.mode().corrects_state() {
            return;
        }
        intersections.pose(&model.character, &scratch.world_from_rest);
        let frames = StateFrames::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_state(&model.character.skeleton),
        );
        let Intersections {
            handling, queries, ..
        } = intersections;
        // The loop runs over the queries, whose seeds persist between frames. Each reads the state
        // of its own vertex alone.
        for_each_tile(queries, |first, queries| {
            for (vertex, query) in (first..).zip(queries) {
                let position = frames.of(vertex).to_world(state.vertices[vertex].value);
                query.moved = handling.correct(vertex, position, &mut query.seed);
            }
        });
        for (i, (vertex, query)) in state.vertices.iter_mut().zip(queries).enumerate() {
            if let Some(moved) = query.moved {
                vertex.value = frames.of(i).pushed(vertex.value, moved);
            }
        }
    }

    /// Moves shown positions, not the state, out of the body, if the mode in force corrects them.
    pub(super) fn correct_display(&mut self) {
        let Self {
            model,
            state,
            scratch,
            intersections,
            ..
        } = self;
        if intersections.handling.corrects_display() {
            intersections.pose(&model.character, &scratch.world_from_rest);
            let Intersections {
                handling, colliders, ..
            } = intersections;
            handling.set_closing_share(state.start.added_share());
            let hinges = |projection: &StrainProjection| projection.config().hinge_sweeps() > 0;
            if model.projection.as_ref().is_some_and(hinges) {
                scratch.projection.keep_uncorrected(&scratch.positions);
            }
            let afterwards = match model.projection {
                Some(_) => Afterwards::SearchedAgain,
                None => Afterwards::Shown,
            };
            handling.correct_for_display(&model.garment, colliders, afterwards, &mut scratch.positions);
            // Corrections stretch the edges around them, and crumple the cloth.
            if let Some(projection) = &model.projection
                && handling.contact_planes(&scratch.positions, &mut scratch.planes)
            {
                let order_share = state.start.added_share();
                projection.relax(
                    &scratch.planes,
                    order_share,
                    &mut scratch.positions,
                    &mut scratch.projection,
                );
                handling.correct_again(&model.garment, colliders, &scratch.planes, &mut scratch.positions);
            }
        }
    }
}
