//! Linear maps of one vector a frame: encoder, prior, recurrence, the latent's share of the field.

use crate::{
    GpuContext, GpuError, Precision,
    kernel::{Dispatch, Kernel, Source},
};
use bytemuck::{Pod, Zeroable};
use std::ops::Range;
use unic_core::network::Linear;
use wgpu::Buffer;

/// Rows that one workgroup of `linear.wgsl` takes.
const ROWS: usize = 8;

/// Regions of the buffer of vectors that the maps of one animator read and write.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Regions {
    numbers: usize,
}

impl Regions {
    /// Where the next `numbers` go: a multiple of four. What fills up stays zero.
    pub(crate) fn take(&mut self, numbers: usize) -> usize {
        let start = self.numbers;
        self.numbers += numbers.next_multiple_of(4);
        start
    }

    /// Numbers in all.
    pub(crate) fn len(self) -> usize {
        self.numbers
    }
}

/// What happens to W x + b.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(crate) enum Output {
    Replaces = 0,
    Elu = 1,
    Adds = 2,
}

/// A linear map between two regions.
pub(crate) struct Map<'a> {
    pub(crate) layer: &'a Linear,
    /// Columns that are used; each run of them is padded to whole quadruples, as its input is.
    pub(crate) columns: &'a [Range<usize>],
    /// Where x starts.
    pub(crate) from: usize,
    /// Where y starts.
    pub(crate) to: usize,
    pub(crate) output: Output,
}

/// A map on the device.
#[derive(Clone, Debug)]
pub(crate) struct Dense {
    kernel: Kernel,
    layer: Buffer,
    weights: Buffer,
    biases: Buffer,
    groups: usize,
}

/// As in `linear.wgsl`.
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

/// The kernels of all maps.
pub(crate) struct DenseKernels {
    full: Kernel,
    half: Kernel,
}

impl DenseKernels {
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
            // Needs no feature: halves are unpacked, arithmetic is in f32.
            half: kernel(
                "@group(0) @binding(1) var<storage, read> weights: array<vec2<u32>>;
                 fn weight(i: u32) -> vec4<f32> {
                     return vec4<f32>(unpack2x16float(weights[i].x), unpack2x16float(weights[i].y));
                 }",
            ),
        }
    }

    pub(crate) fn map(&self, context: &GpuContext, precision: Precision, map: &Map) -> Dense {
        let rows = padded_rows(map.layer, map.columns);
        let kernel = match precision {
            Precision::F32 => &self.full,
            Precision::F16 | Precision::F16Matrix => &self.half,
        };
        let outputs = map.layer.outputs;
        let layer = Layer {
            inputs4: (rows.len() / outputs.max(1) / 4) as u32,
            outputs: outputs as u32,
            input4: (map.from / 4) as u32,
            output: map.to as u32,
            activation: map.output as u32,
            padding: [0; 3],
        };
        Dense {
            kernel: kernel.clone(),
            layer: context.uniform("layer", &layer),
            weights: context.upload_weights("weights", precision, &rows),
            biases: context.upload("biases", &map.layer.bias),
            groups: outputs.div_ceil(ROWS),
        }
    }
}

impl Dense {
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

/// The chosen columns of every row, each run padded with zeros to whole quadruples.
fn padded_rows(layer: &Linear, columns: &[Range<usize>]) -> Vec<f32> {
    let width: usize = columns.iter().map(|run| run.len().next_multiple_of(4)).sum();
    let mut rows = Vec::with_capacity(width * layer.outputs);
    for row in layer.weight.chunks_exact(layer.inputs.max(1)) {
        for run in columns {
            rows.extend_from_slice(&row[run.clone()]);
            rows.resize(rows.len().next_multiple_of(4), 0.0);
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_of_columns_fills_whole_quadruples() {
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
    fn regions_start_at_quadruples() {
        let mut regions = Regions::default();
        let starts = [5, 4, 0, 1].map(|numbers| regions.take(numbers));
        assert_eq!((starts, regions.len()), ([0, 8, 12, 12], 16));
    }
}
