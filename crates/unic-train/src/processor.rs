//! Where networks are trained.

use crate::error::TrainError;
use burn::tensor::{Device, Tensor, TensorData};
use std::{
    fmt, panic,
    sync::{Mutex, PoisonError},
};

/// What computes losses and gradients. All but the CPU need the cargo feature of their name.
///
/// Data, random numbers, optimiser and checkpoints stay with the CPU whatever it is: a run stopped on one
/// processor goes on on another, to a result that is near but not the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// By the fused field of `unic-kernels`.
    #[default]
    Cpu,
    /// NVIDIA's, by CUDA.
    Cuda,
    /// Any GPU with a Vulkan driver.
    Vulkan,
    /// Apple's.
    Metal,
}

impl Processor {
    /// Was this program built for it?
    pub fn is_built(self) -> bool {
        match self {
            Self::Cpu => true,
            Self::Cuda => cfg!(feature = "cuda"),
            Self::Vulkan => cfg!(feature = "vulkan"),
            Self::Metal => cfg!(feature = "metal"),
        }
    }

    /// Its first device, with gradients, after a first addition there.
    ///
    /// # Errors
    /// A program built without it, a machine that has none.
    pub(crate) fn device(self) -> Result<Device, TrainError> {
        let device = self.first().ok_or(TrainError::NotBuilt { processor: self })?;
        if self != Self::Cpu {
            let error = |found| TrainError::Processor {
                processor: self,
                found,
            };
            probe(&device).map_err(error)?;
        }
        Ok(device.autodiff())
    }

    /// Nothing is asked of the machine yet.
    fn first(self) -> Option<Device> {
        match self {
            Self::Cpu => Some(Device::flex()),
            #[cfg(feature = "cuda")]
            Self::Cuda => Some(Device::cuda(0)),
            #[cfg(feature = "vulkan")]
            Self::Vulkan => Some(Device::vulkan(burn::tensor::DeviceKind::DefaultDevice)),
            #[cfg(feature = "metal")]
            Self::Metal => Some(Device::metal(burn::tensor::DeviceKind::DefaultDevice)),
            #[allow(unreachable_patterns, reason = "with all features there is none left")]
            _ => None,
        }
    }
}

impl fmt::Display for Processor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cpu => "cpu",
            Self::Cuda => "cuda",
            Self::Vulkan => "vulkan",
            Self::Metal => "metal",
        })
    }
}

/// Burn's devices come up with the first operation, and panic where there are none: what they say then.
fn probe(device: &Device) -> Result<(), String> {
    // Silenced by one thread at a time, so that each puts back what it has found.
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
        Ok(sum) => Err(format!("one that says 1 + 1 = {sum}")),
        Err(panic) => Err(match panic.downcast::<String>() {
            Ok(words) => *words,
            Err(other) => other
                .downcast::<&str>()
                .map_or("none".to_owned(), |w| (*w).to_owned()),
        }),
    }
}

/// Is the tensor where the fused operations are?
pub(crate) fn is_on_cpu<const D: usize>(tensor: &Tensor<D>) -> bool {
    tensor.device() == Device::flex()
}
