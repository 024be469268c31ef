//! Names of the processors that networks are trained on.

use std::fmt;

/// Processor that computes losses and gradients. All but the CPU need the cargo feature of their
/// name.
///
/// Data, random numbers, the optimiser's update and checkpoints stay on the CPU in every case. A
/// run that is stopped on one processor can go on on another; its result is then close but not the
/// same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Processor {
    /// CPU, by the fused field of `unic-kernels`.
    #[default]
    Cpu,
    /// NVIDIA GPU, by CUDA.
    Cuda,
    /// Any GPU with a Vulkan driver.
    Vulkan,
    /// Apple GPU, by Metal.
    Metal,
}

impl Processor {
    /// Returns whether this program was built with support for the processor.
    pub fn is_built(self) -> bool {
        match self {
            Self::Cpu => true,
            Self::Cuda => cfg!(feature = "cuda"),
            Self::Vulkan => cfg!(feature = "vulkan"),
            Self::Metal => cfg!(feature = "metal"),
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
