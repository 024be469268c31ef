//! The deformation field as one differentiable operation.
//!
//! On the CPU it is fused: a tile of vertices goes through all layers while it is in cache, in
//! forward and backward (`unic-kernels`). Elsewhere it is composed of Burn's operations, which are
//! also what the fused one is tested and measured against.

use crate::{config::Products, device::is_on_cpu};
use burn::backend::autodiff::{
    checkpoint::{base::Checkpointer, strategy::NoCheckpointing},
    grads::Gradients as Registry,
    ops::{Backward, Ops, OpsKind},
};
use burn::backend::{Autodiff, Flex, TensorMetadata, ops::FloatTensorOps, tensor::FloatTensor};
use burn::tensor::{Shape, Tensor, TensorData, activation};
use std::{
    fmt,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};
use unic_kernels::{
    BackwardScratch, Batch, Field, FieldShape, Gradients, InstructionSet, KernelError, Retention,
    SavedActivations,
};

/// The field of one step, for the device of its parameters.
#[derive(Clone, Debug)]
pub enum FieldOperation {
    /// Fused operation on the CPU.
    Fused(PackedField),
    /// Burn's operations on another device, see [`composed`].
    Composed {
        /// Sizes.
        shape: FieldShape,
        /// Flat parameters, `[K]`.
        parameters: Tensor<1>,
    },
}

impl FieldOperation {
    /// Creates the operation from parameters `[K]`, flat by [`FieldShape::layout`].
    ///
    /// # Errors
    /// The errors of [`PackedField::new`]; products that a device other than the CPU does not have.
    pub fn new(shape: FieldShape, parameters: Tensor<1>, products: Products) -> Result<Self, KernelError> {
        match (is_on_cpu(&parameters), products) {
            (true, _) => Ok(Self::Fused(PackedField::new(shape, parameters, products)?)),
            (false, Products::F32) => Ok(Self::Composed { shape, parameters }),
            (false, Products::Bf16) => Err(KernelError::Instructions(InstructionSet::Amx)),
        }
    }

    /// Computes the same as [`PackedField::forward`] from tensors on the device of the parameters.
    ///
    /// # Errors
    /// The errors of [`PackedField::forward`].
    pub fn forward(&self, points: Tensor<2>, latents: Tensor<2>) -> Result<Tensor<2>, KernelError> {
        match self {
            Self::Fused(field) => field.forward(points, latents),
            Self::Composed { shape, parameters } => Ok(composed(shape, points, latents, parameters.clone())),
        }
    }
}

/// The field with its parameters packed for the processor: once a step, for all frames of a
/// rollout.
#[derive(Clone)]
pub struct PackedField {
    field: Arc<Field>,
    products: Products,
    parameters: Tensor<1>,
}

impl PackedField {
    /// Packs parameters `[K]` on the CPU, flat by [`FieldShape::layout`].
    ///
    /// # Errors
    /// Sizes out of range, another number of parameters, products that the processor does not have.
    ///
    /// # Panics
    /// Panics for a tensor that is not on the CPU; [`composed`] is for other devices.
    pub fn new(shape: FieldShape, parameters: Tensor<1>, products: Products) -> Result<Self, KernelError> {
        let (values, _) = cpu(parameters.clone().autodiff()).into_parts();
        let mut field = match products {
            Products::F32 => Field::new(shape)?,
            Products::Bf16 => Field::with_instructions(shape, InstructionSet::Amx)?,
        };
        field.load(slice(&values.to_contiguous()))?;
        Ok(Self {
            field: Arc::new(field),
            products,
            parameters,
        })
    }

    /// Points `[G·n, P]` and latents `[G, L]` on the CPU to `[G·n, O]`, point p of group p / n.
    /// Gradients flow to all three.
    ///
    /// # Errors
    /// Sizes that do not fit the shape.
    ///
    /// # Panics
    /// Panics for tensors that are not on the CPU.
    pub fn forward(&self, points: Tensor<2>, latents: Tensor<2>) -> Result<Tensor<2>, KernelError> {
        let points_per_group = points.dims()[0] / latents.dims()[0].max(1);
        let (points, points_node) = cpu(points.autodiff()).into_parts();
        let (latents, latents_node) = cpu(latents.autodiff()).into_parts();
        let (parameters, parameters_node) = cpu(self.parameters.clone().autodiff()).into_parts();
        let (points, latents) = (points.to_contiguous(), latents.to_contiguous());
        let batch = Batch {
            points: slice(&points),
            latents: slice(&latents),
            points_per_group,
        };
        let sizes = [points.shape()[0], self.field.shape().outputs];
        let mut outputs = vec![0.0; sizes[0] * sizes[1]];
        let mut saved = match self.products {
            Products::F32 => ACTIVATIONS.take(),
            // Matrix units compute the activations again faster than memory can load them.
            Products::Bf16 => SavedActivations::new(Retention::Recompute),
        };
        self.field.forward(&batch, &mut outputs, &mut saved)?;
        let outputs = primitive(outputs, sizes);
        let nodes = [points_node, latents_node, parameters_node];
        let tensor = match FusedField
            .prepare::<NoCheckpointing>(nodes)
            .compute_bound()
            .stateful()
        {
            OpsKind::Tracked(prepared) => {
                let forward = Arc::new(Forward {
                    field: self.field.clone(),
                    saved,
                    points_per_group,
                });
                let count = parameters.shape();
                prepared.finish(
                    State {
                        forward,
                        points,
                        latents,
                        parameters: count,
                    },
                    outputs,
                )
            }
            OpsKind::UnTracked(prepared) => prepared.finish(outputs),
        };
        Ok(Tensor::from_primitive::<Autodiff<Flex>>(tensor))
    }
}

