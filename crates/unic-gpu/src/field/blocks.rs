//! Field kernel with sums in registers: sizes, and generation of its WGSL.

use super::{FieldShape, source};
use crate::GpuError;
use unic_core::Model;
use wgpu::Limits;

/// Number of outputs, and of vertices, that one invocation computes.
const BLOCK: usize = 8;
/// Number of a layer's inputs whose weights are in workgroup memory at one time.
const CHUNK: usize = 8;
/// Largest number of invocations in a workgroup. With more a GPU has too few registers for 64 sums
/// each.
const MAX_INVOCATIONS: usize = 256;
/// Largest number of vertices in a tile. Weights are read once a tile, which costs little already
/// at this size.
const MAX_LANES: usize = 128;

/// Type of weights and hidden activations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Real {
    /// Type f32.
    Single,
    /// Type f16. Eight products are summed in f16, and these sums in f32.
    Half,
}

/// Tile of vertices that a workgroup evaluates through all layers; each invocation computes eight
/// outputs at eight vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Blocks {
    real: Real,
    /// Width of the hidden layers.
    width: usize,
    /// Number of blocks of vertices.
    lines: usize,
}

impl Blocks {
    /// Chooses the largest tile that fits the device.
    ///
    /// # Errors
    /// Fails when the field is too wide for the device.
    pub(super) fn new(real: Real, width: usize, limits: &Limits) -> Result<Self, GpuError> {
        let mut blocks = Self {
            real,
            width: width.next_multiple_of(BLOCK),
            lines: 1,
        };
        let memory = limits.max_compute_workgroup_storage_size as usize;
        let invocations = (limits.max_compute_invocations_per_workgroup as usize)
            .min(limits.max_compute_workgroup_size_x as usize)
            .min(MAX_INVOCATIONS);
        let fits = |blocks: &Self| blocks.bytes() <= memory && blocks.invocations() <= invocations;
        if !fits(&blocks) {
            let by_memory = memory / (2 * blocks.number_bytes() * BLOCK);
            return Err(GpuError::TooLarge {
                what: "the width of the field",
                limit: by_memory.min(invocations * BLOCK),
                found: blocks.width,
            });
        }
        // Powers of two divide the chunk's quadruples evenly among the invocations.
        loop {
            let mut larger = blocks;
            larger.lines *= 2;
            if !fits(&larger) || larger.lanes() > MAX_LANES {
                return Ok(blocks);
            }
            blocks = larger;
        }
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Number of vertices in the tile.
    pub(super) fn lanes(&self) -> usize {
        self.lines * BLOCK
    }

    fn number_bytes(&self) -> usize {
        match self.real {
            Real::Single => 4,
            Real::Half => 2,
        }
    }

    /// Size of the workgroup memory, bytes: activations of the tile, and one chunk of weights.
    fn bytes(&self) -> usize {
        self.width * (self.lanes() + CHUNK) * self.number_bytes()
    }

    /// Number of blocks of outputs.
    fn columns(&self) -> usize {
        self.width / BLOCK
    }

    fn invocations(&self) -> usize {
        self.columns() * self.lines
    }

    /// Generates `field.wgsl` for these sizes.
    pub(super) fn source(&self, shape: &FieldShape, model: &Model, biases: usize) -> String {
        let (update, state) = source::state_update(model);
        let half = |text: String| match self.real {
            Real::Single => String::new(),
            Real::Half => text,
        };
        let (real, sums) = match self.real {
            Real::Single => ("alias Real = f32;\nconst LARGEST = 3.4e38f;\n", "a"),
            Real::Half => ("enable f16;\nalias Real = f16;\nconst LARGEST = 65504.0f;\n", "c"),
        };
        let constants = source::constants(shape, model, &self.sizes(shape, model, biases));
        source::filled(
            include_str!("../kernels/field.wgsl"),
            &[
                ("//{constants}", real.to_owned() + &constants + &state),
                ("//{mapping}", self.mapping()),
                ("//{biases}", for_blocks(bias)),
                ("//{edge products}", for_blocks(|n, h| product("a", n, h))),
                ("//{fetch}", self.fetch()),
                ("//{store}", self.store()),
                (
                    "//{zeros}",
                    half(for_blocks(|n, h| format!("var c{n}{h} = vec4<f16>();"))),
                ),
                ("//{products}", for_blocks(|n, h| product(sums, n, h))),
                (
                    "//{totals}",
                    half(for_blocks(|n, h| format!("a{n}{h} += vec4<f32>(c{n}{h});"))),
                ),
                ("//{activations}", for_blocks(activation)),
                ("//{update}", update.to_owned()),
            ],
        )
    }

    /// Constants besides those that every kernel of the field has.
    fn sizes(&self, shape: &FieldShape, model: &Model, biases: usize) -> [(&'static str, usize); 11] {
        let (width, lanes) = (self.width, self.lanes());
        [
            ("WIDTH4", width / 4),
            ("COLUMNS", self.columns()),
            ("LINES", self.lines),
            ("TILE4", lanes / 4),
            ("THREADS", self.invocations()),
            ("CHUNK", CHUNK),
            ("CHUNK4", CHUNK * width / 4),
            ("HIDDEN4", width * lanes / 4),
            ("STRIDE4", shape.stride(model.vertex_count()) / 4),
            ("BIASES4", biases / 4),
            ("HEAD4", 2 * shape.inputs * width / 4),
        ]
    }

    /// Generates the mapping from an invocation to its outputs and vertices.
    ///
    /// Neighbouring invocations span eight columns, if there are as many, and then the lines. So 32
    /// neighbours read few different weights and activations.
    fn mapping(&self) -> String {
        // A width whose columns are not a multiple of eight would leave the last group incomplete.
        let run = if self.columns().is_multiple_of(8) {
            8
        } else {
            self.columns()
        };
        let fetched = (0..self.fetches()).map(|i| format!(" var p{i} = vec4<Real>();"));
        format!(
            "let n = t / ({run}u * LINES) * {run}u + t % {run}u; let m = t / {run}u % LINES;{}",
            fetched.collect::<String>()
        )
    }

    /// Number of vectors of four that one invocation copies of each chunk.
    fn fetches(&self) -> usize {
        (CHUNK * self.width / 4).div_ceil(self.invocations())
    }

    // The loads of a chunk into registers, and their stores into workgroup memory, are separate:
    // loads start while the previous chunk is still in use.
    fn fetch(&self) -> String {
        let line = |i| format!("p{i} = hidden_weights[next + {i}u * THREADS]; ");
        (0..self.fetches()).map(line).collect()
    }

    fn store(&self) -> String {
        let line = |i| format!("chunk[t + {i}u * THREADS] = p{i}; ");
        (0..self.fetches()).map(line).collect()
    }
}

/// Generates the start of the sum of output n at half h of the vertices.
fn bias(n: usize, h: usize) -> String {
    format!("var a{n}{h} = vec4<f32>(bias{}.{});", n / 4, axis(n))
}

fn product(sum: &str, n: usize, h: usize) -> String {
    format!("{sum}{n}{h} += x{h} * w{}.{};", n / 4, axis(n))
}

fn activation(n: usize, h: usize) -> String {
    let output = format!("4u * (n + {}u * COLUMNS) + {}u", n / 4, n % 4);
    // A number beyond the largest f16 would become infinite.
    let value = format!("clamp(a{n}{h}, vec4<f32>(), vec4<f32>(LARGEST))");
    format!("hidden[({output}) * TILE4 + m + {h}u * LINES] = vec4<Real>({value});")
}

fn axis(n: usize) -> char {
    ['x', 'y', 'z', 'w'][n % 4]
}

fn for_blocks(line: impl Fn(usize, usize) -> String) -> String {
    let lines = (0..BLOCK).flat_map(|n| [line(n, 0), line(n, 1)]);
    lines.collect::<Vec<_>>().join("\n")
}
