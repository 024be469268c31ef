//! Linear layers that are applied to one vector a frame: encoder, prior, recurrence, and the
//! product of the latent vector with the field's weights.

use crate::{
    GpuContext, GpuError, Precision,
    kernel::{Dispatch, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use unic_core::network::Linear;
use wgpu::Buffer;

/// Number of rows that one workgroup of `linear.wgsl` computes.
const ROWS: usize = 8;

/// Allocator of regions in the buffer of vectors that the layers of one animator read and write.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Regions {
    numbers: usize,
}

impl Regions {
    /// Allocates `numbers` and returns their start, a multiple of four. Padding after them stays
    /// zero.
    // The kernel reads vectors of four numbers.
    pub(crate) fn take(&mut self, numbers: usize) -> usize {
        let start = self.numbers;
        self.numbers += numbers.next_multiple_of(4);
        start
    }

    /// Length of all regions.
    pub(crate) fn len(self) -> usize {
        self.numbers
    }
}

/// Use of the result W x + b.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum OutputMode {
    /// Stores the result.
    Replace = 0,
    /// Stores the ELU of the result.
    Elu = 1,
    /// Adds the result to the stored numbers.
    Add = 2,
}

/// Linear layer from one region to another.
pub(crate) struct LinearMap<'a> {
    pub(crate) layer: &'a Linear,
    /// Columns of the layer that are used. Each range is padded to a multiple of four, as its input
    /// is.
    pub(crate) columns: &'a [Range<usize>],
    /// Start of x.
    pub(crate) from: usize,
    /// Start of y.
    pub(crate) to: usize,
    pub(crate) output: OutputMode,
}

/// Linear layer on the device.
#[derive(Clone, Debug)]
pub(crate) struct LinearDispatcher {
    kernel: Kernel,
    layer: Buffer,
    weights: Buffer,
    biases: Buffer,
    groups: usize,
}

/// Uniforms in the memory layout of `linear.wgsl`.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Layer {
    inputs4: u32,
    outputs: u32,
    input4: u32,
    output: u32,
    activation: u32,
    padding: [u32; 3],
}

/// Kernels of all linear layers.
pub(crate) struct LinearKernels {
    full: Kernel,
    half: Kernel,
}

impl LinearKernels {
    pub(crate) fn new(context: &GpuContext) -> Self {
        let kernel = |weights: &str| {
            let text = include_str!("kernels/linear.wgsl").replace("//{weights}", weights);
            let source = Source {
                text: &text,
                entry: "linear",
                constants: &[],
            };
            Kernel::new(context, &source)
        };
        Self {
            full: kernel(
                "@group(0) @binding(1) var<storage, read> weights: array<vec4<f32>>;
                 fn weight(i: u32) -> vec4<f32> { return weights[i]; }",
            ),
            // Half-precision weights are unpacked to f32, which needs no feature of the device.
            half: kernel(
                "@group(0) @binding(1) var<storage, read> weights: array<vec2<u32>>;
                 fn weight(i: u32) -> vec4<f32> {
                     return vec4<f32>(unpack2x16float(weights[i].x), unpack2x16float(weights[i].y));
                 }",
            ),
        }
    }

    pub(crate) fn map(
        &self,
        context: &GpuContext,
        precision: Precision,
        map: &LinearMap,
    ) -> LinearDispatcher {
        let rows = padded_rows(map.layer, map.columns);
        let kernel = match precision {
            Precision::F32 => &self.full,
            Precision::F16 | Precision::F16Matrix => &self.half,
        };
        let outputs = map.layer.outputs;
        // Offsets are counted in vectors of four: regions and rows are padded to them.
        let layer = Layer {
            inputs4: (rows.len() / outputs.max(1) / 4) as u32,
            outputs: outputs as u32,
            input4: (map.from / 4) as u32,
            output: map.to as u32,
            activation: map.output as u32,
            padding: [0; 3],
        };
        LinearDispatcher {
            kernel: kernel.clone(),
            layer: context.uniform("layer", &layer),
            weights: context.upload_weights("weights", precision, &rows),
            biases: context.upload("biases", &map.layer.bias),
            groups: outputs.div_ceil(ROWS),
        }
    }
}

impl LinearDispatcher {
    pub(crate) fn dispatch(&self, vectors: &Buffer) -> Result<Dispatch, GpuError> {
        let buffers = [
            (0, &self.layer),
            (1, &self.weights),
            (2, &self.biases),
            (3, vectors),
        ];
        self.kernel.dispatch(&buffers, self.groups)
    }
}

/// Packs ranges of columns of every row, each padded with zeros to a multiple of four.
fn padded_rows(layer: &Linear, columns: &[Range<usize>]) -> Vec<f32> {
    let width: usize = columns.iter().map(|range| range.len().next_multiple_of(4)).sum();
    let mut rows = Vec::with_capacity(width * layer.outputs);
    for row in layer.weight.chunks_exact(layer.inputs.max(1)) {
        for range in columns {
            rows.extend_from_slice(&row[range.clone()]);
            rows.resize(rows.len().next_multiple_of(4), 0.0);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_range_of_columns_is_padded_to_a_multiple_of_four() {
        let layer = Linear {
            inputs: 6,
            outputs: 2,
            weight: (1..=12u8).map(f32::from).collect(),
            bias: vec![0.0; 2],
        };
        let rows = padded_rows(&layer, &[0..5, 5..6]);
        let first = [1.0, 2.0, 3.0, 4.0, 5.0, 0.0, 0.0, 0.0, 6.0, 0.0, 0.0, 0.0];
        assert_eq!(rows[..12], first);
        assert_eq!((rows.len(), rows[12], rows[20]), (24, 7.0, 12.0));
    }

    #[test]
    fn regions_start_at_multiples_of_four() {
        let mut regions = Regions::default();
        let starts = [5, 4, 0, 1].map(|numbers| regions.take(numbers));
        assert_eq!((starts, regions.len()), ([0, 8, 12, 12], 16));
    }
}
