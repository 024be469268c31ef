//! Values by name.

use clap::ValueEnum;
use unic_io::{Split, UpAxis};

/// [`unic_sim::Material`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MaterialName {
    /// Shirting.
    Cotton,
    /// Trouser twill.
    Denim,
    /// Light and limp.
    Silk,
    /// Net, stiff for its weight.
    Tulle,
}

/// On or off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    /// Yes.
    On,
    /// No.
    Off,
}

/// [`unic_train::Preset`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PresetName {
    /// The published method with its sizes, for comparison.
    Paper,
    /// The best that we know.
    Standard,
    /// Small, for slow machines and first tries.
    Tiny,
}

/// [`unic_train::Processor`] by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProcessorName {
    /// All cores.
    #[default]
    Cpu,
    /// An NVIDIA GPU; in programs built with --features cuda.
    Cuda,
    /// A GPU with a Vulkan driver; in programs built with --features vulkan.
    Vulkan,
    /// Apple's GPU; in programs built with --features metal.
    Metal,
}

impl From<ProcessorName> for unic_train::Processor {
    fn from(name: ProcessorName) -> Self {
        match name {
            ProcessorName::Cpu => Self::Cpu,
            ProcessorName::Cuda => Self::Cuda,
            ProcessorName::Vulkan => Self::Vulkan,
            ProcessorName::Metal => Self::Metal,
        }
    }
}

/// [`unic_builtin::scale::Network`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum NetworkName {
    /// Sizes of the preset of this name.
    Standard,
    /// The published sizes.
    Paper,
}

/// [`unic_core::network::Precision`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum PrecisionName {
    /// Single precision.
    F32,
    /// 8 significant bits: matrix units where the processor has them.
    Bf16,
    /// Whole numbers of 16 bits.
    Int16,
    /// Whole numbers of 8 bits.
    Int8,
}

impl PrecisionName {
    /// From exact to coarse.
    pub(crate) const ALL: [Self; 4] = [Self::F32, Self::Bf16, Self::Int16, Self::Int8];
}

/// [`Split`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SplitName {
    /// What nothing was fitted on.
    Test,
    /// What training watches.
    Validation,
    /// What training fits.
    Train,
}

/// A published data set, and how others measure on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProtocolName {
    /// Simulated T-shirts and dresses for virtual try-on: mean vertex error over 300 frames.
    Vto,
    /// Loose dresses of VirtualBones: RMSE and Hausdorff distance over whole clips.
    Virtualbones,
}

/// [`unic_core::config::IntersectionMode`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum IntersectionName {
    /// They stay there.
    Off,
    /// They are dragged out over the tangent plane of the nearest body vertex, as in the paper.
    Paper,
    /// They go the shortest way out of the parts of the body that carry them, and their neighbours with
    /// them.
    Robust,
}

/// [`UpAxis`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpName {
    /// Whichever the body's up direction follows on average.
    Auto,
    /// As here.
    Y,
    /// As in AMASS.
    Z,
}

impl From<PresetName> for unic_train::Preset {
    fn from(name: PresetName) -> Self {
        match name {
            PresetName::Paper => Self::Paper,
            PresetName::Standard => Self::Standard,
            PresetName::Tiny => Self::Tiny,
        }
    }
}

impl From<NetworkName> for unic_builtin::scale::Network {
    fn from(name: NetworkName) -> Self {
        match name {
            NetworkName::Standard => Self::Standard,
            NetworkName::Paper => Self::Paper,
        }
    }
}

impl From<PrecisionName> for unic_core::network::Precision {
    fn from(name: PrecisionName) -> Self {
        match name {
            PrecisionName::F32 => Self::F32,
            PrecisionName::Bf16 => Self::Bf16,
            PrecisionName::Int16 => Self::Int16,
            PrecisionName::Int8 => Self::Int8,
        }
    }
}

// `default_values_t` writes values by their names.
impl std::fmt::Display for NetworkName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(unic_builtin::scale::Network::from(*self).name())
    }
}

impl std::fmt::Display for PrecisionName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(unic_core::network::Precision::from(*self).name())
    }
}

impl From<MaterialName> for unic_sim::Material {
    fn from(name: MaterialName) -> Self {
        match name {
            MaterialName::Cotton => Self::COTTON,
            MaterialName::Denim => Self::DENIM,
            MaterialName::Silk => Self::SILK,
            MaterialName::Tulle => Self::TULLE,
        }
    }
}

impl From<SplitName> for Split {
    fn from(name: SplitName) -> Self {
        match name {
            SplitName::Test => Self::Test,
            SplitName::Validation => Self::Validation,
            SplitName::Train => Self::Train,
        }
    }
}

impl From<UpName> for UpAxis {
    fn from(name: UpName) -> Self {
        match name {
            UpName::Auto => Self::Auto,
            UpName::Y => Self::Y,
            UpName::Z => Self::Z,
        }
    }
}
