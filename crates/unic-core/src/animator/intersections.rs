//! The posed body, and vertices that are inside of it.

use super::{Animator, place::Places, tiles::for_each_tile};
use crate::{
    character::Character,
    collider::Collider,
    config::{Corrects, IntersectionMode},
    intersection::{DisplayPass, Handling, Layers, PosedVertices},
    model::Model,
    transform::Rigid,
};
use glam::Vec3;

/// Intersection handling of one animator: scratch, but for the mode that it is made for.
#[derive(Clone, Debug)]
pub(super) struct Intersections {
    pub(super) mode: IntersectionMode,
    /// World, metres.
    pub(super) colliders: Vec<Collider>,
    layers: Option<Layers>,
    handling: Handling,
    display: Option<Box<DisplayPass>>,
    /// World, metres.
    body_vertices: Vec<Vec3>,
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
        let (character, garment) = (&model.character, &model.garment);
        let unknown = LastLook {
            seed: Handling::no_seed(),
            moved: None,
        };
        let corrected = if corrects_state(mode) {
            model.vertex_count()
        } else {
            0
        };
        let handling = Handling::new(mode, character, garment);
        let display = match &handling {
            Handling::Robust(rule, body) => Some(Box::new(DisplayPass::new(*rule, garment, body))),
            _ => None,
        };
        Self {
            mode,
            colliders: Vec::new(),
            layers: None,
            handling,
            display,
            body_vertices: Vec::new(),
            pose: Posed::Before,
            looks: vec![unknown; corrected],
        }
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
        if let Some(display) = &mut self.display {
            display.set_layers(&layers);
        }
        self.layers = Some(layers);
    }

    /// The character has moved.
    pub(super) fn invalidate(&mut self) {
        self.pose = Posed::Before;
    }

    fn pose(&mut self, character: &Character, world_from_rest: &[Rigid]) {
        if self.pose == Posed::Before {
            pose_body(character, world_from_rest, &mut self.body_vertices);
            self.handling.pose(character, &self.body_vertices);
            self.pose = Posed::Now;
        }
    }

    /// Moves shown positions off the body.
    fn lift(&mut self, positions: &mut [Vec3]) {
        if let (Handling::Robust(_, body), Some(display)) = (&self.handling, &mut self.display) {
            let posed = PosedVertices {
                body,
                vertices: &self.body_vertices,
                colliders: &self.colliders,
            };
            display.apply(posed, positions);
        }
    }
}

fn corrects_state(mode: IntersectionMode) -> bool {
    match mode {
        IntersectionMode::Off => false,
        IntersectionMode::Paper { .. } => true,
        IntersectionMode::Robust { corrects, .. } => corrects == Corrects::State,
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
        if !corrects_state(intersections.mode) {
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
        if intersections.display.is_some() {
            intersections.pose(&model.character, &scratch.world_from_rest);
            intersections.lift(&mut scratch.positions);
        }
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
