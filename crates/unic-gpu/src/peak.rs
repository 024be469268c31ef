//! How fast a device multiplies and adds when nothing else is in its way.

use crate::{
    GpuContext, GpuError, Precision,
    kernel::{Kernel, Source},
    program::Program,
};
use wgpu::{Buffer, BufferUsages};

/// Independent sums of four in one invocation, enough to hide the latency of an addition.
const SUMS: usize = 16;
/// Matrices that a workgroup stages: 8 KiB where they are 16 by 16.
const MOST_STAGED: usize = 8;
/// Independent sums of matrices in one subgroup.
const MATRIX_SUMS: usize = 8;
/// Workgroups: as many as the largest devices hold at one time.
const GROUPS: usize = 2048;
/// Invocations of a workgroup.
const GROUP: usize = 256;
/// A measurement lasts at least so long, milliseconds: clocks have risen and starting costs nothing.
const LEAST_MS: f64 = 20.0;
/// Rounds beyond which a device is not believed.
const MOST_ROUNDS: u32 = 1 << 22;

/// A kernel that multiplies and adds in registers and does nothing else: what the field's rate is a share of.
///
/// Clock rates move, and so does what else a machine is doing: measure it beside what it is compared with.
#[derive(Debug)]
pub struct MultiplyAdds {
    context: GpuContext,
    program: Program,
    rounds: u32,
    /// Floating-point operations of a round, two a multiply-add.
    flop: f64,
}

impl MultiplyAdds {
    /// Compiles the kernel and finds out how long it must run.
    ///
    /// # Errors
    /// A device without timestamps or without the precision.
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
            // The first run pages in.
            kernel.seconds()?;
            kernel.flop = work.flop(context, &out)?;
            if kernel.seconds()? >= LEAST_MS * 1e-3 || rounds >= MOST_ROUNDS {
                return Ok(kernel);
            }
            rounds *= 4;
        }
    }

    /// Floating-point operations a second of one run, two a multiply-add.
    ///
    /// # Errors
    /// When the device is lost.
    pub fn rate(&self) -> Result<f64, GpuError> {
        Ok(self.flop * f64::from(self.rounds) / self.seconds()?)
    }

    fn seconds(&self) -> Result<f64, GpuError> {
        let stages = self.program.submit_timed(&self.context)?;
        Ok(stages.iter().map(|stage| stage.ms * 1e-3).sum())
    }
}

/// What a round is.
struct Work {
    text: String,
    /// Floating-point operations of a worker.
    flop: usize,
    workers: Workers,
    /// Of what is written.
    bytes: usize,
}

/// Who has sums of its own.
enum Workers {
    Invocations,
    /// A workgroup has as many as the device sees fit, which the kernel writes down.
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

    /// Floating-point operations of all workgroups, by what a run has written.
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
        format!("const SIDE = {side}u; const STAGED = {MOST_STAGED}u; const THREADS = {GROUP}u;"),
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