impl fmt::Debug for PackedField {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "packed field of {:?}", self.field.shape())
    }
}

/// The field of Burn's own operations, on any device, from flat parameters `[K]`.
pub fn composed(
    shape: &FieldShape,
    points: Tensor<2>,
    latents: Tensor<2>,
    parameters: Tensor<1>,
) -> Tensor<2> {
    let [groups, latent] = latents.dims();
    let rows = points.dims()[0];
    let spread: Tensor<3> = latents.unsqueeze_dim(1);
    let spread = spread.repeat_dim(1, rows / groups).reshape([rows, latent]);
    let input = Tensor::cat(vec![points, spread], 1); // [G·n, P + L]
    let last = shape.hidden_layers;
    (shape.layout().iter().enumerate()).fold(input.clone(), |hidden, (i, map)| {
        let hidden = if shape.skip == Some(i) {
            Tensor::cat(vec![hidden, input.clone()], 1)
        } else {
            hidden
        };
        let weight = parameters
            .clone()
            .slice([map.weight.clone()])
            .reshape([map.outputs, map.inputs()]);
        let bias = parameters
            .clone()
            .slice([map.bias.clone()])
            .reshape([1, map.outputs]);
        let output = hidden.matmul(weight.transpose()) + bias;
        if i < last {
            activation::relu(output)
        } else {
            output
        }
    })
}

#[derive(Debug)]
struct FusedField;

/// Results of the forward pass that the backward pass needs.
struct Forward {
    field: Arc<Field>,
    saved: SavedActivations,
    points_per_group: usize,
}

impl Drop for Forward {
    fn drop(&mut self) {
        // With recomputation there are no activations, and so no large buffers to reuse.
        if self.saved.retention() == Retention::Activations {
            ACTIVATIONS.put(std::mem::take(&mut self.saved));
        }
    }
}

/// Buffers that are not in use. A step's activations are tens of megabytes; fresh from the system
/// they cost a page fault every 4 KB, which is a fifth of the step.
struct Spare<T>(Mutex<Vec<T>>);

static ACTIVATIONS: Spare<SavedActivations> = Spare(Mutex::new(Vec::new()));
static SCRATCH: Spare<BackwardScratch> = Spare(Mutex::new(Vec::new()));

/// Buffers kept at most: more than a rollout has frames.
const MOST_SPARE: usize = 64;

impl<T: Default> Spare<T> {
    fn take(&self) -> T {
        self.all().pop().unwrap_or_default()
    }

    fn put(&self, buffer: T) {
        let mut all = self.all();
        if all.len() < MOST_SPARE {
            all.push(buffer);
        }
    }

    /// A poisoned lock means that a thread panicked while it held a sound list of buffers.
    fn all(&self) -> MutexGuard<'_, Vec<T>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Clones share everything: tensors are counted references.
#[derive(Clone)]
struct State {
    forward: Arc<Forward>,
    points: FloatTensor<Flex>,
    latents: FloatTensor<Flex>,
    /// Shape of the tensor of weights and biases. Its values are in the packed field.
    parameters: Shape,
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
        let State {
            forward,
            points,
            latents,
            parameters,
        } = ops.state;
        let batch = Batch {
            points: slice(&points),
            latents: slice(&latents),
            points_per_group: forward.points_per_group,
        };
        let shapes = [points.shape(), latents.shape(), parameters];
        let zeros = |shape: &Shape| vec![0.0; shape.num_elements()];
        let [mut to_points, mut to_latents, mut to_parameters] = shapes.each_ref().map(zeros);
        let gradients = Gradients {
            points: &mut to_points,
            latents: &mut to_latents,
            parameters: &mut to_parameters,
        };
        let mut scratch = SCRATCH.take();
        let done = forward
            .field
            .backward(&batch, &forward.saved, slice(&upstream), gradients, &mut scratch);
        SCRATCH.put(scratch);
        // The forward pass has checked every size that this pass sees again.
        assert!(done.is_ok(), "{done:?}");
        let values = [to_points, to_latents, to_parameters];
        for ((node, shape), values) in ops.parents.into_iter().zip(shapes).zip(values) {
            if let Some(node) = node {
                registry.register::<Flex>(node.id, primitive(values, shape));
            }
        }
    }
}

/// The CPU's representation of a tensor that takes part in a graph.
pub(crate) fn cpu<const D: usize>(tensor: Tensor<D>) -> FloatTensor<Autodiff<Flex>> {
    // Documented: a tensor of another device is a mistake in the program, not in its input.
    tensor
        .try_into_primitive::<Autodiff<Flex>>()
        .expect("CPU tensors")
}

pub(crate) fn slice(tensor: &FloatTensor<Flex>) -> &[f32] {
    // Every caller makes it contiguous first, and nothing here is of another type.
    tensor.as_slice::<f32>().expect("contiguous f32 values")
}

pub(crate) fn primitive(values: Vec<f32>, shape: impl Into<Shape>) -> FloatTensor<Flex> {
    Flex::float_from_data(TensorData::new(values, shape.into()), &Default::default())
}
