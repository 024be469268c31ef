//! Point inputs of the field, and the states of the vertices, as parts of a graph.

use crate::{
    graph::{Graph, Value},
    kinematics::Skinned,
    networks::field,
    port::{DISPLACEMENT, DISPLACEMENT_BEFORE, MASK, POSITIONS, REST, ROOT_RELATIVE, SKINNED_BEFORE, WIND},
};
use unic_core::{
    Model,
    animator::FARTHEST,
    config::{DisplacementConfig, PointInput},
    features::{StateInputs, VELOCITY_UNIT},
};

/// Frame of states that are displacements.
#[derive(Clone, Copy)]
pub(crate) struct DisplacementFrame {
    pub(crate) skinned: Skinned,
    /// Displacements (V, 3) of the prior, metres.
    pub(crate) prior: Value,
}

/// Frame of states that are positions relative to the root joint.
#[derive(Clone, Copy)]
pub(crate) struct RootFrame {
    /// Rotation (1, 4).
    pub(crate) rotation: Value,
    /// Position of the root joint (1, 3), metres.
    pub(crate) origin: Value,
}

impl DisplacementFrame {
    /// World positions (V, 3) of displacements (V, 3) in the vertices' rotated frames.
    pub(crate) fn positions(self, graph: &mut Graph, displacements: Value) -> Value {
        let matrices = graph.matrices(self.skinned.rotations);
        let turned = graph.rotated(matrices, displacements);
        graph.add(self.skinned.positions, turned)
    }

    /// Advances the displacements of the inputs by one tick, and declares them and the positions as
    /// outputs.
    pub(crate) fn advance(
        self,
        graph: &mut Graph,
        model: &Model,
        config: &DisplacementConfig,
        latent: Value,
    ) {
        graph.scope("field");
        let before = graph.input(DISPLACEMENT);
        let inputs = self.point_inputs(graph, model, config, before);
        let output = field(graph, model, inputs, latent);
        let output = limited(graph, output, config.output_limit);
        let mut change = graph.scale(output, config.scale_m);
        if model.garment().mask.is_some() {
            let mask = graph.input(MASK);
            change = graph.mul(change, mask);
        }
        let kept = graph.scale(before, config.decay(1.0 / model.config().fps));
        let displacement = graph.add(kept, change);
        self.output_state(graph, config, [before, displacement]);
        let total = graph.add(self.prior, displacement);
        let positions = self.positions(graph, total);
        graph.output(POSITIONS, positions);
    }

    /// Declares the state as outputs: displacements one tick earlier and now, and what the inputs
    /// of the next tick need beside them.
    pub(crate) fn output_state(
        self,
        graph: &mut Graph,
        config: &DisplacementConfig,
        [before, now]: [Value; 2],
    ) {
        graph.output(DISPLACEMENT, now);
        if config.inputs.contains(&PointInput::Velocity) {
            graph.output(DISPLACEMENT_BEFORE, before);
        }
        if config.inputs.contains(&PointInput::SkinVelocity) {
            graph.output(SKINNED_BEFORE, self.skinned.positions);
        }
    }

    /// Inputs (V, P) of the field beside the latent vector.
    fn point_inputs(
        self,
        graph: &mut Graph,
        model: &Model,
        config: &DisplacementConfig,
        displacement: Value,
    ) -> Value {
        let factors = StateInputs::new(config);
        let scaled = factors.displacement.map(|k| graph.scale(displacement, k));
        let change = factors.velocity.map(|k| {
            let before = graph.input(DISPLACEMENT_BEFORE);
            let change = graph.sub(displacement, before);
            graph.scale(change, k)
        });
        let mut inputs: Vec<Value> = factors.ordered(scaled, change).collect();
        let matrices = graph.matrices(self.skinned.rotations);
        for input in &config.inputs {
            inputs.push(match input {
                PointInput::Rest => normalised_rest(graph, model),
                // Rᵀ (0, 1, 0) is the second row of R.
                PointInput::Up => graph.slice(matrices, 3, 6, 1),
                PointInput::SkinVelocity => {
                    let velocity = self.velocity_in_air(graph, model);
                    let own = graph.unrotated(matrices, velocity);
                    graph.scale(own, 1.0 / VELOCITY_UNIT)
                }
                // In front of the others already.
                PointInput::Displacement | PointInput::Velocity => continue,
            });
        }
        graph.concat(&inputs, 1)
    }

    /// Velocities (V, 3) of the skinned points relative to the air, m/s.
    fn velocity_in_air(self, graph: &mut Graph, model: &Model) -> Value {
        let before = graph.input(SKINNED_BEFORE);
        let moved = graph.sub(self.skinned.positions, before);
        let velocity = graph.scale(moved, model.config().fps);
        let wind = graph.input(WIND);
        graph.sub(velocity, wind)
    }
}

/// Rest positions (V, 3), scaled to the bounding box of training.
fn normalised_rest(graph: &mut Graph, model: &Model) -> Value {
    let rest = graph.input(REST);
    let centre = graph.constant(&[3], &model.rest_box().centre.to_array());
    let centred = graph.sub(rest, centre);
    let half = graph.scalar(model.rest_box().half_extent);
    graph.div(centred, half)
}

/// Outputs (V, 3) of the field, shortened to a length. Outputs that are not finite become zero.
fn limited(graph: &mut Graph, output: Value, limit: f32) -> Value {
    let squared = graph.squared_lengths(output);
    let length = graph.map("Sqrt", squared);
    let longest = graph.at_least(length, limit);
    let limit = graph.scalar(limit);
    let factor = graph.div(limit, longest);
    let short = graph.mul(output, factor);
    // False for NaN and infinity.
    let is_finite = graph.is_below(squared, f32::INFINITY);
    let zero = graph.scalar(0.0);
    graph.choose(is_finite, short, zero)
}

impl RootFrame {
    /// World positions (V, 3) of positions (V, 3) relative to the root joint.
    pub(crate) fn positions(self, graph: &mut Graph, states: Value) -> Value {
        let turned = graph.rotated_together(self.rotation, states);
        graph.add(turned, self.origin)
    }

    /// Positions (V, 3) relative to the root joint of world positions (V, 3).
    pub(crate) fn states(self, graph: &mut Graph, positions: Value) -> Value {
        let matrix = graph.matrices(self.rotation);
        let offsets = graph.sub(positions, self.origin);
        graph.unrotated_together(matrix, offsets)
    }

    /// Advances the positions of the inputs by one tick, and declares them as outputs.
    pub(crate) fn advance(self, graph: &mut Graph, model: &Model, latent: Value) {
        graph.scope("field");
        let before = graph.input(ROOT_RELATIVE);
        let output = field(graph, model, before, latent);
        let sum = graph.add(before, output);
        // A state that diverges stays where it can be shown. False for NaN.
        let magnitude = graph.map("Abs", sum);
        let is_near = graph.is_below(magnitude, FARTHEST.next_up());
        let is_near = graph.zero_or_one(is_near);
        let all_near = graph.minimum(is_near);
        let half = graph.scalar(0.5);
        let is_usable = graph.less(half, all_near);
        let state = graph.choose(is_usable, sum, before);
        graph.output(ROOT_RELATIVE, state);
        let positions = self.positions(graph, state);
        graph.output(POSITIONS, positions);
    }
}
