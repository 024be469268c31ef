//! Updates of all vertices: their states, world positions and normals.

use super::{
    Animator, Stage,
    deform::{FieldFrame, TileScratch},
    state::VertexState,
    state_frames::{SampleInterpolation, StateFrames},
    tiles::{for_each_tile, for_each_tile_with},
};
use crate::{
    features::StateFrame,
    mesh::vertex_normals,
    projection::{Memory, ProjectionTick},
    sampling::Sampling,
};
use glam::Vec3;

impl Animator {
    /// Evaluates the field at the sampled vertices and interpolates the others from them.
    pub(super) fn deform(&mut self, wind: Vec3) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        // Displacements that only fade need no interpolation.
        let sampling = model.sampling().filter(|_| !model.is_field_skipped());
        let frame = FieldFrame {
            model,
            biases: &scratch.biases,
            histories: &scratch.histories,
            wind,
            decay: scratch.decay,
            samples: sampling.map(Sampling::samples),
        };
        let task = |first: usize, vertices: &mut [VertexState], buffers: &mut TileScratch| {
            frame.advance(first, vertices, buffers);
        };
        let Some(sampling) = sampling else {
            for_each_tile_with(&mut state.vertices, &mut scratch.tiles, task);
            return;
        };
        // Sampled states are copied, because tiles are contiguous.
        let sampled = &mut scratch.sampled;
        sampled.clear();
        sampled.extend(sampling.samples().iter().map(|&v| state.vertices[v as usize]));
        for_each_tile_with(sampled, &mut scratch.tiles, task);
        let histories = &scratch.histories;
        let interpolation = SampleInterpolation::new(
            model,
            histories,
            state.motion.world_from_state(&model.character.skeleton),
        );
        interpolation.interpolate(histories, sampling, sampled, &mut state.vertices);
    }

    /// Sets all states to those of given world positions, blended by the garment's mask.
    pub(super) fn place(&mut self, positions: &[Vec3]) {
        self.set_states(|frame, vertex| frame.to_blended_state(positions[vertex]));
    }

    /// Sets all states to those of the mean displacement, to which the mask is applied already.
    pub(super) fn place_mean_shape(&mut self) {
        // World positions in between, because a root-relative state has another frame than the
        // mean.
        let mean = self.model.prior.mean.iter();
        let frames = self.scratch.histories.iter().map(|h| h.now);
        let positions: Vec<Vec3> = frames.zip(mean).map(|(f, &u)| f.position(u)).collect();
        self.set_states(|frame, vertex| frame.to_state(positions[vertex]));
    }

    /// Sets the state of every vertex to a function of its frame and its index.
    fn set_states(&mut self, state_of: impl Fn(&StateFrame, usize) -> Vec3) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let frames = StateFrames::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_state(&model.character.skeleton),
        );
        for (vertex, state) in state.vertices.iter_mut().enumerate() {
            state.value = state_of(&frames.of(vertex), vertex);
        }
        // Given positions need no projection.
        state.offsets.fill(VertexState::default());
    }

    /// Computes the shown world positions and normals of the current state.
    pub(super) fn finish(&mut self) {
        self.predict_positions();
        self.show(&mut |_| ());
    }

    /// Computes the world positions of the current states, before projection and corrections.
    pub(super) fn predict_positions(&mut self) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let vertices = &state.vertices;
        let frames = StateFrames::new(
            model,
            &scratch.histories,
            &scratch.prior,
            state.motion.world_from_state(&model.character.skeleton),
        );
        scratch.positions.resize(vertices.len(), Vec3::ZERO);
        for_each_tile(&mut scratch.positions, |first, positions| {
            for (i, position) in positions.iter_mut().enumerate() {
                *position = frames.of(first + i).to_world(vertices[first + i].value);
            }
        });
    }

    /// Advances the offsets of the strain projection to the predicted positions, if the model has
    /// one.
    pub(super) fn project(&mut self, memory: Memory) {
        let Self {
            model,
            state,
            scratch,
            ..
        } = self;
        let Some(projection) = &model.projection else {
            return;
        };
        let tick = ProjectionTick {
            dt: 1.0 / model.config.fps,
            origin: state
                .motion
                .world_from_state(&model.character.skeleton)
                .translation,
            memory,
        };
        let (points, predicted) = (&scratch.histories, &scratch.positions);
        projection.advance(
            tick,
            points,
            predicted,
            &mut state.offsets,
            &mut scratch.projection,
        );
    }

    /// Turns the predicted positions into the shown ones, with their normals, and calls `observe`
    /// after each stage.
    pub(super) fn show(&mut self, observe: &mut dyn FnMut(Stage)) {
        let Self { state, scratch, .. } = self;
        // Added here and not where they are computed, so that a restored state shows the same bytes.
        let (offsets, histories) = (&state.offsets, &scratch.histories);
        let shown = state.start.added_share();
        if !offsets.is_empty() {
            for_each_tile(&mut scratch.positions, |first, positions| {
                for (vertex, position) in (first..).zip(positions) {
                    *position += histories[vertex].now.rotation * (offsets[vertex].value * shown);
                }
            });
        }
        observe(Stage::Positions);
        self.correct_display();
        observe(Stage::Intersections);
        // Normals follow the corrections.
        let Self { model, scratch, .. } = self;
        vertex_normals(
            &scratch.positions,
            &model.garment.rest.faces,
            &mut scratch.normals,
        );
        observe(Stage::Normals);
    }
}
