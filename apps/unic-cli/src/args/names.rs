//! Values of options that are chosen by name, and what they stand for in the libraries.

// The libraries do not depend on clap. Each of their enums that an option chooses from has a twin
// here, whose doc comments are the help texts of the values.

use clap::ValueEnum;
use unic_io::{Split, UpAxis};

/// [`unic_sim::Material`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MaterialName {
    /// Cotton shirting.
    Cotton,
    /// Denim trouser twill.
    Denim,
    /// Silk, light and soft.
    Silk,
    /// Tulle net, stiff for its weight.
    Tulle,
}

/// Choice between on and off.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Switch {
    /// On.
    On,
    /// Off.
    Off,
}

/// [`unic_train::Preset`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PresetName {
    /// Published method with its network sizes, for comparison.
    Paper,
    /// Recommended settings, with the smallest measured errors.
    Standard,
    /// Small networks, for slow machines and first tries.
    Tiny,
}

/// [`unic_train::Processor`] by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ProcessorName {
    /// CPU, on the number of threads of --threads.
    #[default]
    Cpu,
    /// NVIDIA GPU; needs a program built with --features cuda.
    Cuda,
    /// GPU with a Vulkan driver; needs a program built with --features vulkan.
    Vulkan,
    /// Apple GPU; needs a program built with --features metal.
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

/// [`unic_builtin::scale::NetworkSize`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum NetworkName {
    /// Sizes of the preset of this name.
    Standard,
    /// The published sizes.
    Paper,
}

/// [`unic_core::Precision`] by name.
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
    /// All precisions, from the most exact to the coarsest.
    pub(crate) const ALL: [Self; 4] = [Self::F32, Self::Bf16, Self::Int16, Self::Int8];
}

/// [`Split`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SplitName {
    /// Clips that training never opens.
    Test,
    /// Clips on which training measures its error on unseen motion.
    Validation,
    /// Clips that training fits.
    Train,
}

/// Published data set with its evaluation protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProtocolName {
    /// VTO, simulated T-shirts and dresses: mean vertex error over 300 frames.
    Vto,
    /// VirtualBones, loose dresses: RMSE and Hausdorff distance over whole clips.
    Virtualbones,
}

/// [`unic_core::IntersectionMode`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum IntersectionName {
    /// Vertices inside the body stay there.
    Off,
    /// Vertices move outside the tangent plane of the nearest body vertex, as in the paper.
    Paper,
    /// Vertices and their neighbours take the shortest way out of the body parts that carry them.
    Robust,
}

/// Axis that points up in a mesh file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MeshUpName {
    /// +Y, as in captures.
    Y,
    /// +Z, as in Blender.
    Z,
}

/// [`UpAxis`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum UpName {
    /// The axis, Y or Z, that the trunk follows on average.
    Auto,
    /// +Y, as in captures.
    Y,
    /// +Z, as in AMASS.
    Z,
}

/// [`unic_io::FootLock`] by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum FeetName {
    /// Held if the motion was transferred from another skeleton.
    Auto,
    /// Held in place on the ground while they are slow and low.
    Hold,
    /// Kept as they are.
    Keep,
}

impl From<FeetName> for unic_io::FootLock {
    fn from(name: FeetName) -> Self {
        match name {
            FeetName::Auto => Self::Auto,
            FeetName::Hold => Self::Hold,
            FeetName::Keep => Self::Keep,
        }
    }
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

impl From<NetworkName> for unic_builtin::scale::NetworkSize {
    fn from(name: NetworkName) -> Self {
        match name {
            NetworkName::Standard => Self::Standard,
            NetworkName::Paper => Self::Paper,
        }
    }
}

impl From<PrecisionName> for unic_core::Precision {
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
        f.write_str(unic_builtin::scale::NetworkSize::from(*self).name())
    }
}

impl std::fmt::Display for PrecisionName {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(unic_core::Precision::from(*self).name())
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

/// [`unic_viewer::PainterChoice`] by name.
#[cfg(feature = "viewer")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RendererName {
    /// The graphics adapter if there is one, else the software rasteriser.
    Auto,
    /// The graphics adapter.
    Gpu,
    /// The software rasteriser: without threads, prints and marks.
    Software,
}

#[cfg(feature = "viewer")]
impl From<RendererName> for unic_viewer::PainterChoice {
    fn from(name: RendererName) -> Self {
        match name {
            RendererName::Auto => Self::Auto,
            RendererName::Gpu => Self::Gpu,
            RendererName::Software => Self::Software,
        }
    }
}

/// [`unic_eval::control::Script`] by name.
#[cfg(feature = "viewer")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum ScriptName {
    /// Circle of radius 2 m.
    Circle,
    /// Two circles of radius 2 m, to the left and to the right.
    #[value(name = "figure_8")]
    Figure8,
    /// Square of side 4 m.
    Square,
    /// Curves to alternate sides.
    Slalom,
    /// Straight walk that turns back every three seconds.
    Reversals,
    /// Straight walk with stops.
    StartStop,
    /// Mouse that jumps about at random.
    RandomMouse,
    /// Stick that is moved at random.
    RandomStick,
}

#[cfg(feature = "viewer")]
impl From<ScriptName> for unic_eval::control::Script {
    fn from(name: ScriptName) -> Self {
        match name {
            ScriptName::Circle => Self::Circle,
            ScriptName::Figure8 => Self::Figure8,
            ScriptName::Square => Self::Square,
            ScriptName::Slalom => Self::Slalom,
            ScriptName::Reversals => Self::Reversals,
            ScriptName::StartStop => Self::StartStop,
            ScriptName::RandomMouse => Self::RandomMouse,
            ScriptName::RandomStick => Self::RandomStick,
        }
    }
}
