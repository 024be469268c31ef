//! A direct implementation of the field in f64: the reference of all tests.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]
#![allow(dead_code, reason = "each test file uses a part of it")]

use unic_kernels::*;

/// Random values in ±scale from a seed (splitmix64).
pub(crate) fn numbers(count: usize, scale: f64, seed: u64) -> Vec<f32> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) as f64 / u64::MAX as f64
    };
    (0..count)
        .map(|_| (scale * (2.0 * next() - 1.0)) as f32)
        .collect()
}

/// Shape, parameters and inputs of a field.
pub(crate) struct Case {
    pub(crate) shape: FieldShape,
    pub(crate) groups: usize,
    pub(crate) points_per_group: usize,
    pub(crate) parameters: Vec<f32>,
    pub(crate) points: Vec<f32>,
    pub(crate) latents: Vec<f32>,
}

impl Case {
    pub(crate) fn new(shape: FieldShape, groups: usize, points_per_group: usize, seed: u64) -> Self {
        // He initialisation, which keeps the magnitude of activations from layer to layer.
        let spread = (6.0 / shape.hidden as f64).sqrt();
        Self {
            shape,
            groups,
            points_per_group,
            parameters: numbers(shape.parameter_count(), spread, seed),
            points: numbers(groups * points_per_group * shape.point_inputs, 1.0, seed + 1),
            latents: numbers(groups * shape.latent, 1.0, seed + 2),
        }
    }

    pub(crate) fn batch(&self) -> Batch<'_> {
        Batch {
            points: &self.points,
            latents: &self.latents,
            points_per_group: self.points_per_group,
        }
    }

    pub(crate) fn output_count(&self) -> usize {
        self.groups * self.points_per_group * self.shape.outputs
    }

    pub(crate) fn field(&self) -> Field {
        self.field_on(InstructionSet::detect())
    }

    pub(crate) fn field_on(&self, set: InstructionSet) -> Field {
        let mut field = Field::with_instructions(self.shape, set).unwrap();
        field.load(&self.parameters).unwrap();
        field
    }

    /// Computes outputs, and the gradients of Σ output · output_gradient by reverse accumulation.
    pub(crate) fn reference(&self, output_gradients: &[f32]) -> Reference {
        let shape = &self.shape;
        let mut result = Reference {
            outputs: Vec::new(),
            points: vec![0.0; self.points.len()],
            latents: vec![0.0; self.latents.len()],
            parameters: vec![0.0; self.parameters.len()],
            nearest_kink: f64::INFINITY,
        };
        for point in 0..self.groups * self.points_per_group {
            let group = point / self.points_per_group;
            let trace = self.trace(point, group);
            result.nearest_kink = result.nearest_kink.min(trace.nearest_kink);
            result.outputs.extend(&trace.values[shape.hidden_layers + 1]);
            let range = point * shape.outputs..(point + 1) * shape.outputs;
            self.reverse(point, group, &trace.values, &output_gradients[range], &mut result);
        }
        result
    }

    /// Runs the forward pass of one point.
    fn trace(&self, point: usize, group: usize) -> Trace {
        let (mut values, mut nearest_kink) = (vec![Vec::new()], f64::INFINITY);
        for (index, map) in self.shape.layout().iter().enumerate() {
            let input = self.map_input(index, point, group, &values[index]);
            let output = (0..map.outputs).map(|row| {
                let weight =
                    &self.parameters[map.weight.clone()][row * map.inputs()..(row + 1) * map.inputs()];
                let sum = weight
                    .iter()
                    .zip(&input)
                    .map(|(&w, x)| f64::from(w) * x)
                    .sum::<f64>();
                let value = sum + f64::from(self.parameters[map.bias.start + row]);
                if index < self.shape.hidden_layers {
                    nearest_kink = nearest_kink.min(value.abs());
                    value.max(0.0)
                } else {
                    value
                }
            });
            values.push(output.collect());
        }
        Trace { values, nearest_kink }
    }

    /// Input of a map: the hidden values, and the point's input and the latent where the map takes
    /// them.
    fn map_input(&self, index: usize, point: usize, group: usize, hidden: &[f64]) -> Vec<f64> {
        let (p, l) = (self.shape.point_inputs, self.shape.latent);
        let mut input = hidden.to_vec();
        if index == 0 || self.shape.skip == Some(index) {
            input.extend(
                self.points[point * p..(point + 1) * p]
                    .iter()
                    .map(|&x| f64::from(x)),
            );
            input.extend(
                self.latents[group * l..(group + 1) * l]
                    .iter()
                    .map(|&z| f64::from(z)),
            );
        }
        input
    }

    /// Adds the gradients of one point to the result. `values` are those of [`Trace`].
    fn reverse(
        &self,
        point: usize,
        group: usize,
        values: &[Vec<f64>],
        output_gradients: &[f32],
        result: &mut Reference,
    ) {
        let (p, l) = (self.shape.point_inputs, self.shape.latent);
        let mut gradient: Vec<f64> = output_gradients.iter().map(|&g| f64::from(g)).collect();
        for (index, map) in self.shape.layout().iter().enumerate().rev() {
            let input = self.map_input(index, point, group, &values[index]);
            let mut below = vec![0.0; map.inputs()];
            for (row, g) in gradient.iter().enumerate() {
                result.parameters[map.bias.start + row] += g;
                for column in 0..map.inputs() {
                    let place = map.weight.start + row * map.inputs() + column;
                    result.parameters[place] += g * input[column];
                    below[column] += g * f64::from(self.parameters[place]);
                }
            }
            let (hidden, rest) = below.split_at(map.hidden_inputs);
            let (x, z) = rest.split_at(map.point_inputs);
            x.iter()
                .zip(&mut result.points[point * p..])
                .for_each(|(g, sum)| *sum += g);
            z.iter()
                .zip(&mut result.latents[group * l..])
                .for_each(|(g, sum)| *sum += g);
            let activations = hidden.iter().zip(&values[index]);
            gradient = activations
                .map(|(g, value)| if *value > 0.0 { *g } else { 0.0 })
                .collect();
        }
    }
}

