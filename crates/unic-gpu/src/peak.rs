//! Measurement of a device's peak rate of multiply-adds.

use crate::{
    GpuContext, GpuError, Precision,
    kernel::{Kernel, Source},
    program::Program,
};
use wgpu::{Buffer, BufferUsages};

/// Number of independent sums of four in one invocation, enough to hide the latency of an addition.
const SUMS: usize = 16;
/// Number of matrices that a workgroup stages: 8 KiB for matrices of 16 × 16.
const STAGED: usize = 8;
/// Number of independent sums of matrices in one subgroup.
const MATRIX_SUMS: usize = 8;
/// Number of workgroups: as many as the largest devices hold at one time.
const GROUPS: usize = 2048;
/// Number of invocations in a workgroup.
const GROUP: usize = 256;
/// Shortest measurement, milliseconds: clocks have risen by then, and the start-up time is
/// negligible.
const MIN_MS: f64 = 20.0;
/// Largest number of rounds; a device that still seems faster has wrong timestamps.
const MAX_ROUNDS: u32 = 1 << 22;

/// Kernel that only multiplies and adds in registers: the peak rate with which the field's is
/// compared.
///
/// Clock rates and the load of a machine change. Measure the peak next to the kernel that is
/// compared with it.
#[derive(Debug)]
pub struct MultiplyAdds {
    context: GpuContext,
    program: Program,
    rounds: u32,
    /// Number of floating-point operations of a round, two for each multiply-add.
    flop: f64,
}

impl MultiplyAdds {
    /// Compiles the kernel and finds a number of rounds that runs long enough.
    ///
    /// # Errors
    /// Fails on a device without timestamps or without the precision.
    pub fn new(context: &GpuContext, precision: Precision) -> Result<Self, GpuError> {
        let work = Work::new(context, precision)?;
        let mut rounds = 16;
        loop {
            let (program, out) = work.program(context, rounds)?;
            let mut kernel = Self {
                context: context.clone(),
                program,
                rounds,
                flop: 0.0,
            };
            // The first run includes page faults, so it is not measured.
            kernel.seconds()?;
            kernel.flop = work.flop(context, &out)?;
            if kernel.seconds()? >= MIN_MS * 1e-3 || rounds >= MAX_ROUNDS {
                return Ok(kernel);
            }
            // `ROUNDS` is a constant of the pipeline, so a new number needs a new one.
            rounds *= 4;
        }
    }

    /// Measures one run: floating-point operations a second, two for each multiply-add.
    ///
    /// # Errors
    /// Fails when the device is lost.
    pub fn rate(&self) -> Result<f64, GpuError> {
        Ok(self.flop * f64::from(self.rounds) / self.seconds()?)
    }

    fn seconds(&self) -> Result<f64, GpuError> {
        let stages = self.program.submit_timed(&self.context)?;
        Ok(stages.iter().map(|stage| stage.ms * 1e-3).sum())
    }
}

/// Work of a round.
struct Work {
    text: String,
    /// Number of floating-point operations of a worker.
    flop: usize,
    workers: Workers,
    /// Size of the output, bytes.
    bytes: usize,
}

/// Unit that has sums of its own.
enum Workers {
    /// Each invocation.
    Invocations,
    /// Each subgroup. The device chooses how many a workgroup has, and the kernel writes their
    /// number.
    Subgroups,
}

impl Work {
    fn new(context: &GpuContext, precision: Precision) -> Result<Self, GpuError> {
        let numbers = |text| Self {
            text,
            flop: SUMS * 4 * 2,
            workers: Workers::Invocations,
            bytes: 16 * (2 + GROUPS * GROUP),
        };
        match precision {
            Precision::F32 => Ok(numbers(numbers_source("", "f32"))),
            Precision::F16 => Ok(numbers(numbers_source("enable f16;\n", "f16"))),
            Precision::F16Matrix => {
                let side = context.needed_matrix_units()?.side;
                Ok(Self {
                    text: matrices_source(side),
                    flop: MATRIX_SUMS * 2 * side.pow(3),
                    workers: Workers::Subgroups,
                    bytes: 4 * (1 + GROUPS * GROUP),
                })
            }
        }
    }

    /// Number of floating-point operations of all workgroups, from the output of a run.
    fn flop(&self, context: &GpuContext, out: &Buffer) -> Result<f64, GpuError> {
        let workers = match self.workers {
            Workers::Invocations => GROUP as f32,
            Workers::Subgroups => bytemuck::pod_read_unaligned(&context.download(out, 0, 4)?),
        };
        Ok((GROUPS * self.flop) as f64 * f64::from(workers))
    }

    fn program(&self, context: &GpuContext, rounds: u32) -> Result<(Program, Buffer), GpuError> {
        let source = Source {
            text: &self.text,
            entry: "peak",
            constants: &[("ROUNDS", f64::from(rounds))],
        };
        let mut program = Program::default();
        let out = context.zeroed("peak", self.bytes, BufferUsages::empty());
        let dispatch = context.checked(|| Kernel::new(context, &source).dispatch(&[(0, &out)], GROUPS))?;
        program.stage("peak", vec![dispatch]);
        Ok((program, out))
    }
}

fn numbers_source(enable: &str, real: &str) -> String {
    let sum: Vec<String> = (0..SUMS).map(|i| format!("vec4<f32>(s{i})")).collect();
    let starts = lines(SUMS, |i| format!("var s{i} = vec4<{real}>({real}(id.x + {i}u));"));
    let text = include_str!("kernels/peak.wgsl")
        .replace("//{constants}", &format!("const THREADS = {GROUP}u;"))
        .replace("//{starts}", &starts)
        .replace("//{steps}", &lines(SUMS, |i| format!("s{i} = s{i} * a + b;")))
        .replace("//{sum}", &sum.join(" + "))
        .replace("Real", real);
    enable.to_owned() + &text
}

fn matrices_source(side: usize) -> String {
    let matrix = |name, real, role| format!("alias {name} = coop_mat{side}x{side}<{real}, {role}>;\n");
    let constants = [
        matrix("Left", "f16", "A"),
        matrix("Right", "f16", "B"),
        matrix("Sum", "f32", "C"),
        format!("const SIDE = {side}u; const STAGED = {STAGED}u; const THREADS = {GROUP}u;"),
    ];
    let total = |i| {
        format!(
            "coopStore(s{i}, &staged[stage], SIDE);
            workgroupBarrier();
            total += staged[t % (STAGED * SIDE * SIDE)];
            workgroupBarrier();"
        )
    };
    include_str!("kernels/peak_matrix.wgsl")
        .replace("//{constants}", &constants.concat())
        .replace(
            "//{starts}",
            &lines(MATRIX_SUMS, |i| format!("var s{i} = Sum();")),
        )
        .replace(
            "//{steps}",
            &lines(MATRIX_SUMS, |i| format!("s{i} = coopMultiplyAdd(a, b, s{i});")),
        )
        .replace("//{totals}", &lines(MATRIX_SUMS, total))
}

fn lines(count: usize, line: impl Fn(usize) -> String) -> String {
    (0..count).map(line).collect::<Vec<_>>().join("\n")
}
