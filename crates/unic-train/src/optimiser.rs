//! AdamW over a Burn module, one pass over memory: gradients from Burn's autodiff, the update
//! fused.
//!
//! Equal to Burn's own AdamW (tested), which goes over each parameter several times and is three to
//! eight times slower on the paper's encoder of 23 million numbers.

use crate::{config::OptimiserConfig, device::is_on_cpu, error::TrainError, parameters};
use burn::backend::{Flex, tensor::FloatTensor};
use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor};
use unic_kernels::{AdamW, adamw_step, global_norm};

/// Running means of the gradient and of its square, in the order of the network's parameters.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moments {
    /// Running mean of the gradient.
    pub first: Vec<Vec<f32>>,
    /// Running mean of the squared gradient.
    pub second: Vec<Vec<f32>>,
}

impl Moments {
    /// Zeros in the sizes of a network's parameters.
    pub fn new<N: Module>(network: &N) -> Self {
        let mut zeros = parameters::values(network);
        zeros.iter_mut().for_each(|values| values.fill(0.0));
        Self {
            first: zeros.clone(),
            second: zeros,
        }
    }
}

/// Updates a network with the gradients of one loss; `step` counts from 0. Returns the gradient's
/// global norm before clipping; one that is not finite leaves everything as it was.
///
/// Parameters that no other network shares are updated where they lie on the CPU; those of another
/// device are brought there and back.
///
/// # Errors
/// None for moments of this network.
pub fn update<N: Module + Default>(
    network: &mut N,
    gradients: GradientsParams,
    moments: &mut Moments,
    config: &OptimiserConfig,
    learning_rate: f64,
    step: u64,
) -> Result<f64, TrainError> {
    let mut collected = Collected {
        gradients,
        values: Vec::new(),
    };
    network.visit(&mut collected);
    let slices: Vec<&[f32]> = collected.values.iter().map(values).collect();
    let norm = global_norm(&slices);
    if !norm.is_finite() {
        return Ok(norm);
    }
    let clip = config.clip_norm > 0.0 && norm > config.clip_norm;
    let mut updated = Updated {
        gradients: &slices,
        moments,
        settings: AdamW {
            lr: learning_rate as f32,
            weight_decay: config.weight_decay,
            ..AdamW::default()
        },
        // Bias correction counts from 1. At the limit of u32 it has long been 1 in f32.
        step: u32::try_from(step + 1).unwrap_or(u32::MAX),
        scale: if clip {
            (config.clip_norm / norm) as f32
        } else {
            1.0
        },
        index: 0,
        result: Ok(()),
    };
    *network = std::mem::take(network).map(&mut updated);
    updated.result.map(|()| norm)
}

/// Visitor that collects contiguous gradients in the order of the parameters.
struct Collected {
    gradients: GradientsParams,
    values: Vec<FloatTensor<Flex>>,
}

/// Returns a contiguous tensor on the CPU without gradient. A CPU tensor is not copied if it is
/// contiguous.
fn on_cpu<const D: usize>(tensor: Tensor<D>) -> FloatTensor<Flex> {
    let tensor = match is_on_cpu(&tensor) {
        true => tensor,
        false => tensor.to_device(&Device::flex()),
    };
    // Either branch above returns a tensor on the CPU.
    tensor
        .try_into_primitive::<Flex>()
        .expect("CPU tensors")
        .to_contiguous()
}

impl ModuleVisitor for Collected {
    fn visit_float<const D: usize>(&mut self, parameter: &Param<Tensor<D>>) {
        let gradient = self
            .gradients
            .remove::<D>(parameter.id)
            // A parameter that the loss does not depend on has no gradient.
            .unwrap_or_else(|| parameter.val().inner().zeros_like());
        self.values.push(on_cpu(gradient));
    }
}

struct Updated<'a> {
    gradients: &'a [&'a [f32]],
    moments: &'a mut Moments,
    settings: AdamW,
    step: u32,
    scale: f32,
    index: usize,
    result: Result<(), TrainError>,
}

impl ModuleMapper for Updated<'_> {
    fn map_float<const D: usize>(&mut self, parameter: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let (id, tensor, mapper) = parameter.consume();
        let device = tensor.device().inner();
        let mut tensor = on_cpu(tensor.inner());
        let step = adamw_step(
            tensor.storage_mut::<f32>(),
            self.gradients[self.index],
            &mut self.moments.first[self.index],
            &mut self.moments.second[self.index],
            &self.settings,
            self.step,
            self.scale,
        );
        if let Err(error) = step {
            self.result = Err(error.into());
        }
        self.index += 1;
        let tensor = Tensor::<D>::from_primitive::<Flex>(tensor)
            .to_device(&device)
            .autodiff()
            .require_grad();
        Param::from_mapped_value(id, tensor, mapper)
    }
}

fn values(tensor: &FloatTensor<Flex>) -> &[f32] {
    // Made contiguous above; parameters and gradients are f32.
    tensor.as_slice::<f32>().expect("contiguous f32 values")
}
