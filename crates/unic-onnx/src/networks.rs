//! Encoder, prior and field as parts of a graph.

use crate::{
    graph::{Graph, Value},
    port::{PRIOR_MEAN, PRIOR_SHAPES, RECURRENCE},
};
use unic_core::{
    Model, config::LatentCode, network::Linear, prior::Prior, recurrence::Recurrence as RecurrentUnit,
};

/// Code of the motion.
pub(crate) struct Code {
    /// Logits (channels, categories).
    pub(crate) logits: Value,
    /// Latent vector (1, L).
    pub(crate) latent: Value,
}

/// Encodes a motion pair (1, 2 D). Each channel picks its largest logit.
pub(crate) fn encode(graph: &mut Graph, model: &Model, pair: Value) -> Code {
    graph.scope("encoder");
    let layers = model.encoder().layers();
    let logits = (layers.iter().enumerate()).fold(pair, |x, (i, layer)| {
        let y = graph.linear(x, layer);
        match i + 1 < layers.len() {
            true => graph.map("Elu", y),
            false => y,
        }
    });
    let config = &model.config().encoder;
    let shape = [config.channels as i64, config.categories as i64];
    let logits = graph.reshape(logits, &shape);
    let picked = match config.code {
        LatentCode::PickedLogit => graph.maximum(logits),
        LatentCode::OneHot => {
            // Rows of the identity, because runtimes differ in what ONNX's own operation takes.
            let size = config.categories;
            let one_at = |i: usize| if i.is_multiple_of(size + 1) { 1.0 } else { 0.0 };
            let identity: Vec<f32> = (0..size * size).map(one_at).collect();
            let identity = graph.constant(&[size, size], &identity);
            let largest = graph.largest(logits);
            graph.take_at(identity, largest, 0)
        }
    };
    Code {
        logits,
        latent: graph.reshape(picked, &[1, -1]),
    }
}

/// Moment at which the prior is evaluated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Moment {
    /// The first frame: the recurrence is in the steady state of its motion.
    Start,
    /// A tick after the state of the inputs.
    Tick,
}

/// The prior in one frame.
pub(crate) struct PriorFrame {
    /// State (1, 2 M) of the recurrence, if there is one.
    recurrence: Option<Value>,
    /// Coefficients (1, K), if there are components.
    pub(crate) coefficients: Option<Value>,
}

impl PriorFrame {
    /// Evaluates the coefficients for a motion pair (1, 2 D).
    pub(crate) fn new(graph: &mut Graph, prior: &Prior, pair: Value, moment: Moment) -> Self {
        graph.scope("prior");
        if prior.is_empty() {
            return Self {
                recurrence: None,
                coefficients: None,
            };
        }
        let linear = graph.linear(pair, &prior.map);
        let Some(unit) = &prior.recurrence else {
            return Self {
                recurrence: None,
                coefficients: Some(linear),
            };
        };
        let embedding = elu_of(graph, pair, &unit.embedding);
        let state = oscillate(graph, unit, embedding, moment);
        let memory = elu_of(graph, state, &unit.memory);
        let joined = graph.concat(&[memory, embedding], 1);
        let hidden = elu_of(graph, joined, &unit.hidden);
        let added = graph.linear(hidden, &unit.head);
        Self {
            recurrence: Some(state),
            coefficients: Some(graph.add(linear, added)),
        }
    }

    /// Sum (V, 3) of the components with their coefficients, metres; none without components.
    pub(crate) fn deviation(&self, graph: &mut Graph) -> Option<Value> {
        let coefficients = self.coefficients?;
        let shapes = graph.input(PRIOR_SHAPES);
        let column = graph.reshape(coefficients, &[-1, 1]);
        let sum = graph.matmul(shapes, column);
        Some(graph.reshape(sum, &[-1, 3]))
    }

    /// Displacements (V, 3) of the prior, metres.
    pub(crate) fn displacements(&self, graph: &mut Graph) -> Value {
        let mean = graph.input(PRIOR_MEAN);
        match self.deviation(graph) {
            Some(deviation) => graph.add(mean, deviation),
            None => mean,
        }
    }

