//! Opens the device of a processor.

use crate::{config::Products, error::TrainError, processor::Processor};
use burn::tensor::{Device, Tensor, TensorData};
use std::{
    panic,
    sync::{Mutex, PoisonError},
};
use unic_kernels::InstructionSet;

/// Opens the first device of a processor, with gradients, and runs one addition on it.
///
/// # Errors
/// [`TrainError::NotBuilt`] for a program without the processor's feature,
/// [`TrainError::Processor`] for a machine without such a device.
pub(crate) fn open(processor: Processor) -> Result<Device, TrainError> {
    let device = first(processor).ok_or(TrainError::NotBuilt { processor })?;
    if processor != Processor::Cpu {
        probe(&device).map_err(|found| TrainError::Processor { processor, found })?;
    }
    Ok(device.autodiff())
}

/// Checks that this machine can compute `products` on a processor.
///
/// # Errors
/// [`TrainError::Products`] where it cannot.
pub(crate) fn check(products: Products, processor: Processor) -> Result<(), TrainError> {
    match products {
        Products::Bf16 if processor != Processor::Cpu || !InstructionSet::Amx.is_available() => {
            Err(TrainError::Products { processor })
        }
        _ => Ok(()),
    }
}

/// Names the device without asking anything of the machine.
fn first(processor: Processor) -> Option<Device> {
    match processor {
        Processor::Cpu => Some(Device::flex()),
        #[cfg(feature = "cuda")]
        Processor::Cuda => Some(Device::cuda(0)),
        #[cfg(feature = "vulkan")]
        Processor::Vulkan => Some(Device::vulkan(burn::tensor::DeviceKind::DefaultDevice)),
        #[cfg(feature = "metal")]
        Processor::Metal => Some(Device::metal(burn::tensor::DeviceKind::DefaultDevice)),
        #[allow(unreachable_patterns, reason = "with all features there is none left")]
        _ => None,
    }
}

/// Adds 1 + 1 on a device. Burn's devices start with the first operation and panic where the
/// machine has none; the panic's message is the error.
fn probe(device: &Device) -> Result<(), String> {
    // The panic hook is global: one thread at a time, so that each puts back the hook that it
    // found.
    static HOOK: Mutex<()> = Mutex::new(());
    let _hook = HOOK.lock().unwrap_or_else(PoisonError::into_inner);
    let hook = panic::take_hook();
    panic::set_hook(Box::new(|_| {}));
    let sum = panic::catch_unwind(panic::AssertUnwindSafe(|| {
        let one = Tensor::<1>::from_data(TensorData::new(vec![1.0f32], [1]), device);
        (one.clone() + one).into_scalar::<f32>()
    }));
    panic::set_hook(hook);
    match sum {
        Ok(2.0) => Ok(()),
        Ok(sum) => Err(format!("a device on which 1 + 1 = {sum}")),
        Err(panic) => Err(match panic.downcast::<String>() {
            Ok(message) => *message,
            Err(other) => other
                .downcast::<&str>()
                .map_or("none".to_owned(), |message| (*message).to_owned()),
        }),
    }
}

/// Returns whether the tensor is on the CPU, where the fused operations are.
pub(crate) fn is_on_cpu<const D: usize>(tensor: &Tensor<D>) -> bool {
    tensor.device() == Device::flex()
}
