//! One tick of the deformation field on a tile of vertices.

use super::{input::FARTHEST, state::VertexState};
use crate::{
    config::{DisplacementConfig, StateConfig},
    features::{PointHistory, StateInputs, StepConditions, limited, write_frame_inputs},
    model::Model,
    network::{FieldBiases, FieldScratch, TILE},
};
use glam::Vec3;

/// Inputs of the field that belong to one frame.
pub(super) struct FieldFrame<'a> {
    pub(super) model: &'a Model,
    pub(super) biases: &'a FieldBiases,
    pub(super) histories: &'a [PointHistory],
    /// Velocity of the air, m/s, world space.
    pub(super) wind: Vec3,
    /// Factor by which the states of the previous tick enter this one.
    pub(super) decay: f32,
    /// Vertices that the field is evaluated at; `None` for all of them.
    pub(super) samples: Option<&'a [u32]>,
}

/// Scratch memory for one tile of vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct TileScratch {
    /// Inputs of the tile by channel and vertex, as the field reads them.
    inputs: Vec<[f32; TILE]>,
    /// Inputs of one vertex.
    point: Vec<f32>,
    field: FieldScratch,
}

impl FieldFrame<'_> {
    /// Advances up to [`TILE`] vertices by one tick.
    ///
    /// `first` is the index of the first of them among the evaluated vertices.
    pub(super) fn advance(&self, first: usize, vertices: &mut [VertexState], scratch: &mut TileScratch) {
        if self.model.is_field_skipped() {
            return self.fade(vertices);
        }
        self.gather(first, vertices, scratch);
        let mut outputs = [[0.0; TILE]; 3];
        let TileScratch { inputs, field, .. } = scratch;
        self.model
            .field
            .evaluate(self.biases, inputs, field, &mut outputs);
        for (lane, vertex) in vertices.iter_mut().enumerate() {
            let output = Vec3::from_array(outputs.map(|channel| channel[lane]));
            let share = self.histories[self.index(first + lane)].now.share;
            *vertex = VertexState {
                value: self.updated(vertex.value, output, share),
                previous: vertex.value,
            };
        }
    }

    /// Advances vertices by one tick of a field that is zero.
    fn fade(&self, vertices: &mut [VertexState]) {
        for vertex in vertices {
            *vertex = VertexState {
                value: self.updated(vertex.value, Vec3::ZERO, 1.0),
                previous: vertex.value,
            };
        }
    }

    /// Writes the inputs of a tile, transposed from vertices to channels.
    fn gather(&self, first: usize, vertices: &[VertexState], scratch: &mut TileScratch) {
        let TileScratch { inputs, point, .. } = scratch;
        // Lanes beyond the last vertex keep numbers of an earlier tile. Lanes are independent, and
        // the outputs of these are not read.
        inputs.resize(self.model.field.point_inputs(), [0.0; TILE]);
        point.resize(inputs.len(), 0.0);
        for (lane, vertex) in vertices.iter().enumerate() {
            self.write_inputs(self.index(first + lane), vertex, point);
            inputs
                .iter_mut()
                .zip(&*point)
                .for_each(|(channel, x)| channel[lane] = *x);
        }
    }

    /// Returns the vertex at an index among the evaluated ones.
    fn index(&self, evaluated: usize) -> usize {
        self.samples
            .map_or(evaluated, |samples| samples[evaluated] as usize)
    }

    fn write_inputs(&self, index: usize, vertex: &VertexState, out: &mut [f32]) {
        match &self.model.config.state {
            StateConfig::RootRelative => out.copy_from_slice(&vertex.value.to_array()),
            StateConfig::Displacement(config) => self.write_displacement_inputs(config, index, vertex, out),
        }
    }

    fn write_displacement_inputs(
        &self,
        config: &DisplacementConfig,
        index: usize,
        vertex: &VertexState,
        out: &mut [f32],
    ) {
        let model = self.model;
        let (state, frame) = out.split_at_mut(model.config.state.state_input_len());
        StateInputs::new(config).write(vertex.value, vertex.previous, state);
        let rest = model.rest_box.normalised(model.garment.rest.vertices[index]);
        let step = StepConditions {
            dt: 1.0 / model.config.fps,
            wind: self.wind,
        };
        write_frame_inputs(config, rest, &self.histories[index], step, frame);
    }

    /// Returns the state after a tick with this output of the field; `share` is the vertex's mask.
    fn updated(&self, value: Vec3, output: Vec3, share: f32) -> Vec3 {
        match &self.model.config.state {
            StateConfig::RootRelative => integrated(value, output),
            StateConfig::Displacement(config) => {
                // The prior is masked when the model is made, so that the mask applies here alone.
                value * self.decay + limited(output, config.output_limit) * (share * config.scale_m)
            }
        }
    }
}

/// Returns `value + output`, or `value` if the sum is not finite or beyond [`FARTHEST`].
///
/// A root-relative state is a sum without decay, which can diverge. It stays a position that can be
/// shown, saved and reset.
fn integrated(value: Vec3, output: Vec3) -> Vec3 {
    let sum = value + output;
    // The maximum of a vector's elements may hide a NaN.
    match sum.abs().max_element() <= FARTHEST && sum.is_finite() {
        true => sum,
        false => value,
    }
}
