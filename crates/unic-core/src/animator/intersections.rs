//! The posed body, and vertices that are inside of it.

use super::{Animator, place::Places, tiles::for_each_tile};
use crate::{
    character::Character,
    collider::Collider,
    config::IntersectionMode,
    intersection::{GarmentHandling, Handling, Layers},
    model::Model,
    transform::Rigid,
};
use glam::Vec3;

/// Intersection handling of one animator: scratch, but for the mode that it is made for.
#[derive(Clone, Debug)]
pub(super) struct Intersections {
    /// World, metres.
    pub(super) colliders: Vec<Collider>,
    layers: Option<Layers>,
    handling: GarmentHandling,
    pose: Posed,
    /// By garment vertex, where the state is corrected.
    looks: Vec<LastLook>,
}

/// Whose pose the body has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Posed {
    Before,
    Now,
}

/// What the last look at the body said about a vertex.
#[derive(Clone, Copy, Debug)]
struct LastLook {
    /// For the next look.
    seed: u32,
    /// Where the vertex goes, world, metres; none when it stays.
    moved: Option<Vec3>,
}

impl Intersections {
    pub(super) fn new(mode: IntersectionMode, model: &Model) -> Self {
        let handling = GarmentHandling::new(mode, &model.character, &model.garment);
        let unknown = LastLook {
            seed: Handling::no_seed(),
            moved: None,
        };
        let corrected = match handling.corrects_state() {
            true => model.vertex_count(),
            false => 0,
        };
        Self {
            colliders: Vec::new(),
            layers: None,
            handling,
            pose: Posed::Before,
            looks: vec![unknown; corrected],
        }
    }

    pub(super) fn mode(&self) -> IntersectionMode {
        self.handling.mode()
    }

    /// In another mode, with the same things around.
    pub(super) fn in_mode(&mut self, mode: IntersectionMode, model: &Model) {
        let colliders = std::mem::take(&mut self.colliders);
        let layers = self.layers.take();
        *self = Self::new(mode, model);
        self.colliders = colliders;
        if let Some(layers) = layers {
            self.set_layers(layers);
        }
    }

    pub(super) fn set_layers(&mut self, layers: Layers) {
        self.handling.set_layers(&layers);
        self.layers = Some(layers);
    }

    /// The character has moved.
    pub(super) fn invalidate(&mut self) {
        self.pose = Posed::Before;
    }

    fn pose(&mut self, character: &Character, world_from_rest: &[Rigid]) {
        if self.pose == Posed::Before {
            self.handling.pose(character, world_from_rest);
            self.pose = Posed::Now;
        }
    }
}

impl Animator {
    /// Moves vertices out of the body where the mode in force corrects the state.
    pub(super) fn correct_state(&mut self) {
        let Self {
            model,
            state,
            scratch,
            intersections,
            ..
        } = self;
        if !intersections.handling.corrects_state() {
            return;
        }
        intersections.pose(&model.character, &scratch.world_from_rest);
        let at = Places::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_state(&model.character.skeleton),
        );
        let Intersections { handling, looks, .. } = intersections;
        for_each_tile(looks, |first, looks| {
            for (vertex, look) in (first..).zip(looks) {
                let position = at.of(vertex).to_world(state.vertices[vertex].value);
                look.moved = handling.correct(vertex, position, &mut look.seed);
            }
        });
        for (i, (vertex, look)) in state.vertices.iter_mut().zip(looks).enumerate() {
            if let Some(moved) = look.moved {
                vertex.value = at.of(i).pushed(vertex.value, moved);
            }
        }
    }

    /// Moves shown positions, but not the state, off the body where the mode in force asks for it.
    pub(super) fn correct_display(&mut self) {
        let Self {
            model,
            scratch,
            intersections,
            ..
        } = self;
        if intersections.handling.corrects_display() {
            intersections.pose(&model.character, &scratch.world_from_rest);
            let Intersections {
                handling, colliders, ..
            } = intersections;
            handling.lift(colliders, &mut scratch.positions);
        }
    }
}
