//! Memory of the garment that an animator was given, and the residuals of the replay, on the device.

use crate::{
    GpuContext, GpuError,
    kernel::{Dispatch, Kernel, Source},
};
use std::ops::Range;
use unic_core::{
    Model,
    animator::{LEAST_SHARE, NEVER_GIVEN_M},
    config::StateConfig,
};
use wgpu::Buffer;

/// Change of the memory in one program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MemoryUpdate {
    /// Frame 0 of given positions.
    BeginGiven,
    /// Frame 0 of the mean shape.
    BeginAtMean,
    /// Frame 0 once its velocities are known.
    CountAgain,
    /// Frame of a restored state.
    Keep,
    /// Next tick, in which displacements stay within the excursion of the model.
    Advance,
    /// Next tick of a mode that corrects states, in which they fade.
    AdvanceFading,
}

/// Regions of an animator's vectors that the memory reads and writes.
#[derive(Clone, Debug)]
pub(crate) struct MemoryRegions {
    /// Coefficients of the prior.
    pub(crate) coefficients: usize,
    /// Coefficients of the prior without those of the replay.
    pub(crate) moved: usize,
    /// Coefficients, without those of the replay, in the frame that the garment was given in.
    pub(crate) given: Range<usize>,
    /// Coefficients of the replay.
    pub(crate) residuals: usize,
    /// Excursion in metres, share and factor of displacements, and one number for alignment.
    pub(crate) memory: usize,
}

impl MemoryRegions {
    /// Place of the share of the given displacement that is left.
    pub(crate) fn share(&self) -> usize {
        self.memory + 1
    }

    /// Place of the factor of displacements in the current tick.
    pub(crate) fn factor(&self) -> usize {
        self.memory + 2
    }
}

/// Kernels of the memory. Asset.
#[derive(Debug)]
pub(crate) struct StartMemoryKernels {
    begin_given: Kernel,
    begin_at_mean: Kernel,
    count_again: Kernel,
    keep: Kernel,
    give: Kernel,
    /// Kernels of `Advance` and `AdvanceFading`; none if states are positions, which have no memory.
    advance: Option<[Kernel; 2]>,
    sizes: Buffer,
}

impl StartMemoryKernels {
    pub(crate) fn new(context: &GpuContext, model: &Model, regions: &MemoryRegions) -> Self {
        let config = match &model.config().state {
            StateConfig::RootRelative => None,
            StateConfig::Displacement(config) => Some(config),
        };
        let within = config.and_then(|c| c.excursion_m).unwrap_or(0.0);
        let fade = config.map_or(0.0, |c| c.decay(1.0 / model.config().fps));
        let constants = [
            ("COMPONENTS", model.prior().len() as f64),
            ("COEFFICIENTS", regions.coefficients as f64),
            ("MOVED", regions.moved as f64),
            ("GIVEN", regions.given.start as f64),
            ("RESIDUALS", regions.residuals as f64),
            ("MEMORY", regions.memory as f64),
            ("NEVER_GIVEN", f64::from(NEVER_GIVEN_M)),
            ("LEAST_SHARE", f64::from(LEAST_SHARE)),
            ("FADE", f64::from(fade)),
        ];
        let kernel = |entry: &str, within: f32| {
            let source = Source {
                text: include_str!("kernels/start_memory.wgsl"),
                entry,
                constants: &[&constants[..], &[("WITHIN", f64::from(within))]].concat(),
            };
            Kernel::new(context, &source)
        };
        Self {
            begin_given: kernel("begin_given", within),
            begin_at_mean: kernel("begin_at_mean", within),
            count_again: kernel("count_again", within),
            keep: kernel("keep", within),
            give: kernel("give", within),
            advance: config.map(|_| [within, 0.0].map(|within| kernel("advance", within))),
            sizes: context.upload("component sizes", model.component_sizes()),
        }
    }

    /// Makes the dispatch between the coefficients that the motion moves and those with the
    /// residuals.
    pub(crate) fn record(&self, vectors: &Buffer, update: MemoryUpdate) -> Result<Dispatch, GpuError> {
        let kernel = match (update, &self.advance) {
            (MemoryUpdate::Advance, Some([advance, _]))
            | (MemoryUpdate::AdvanceFading, Some([_, advance])) => {
                return advance.dispatch(&[(0, &self.sizes), (1, vectors)], 1);
            }
            (MemoryUpdate::BeginGiven, _) => &self.begin_given,
            (MemoryUpdate::BeginAtMean, _) => &self.begin_at_mean,
            (MemoryUpdate::CountAgain, _) => &self.count_again,
            (MemoryUpdate::Keep | MemoryUpdate::Advance | MemoryUpdate::AdvanceFading, _) => &self.keep,
        };
        kernel.dispatch(&[(1, vectors)], 1)
    }

    /// Makes the dispatch that begins the memory of positions given in the current frame.
    pub(crate) fn record_given(&self, vectors: &Buffer) -> Result<Dispatch, GpuError> {
        self.give.dispatch(&[(1, vectors)], 1)
    }
}