    /// Declares the state after the tick as an output.
    pub(crate) fn output_state(&self, graph: &mut Graph) {
        if let Some(state) = self.recurrence {
            graph.output(RECURRENCE, state);
        }
    }
}

fn elu_of(graph: &mut Graph, x: Value, layer: &Linear) -> Value {
    let y = graph.linear(x, layer);
    graph.map("Elu", y)
}

/// State (1, 2 M) of the oscillators, driven by an embedded motion.
fn oscillate(graph: &mut Graph, unit: &RecurrentUnit, embedding: Value, moment: Moment) -> Value {
    let drive = graph.linear(embedding, &unit.drive);
    match moment {
        // h = λ h + u
        Moment::Tick => {
            let state = graph.input(RECURRENCE);
            let turned = complex_product(graph, state, &unit.poles);
            graph.add(turned, drive)
        }
        // h = u / (1 − λ)
        Moment::Start => {
            let inverse = |&[re, im]: &[f32; 2]| {
                let (a, b) = (1.0 - re, -im);
                let norm = a * a + b * b;
                [a / norm, -b / norm]
            };
            let factors: Vec<[f32; 2]> = unit.poles.iter().map(inverse).collect();
            complex_product(graph, drive, &factors)
        }
    }
}

/// Products of complex numbers (1, 2 M), real parts first, with constants.
fn complex_product(graph: &mut Graph, numbers: Value, factors: &[[f32; 2]]) -> Value {
    let count = factors.len();
    let real: Vec<f32> = factors.iter().map(|f| f[0]).collect();
    let imaginary = factors.iter().map(|f| f[1]);
    let crossed: Vec<f32> = imaginary.clone().map(|im| -im).chain(imaginary).collect();
    let swap: Vec<i64> = (count..2 * count).chain(0..count).map(|i| i as i64).collect();
    let swapped = graph.take(numbers, &swap, 1);
    let shape = [1, 2 * count];
    let real = graph.constant(&shape, &real.repeat(2));
    let crossed = graph.constant(&shape, &crossed);
    let direct = graph.mul(numbers, real);
    let crossed = graph.mul(swapped, crossed);
    graph.add(direct, crossed)
}

/// Outputs (V, 3) of the field for inputs (V, P) and a latent vector (1, L).
///
/// All vertices share the latent vector, so its products are added to biases once.
pub(crate) fn field(graph: &mut Graph, model: &Model, inputs: Value, latent: Value) -> Value {
    let layers = model.field().layers();
    let points = model.field().point_inputs();
    let skip = model.config().field.skip;
    let mut x = inputs;
    for (i, layer) in layers.iter().enumerate() {
        let hidden = if i == 0 { 0 } else { model.config().field.width };
        x = match i {
            0 => folded(graph, layer, [hidden, points], [inputs, latent]),
            i if skip == Some(i) => {
                let bias = folded(graph, layer, [hidden, points], [inputs, latent]);
                let weight = columns(graph, layer, 0, hidden);
                graph.linear_with(x, weight, bias)
            }
            _ => graph.linear(x, layer),
        };
        if i + 1 < layers.len() {
            x = graph.map("Relu", x);
        }
    }
    x
}

/// Part (V, outputs) of a layer that reads inputs (V, P) and the latent vector (1, L), biases
/// included. The layer's columns are [`hidden`, `points`, latent].
fn folded(
    graph: &mut Graph,
    layer: &Linear,
    [hidden, points]: [usize; 2],
    [inputs, latent]: [Value; 2],
) -> Value {
    let bias = graph.constant(&[layer.outputs], &layer.bias);
    let weight = columns(graph, layer, hidden + points, layer.inputs);
    let bias = graph.linear_with(latent, weight, bias);
    let weight = columns(graph, layer, hidden, hidden + points);
    graph.linear_with(inputs, weight, bias)
}

/// Columns `start..end` of a layer's weights as a constant.
fn columns(graph: &mut Graph, layer: &Linear, start: usize, end: usize) -> Value {
    let rows = layer.weight.chunks_exact(layer.inputs);
    let weights: Vec<f32> = rows.flat_map(|row| &row[start..end]).copied().collect();
    graph.constant(&[layer.outputs, end - start], &weights)
}
