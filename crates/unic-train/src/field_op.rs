//! The deformation field as one differentiable operation.
//!
//! On the CPU it is fused: a tile of vertices goes through all layers while it is in cache, in
//! forward and backward (`unic-kernels`). Elsewhere it is composed of Burn's operations, which are
//! also what the fused one is tested and measured against.

use burn::backend::autodiff::{
    checkpoint::{base::Checkpointer, strategy::NoCheckpointing},
    grads::Gradients as Registry,
    ops::{Backward, Ops, OpsKind},
};
use burn::backend::{Autodiff, Flex, TensorMetadata, ops::FloatTensorOps, tensor::FloatTensor};
use burn::tensor::{Tensor, TensorData, activation};
use std::{fmt, sync::Arc};
use unic_kernels::{BackwardScratch, Batch, Field, FieldShape, Gradients, KernelError, Saved};

/// `points` [G·n, P], `latents` [G, L], `parameters` [K] (flat, by `FieldShape::layout`) to [G·n, 3],
/// on CPU tensors, fused.
///
/// # Errors
/// Sizes that do not fit the shape.
pub fn fused(
    shape: FieldShape,
    points: Tensor<2>,
    latents: Tensor<2>,
    parameters: Tensor<1>,
) -> Result<Tensor<2>, KernelError> {
    let groups = latents.dims()[0];
    let points_per_group = points.dims()[0] / groups.max(1);
    let (points, points_node) = cpu(points.autodiff()).into_parts();
    let (latents, latents_node) = cpu(latents.autodiff()).into_parts();
    let (parameters, parameters_node) = cpu(parameters.autodiff()).into_parts();
    let (points, latents, parameters) =
        (points.to_contiguous(), latents.to_contiguous(), parameters.to_contiguous());
    let mut field = Field::new(shape)?;
    field.load(slice(&parameters))?;
    let batch = Batch { points: slice(&points), latents: slice(&latents), points_per_group };
    let rows = points.shape()[0];
    let mut outputs = vec![0.0; rows * shape.outputs];
    let mut saved = Saved::default();
    field.forward(&batch, &mut outputs, &mut saved)?;
    let outputs = primitive(outputs, [rows, shape.outputs]);
    let nodes = [points_node, latents_node, parameters_node];
    let tensor = match FusedField.prepare::<NoCheckpointing>(nodes).compute_bound().stateful() {
        OpsKind::Tracked(prepared) => {
            let forward = Arc::new(Forward { field, saved, points_per_group });
            prepared.finish(State { forward, points, latents, parameters }, outputs)
        }
        OpsKind::UnTracked(prepared) => prepared.finish(outputs),
    };
    Ok(Tensor::from_primitive::<Autodiff<Flex>>(tensor))
}

/// The same of Burn's own operations, on any device.
pub fn composed(shape: &FieldShape, points: Tensor<2>, latents: Tensor<2>, parameters: Tensor<1>) -> Tensor<2> {
    let [groups, latent] = latents.dims();
    let rows = points.dims()[0];
    let spread: Tensor<3> = latents.unsqueeze_dim(1);
    let spread = spread.repeat_dim(1, rows / groups).reshape([rows, latent]);
    let input = Tensor::cat(vec![points, spread], 1); // [G·n, P + L]
    let last = shape.hidden_layers;
    (shape.layout().iter().enumerate()).fold(input.clone(), |hidden, (i, map)| {
        let hidden = if shape.skip == Some(i) { Tensor::cat(vec![hidden, input.clone()], 1) } else { hidden };
        let weight = parameters.clone().slice([map.weight.clone()]).reshape([map.outputs, map.inputs()]);
        let bias = parameters.clone().slice([map.bias.clone()]).reshape([1, map.outputs]);
        let output = hidden.matmul(weight.transpose()) + bias;
        if i < last { activation::relu(output) } else { output }
    })
}

#[derive(Debug)]
struct FusedField;

/// What the forward pass leaves for the backward pass.
struct Forward {
    field: Field,
    saved: Saved,
    points_per_group: usize,
}

/// Clones share everything: tensors are counted references.
#[derive(Clone)]
struct State {
    forward: Arc<Forward>,
    points: FloatTensor<Flex>,
    latents: FloatTensor<Flex>,
    parameters: FloatTensor<Flex>,
}

impl fmt::Debug for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "fused field over {:?}", self.points.shape())
    }
}

impl Backward<Flex, 3> for FusedField {
    type State = State;

    fn backward(self, ops: Ops<State, 3>, registry: &mut Registry, _: &mut Checkpointer) {
        let upstream = registry.consume::<Flex>(&ops.node).to_contiguous();
        let State { forward, points, latents, parameters } = ops.state;
        let batch = Batch {
            points: slice(&points),
            latents: slice(&latents),
            points_per_group: forward.points_per_group,
        };
        let sources = [&points, &latents, &parameters];
        let [mut to_points, mut to_latents, mut to_parameters] =
            sources.map(|t| vec![0.0; t.shape().num_elements()]);
        let gradients = Gradients {
            points: &mut to_points,
            latents: &mut to_latents,
            parameters: &mut to_parameters,
        };
        let scratch = &mut BackwardScratch::default();
        let done = forward.field.backward(&batch, &forward.saved, slice(&upstream), gradients, scratch);
        // The forward pass has checked every size that this pass sees again.
        debug_assert!(done.is_ok(), "{done:?}");
        let values = [to_points, to_latents, to_parameters];
        for ((node, source), values) in ops.parents.into_iter().zip(sources).zip(values) {
            if let Some(node) = node {
                let data = TensorData::new(values, source.shape());
                registry.register::<Flex>(node.id, Flex::float_from_data(data, &Default::default()));
            }
        }
    }
}

/// The CPU's representation of a tensor that takes part in a graph.
fn cpu<const D: usize>(tensor: Tensor<D>) -> FloatTensor<Autodiff<Flex>> {
    tensor.try_into_primitive::<Autodiff<Flex>>().expect("callers pass CPU tensors")
}

fn slice(tensor: &FloatTensor<Flex>) -> &[f32] {
    tensor.as_slice::<f32>().expect("contiguous f32 values")
}

fn primitive<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape), &Default::default())
}