/// Values of one point in the forward pass.
struct Trace {
    /// Output of each map: entry i + 1 is that of map i; entry 0 is empty.
    values: Vec<Vec<f64>>,
    /// Smallest magnitude of a ReLU's input.
    nearest_kink: f64,
}

/// Outputs and gradients of the reference.
pub(crate) struct Reference {
    pub(crate) outputs: Vec<f64>,
    pub(crate) points: Vec<f64>,
    pub(crate) latents: Vec<f64>,
    pub(crate) parameters: Vec<f64>,
    /// Smallest magnitude of a ReLU's input.
    pub(crate) nearest_kink: f64,
}

/// Outputs and gradients of the kernels.
#[derive(PartialEq, Debug)]
pub(crate) struct Computed {
    pub(crate) outputs: Vec<f32>,
    pub(crate) points: Vec<f32>,
    pub(crate) latents: Vec<f32>,
    pub(crate) parameters: Vec<f32>,
}

/// Runs the forward and the backward pass. The parameter gradients are added to `before`.
pub(crate) fn compute(
    case: &Case,
    field: &Field,
    saved: &mut SavedActivations,
    output_gradients: &[f32],
    before: f32,
) -> Computed {
    let mut result = Computed {
        outputs: vec![f32::NAN; case.output_count()],
        points: vec![f32::NAN; case.points.len()],
        latents: vec![f32::NAN; case.latents.len()],
        parameters: vec![before; case.parameters.len()],
    };
    field.forward(&case.batch(), &mut result.outputs, saved).unwrap();
    let gradients = Gradients {
        points: &mut result.points,
        latents: &mut result.latents,
        parameters: &mut result.parameters,
    };
    let scratch = &mut BackwardScratch::default();
    field
        .backward(&case.batch(), saved, output_gradients, gradients, scratch)
        .unwrap();
    result
}

/// Smallest magnitude per value that errors are relative to. Values that are smaller come from
/// terms of order one that cancel, whose rounding errors remain.
const LEAST_SIZE: f64 = 1e-2;

/// Relative error ‖found − expected‖ / √(‖expected‖² + n · [`LEAST_SIZE`]²).
pub(crate) fn relative_error(found: &[f32], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let error = square(&mut found.iter().zip(expected).map(|(f, e)| f64::from(*f) - e));
    let size = square(&mut expected.iter().copied());
    (error / (size + expected.len().max(1) as f64 * LEAST_SIZE * LEAST_SIZE)).sqrt()
}
