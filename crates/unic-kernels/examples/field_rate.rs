//! Prints the throughput of the field's forward and backward pass, and its share of the
//! multiply-add peak at the same time.
//!
//! ```text
//! cargo run --release -p unic-kernels --example field_rate -- [FRAMES [POINTS [HIDDEN [LAYERS]]]]
//! ```
//!
//! FRAMES is the number of frames, POINTS the number of points per frame, HIDDEN the width and
//! LAYERS the number of hidden layers. With `UNIC_AMX=1` the field runs on matrix units.

use std::time::Instant;

use unic_kernels::*;

/// Number of repeats. Clock rates and other load vary over time, so that each repeat measures the
/// peak again, and medians of the shares are printed.
const REPEATS: usize = 9;

/// Measurements of one repeat. Times are in seconds.
struct Run {
    /// Peak of all threads together just before the repeat, FLOP/s.
    peak: f64,
    infer: f64,
    forward: f64,
    /// Backward pass with stored activations.
    backward: f64,
    /// Backward pass that recomputes activations.
    recompute: f64,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments = std::env::args()
        .skip(1)
        .map(|text| text.parse())
        .collect::<Result<Vec<usize>, _>>()?;
    let argument = |index: usize, default| arguments.get(index).copied().unwrap_or(default);
    let (groups, points) = (argument(0, 4), argument(1, 3_653));
    let hidden_layers = argument(3, FieldShape::PAPER.hidden_layers);
    let skip = FieldShape::PAPER.skip.filter(|&skip| skip < hidden_layers);
    let shape = FieldShape {
        hidden: argument(2, 256),
        hidden_layers,
        skip,
        ..FieldShape::PAPER
    };
    println!(
        "{shape:?}\n{groups} frames of {points} points, {:?}",
        instructions()
    );
    let forward = (groups * points) as f64 * shape.flops_per_point() as f64;
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let runs = pool.install(|| measure(shape, groups, points))?;
        println!(
            "{threads} thread(s), peak {:.1} GFLOP/s",
            1e-9 * median(&runs, |run| run.peak)
        );
        let rate = |name: &str, flops: f64, seconds: fn(&Run) -> f64| {
            let gflops = 1e-9 * flops / median(&runs, seconds);
            let share = median(&runs, |run| 100.0 * flops / seconds(run) / run.peak);
            println!("  {name:<22} {gflops:7.1} GFLOP/s  {share:5.1} % of peak");
        };
        rate("infer", forward, |run| run.infer);
        rate("forward", forward, |run| run.forward);
        rate("backward", 2.0 * forward, |run| run.backward);
        rate("forward + backward", 3.0 * forward, |run| {
            run.forward + run.backward
        });
        rate("backward, recomputing", 3.0 * forward, |run| run.recompute);
        rate("both, recomputing", 3.0 * forward, |run| {
            run.infer + run.recompute
        });
    }
    Ok(())
}

fn instructions() -> InstructionSet {
    match std::env::var_os("UNIC_AMX") {
        Some(_) => InstructionSet::Amx,
        None => InstructionSet::detect(),
    }
}

fn measure(shape: FieldShape, groups: usize, points_per_group: usize) -> Result<Vec<Run>, KernelError> {
    let points = groups * points_per_group;
    let parameters = numbers(shape.parameter_count(), (6.0 / shape.hidden as f32).sqrt());
    let point_inputs = numbers(points * shape.point_inputs, 1.0);
    let latents = numbers(groups * shape.latent, 1.0);
    let batch = Batch {
        points: &point_inputs,
        latents: &latents,
        points_per_group,
    };
    let mut field = Field::with_instructions(shape, instructions())?;
    field.load(&parameters)?;
    let mut outputs = vec![0.0; points * shape.outputs];
    let mut point_gradients = vec![0.0; point_inputs.len()];
    let mut latent_gradients = vec![0.0; latents.len()];
    let mut parameter_gradients = vec![0.0; parameters.len()];
    let (mut kept, mut none) = (
        SavedActivations::default(),
        SavedActivations::new(Retention::Recompute),
    );
    let mut scratch = BackwardScratch::default();
    let mut run = || {
        let peak = rayon::broadcast(|_| fma_peak()).iter().sum();
        let infer = timed(|| field.infer(&batch, &mut outputs))?;
        let forward = timed(|| field.forward(&batch, &mut outputs, &mut kept))?;
        field.forward(&batch, &mut outputs, &mut none)?;
        let mut backward = |saved| {
            let gradients = Gradients {
                points: &mut point_gradients,
                latents: &mut latent_gradients,
                parameters: &mut parameter_gradients,
            };
            timed(|| field.backward(&batch, saved, &outputs, gradients, &mut scratch))
        };
        Ok(Run {
            peak,
            infer,
            forward,
            backward: backward(&kept)?,
            recompute: backward(&none)?,
        })
    };
    run()?;
    (0..REPEATS).map(|_| run()).collect()
}

fn timed(run: impl FnOnce() -> Result<(), KernelError>) -> Result<f64, KernelError> {
    let start = Instant::now();
    run()?;
    Ok(start.elapsed().as_secs_f64())
}

fn median(runs: &[Run], value: impl Fn(&Run) -> f64) -> f64 {
    let mut values: Vec<f64> = runs.iter().map(value).collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Evenly distributed values in ±scale: fractions of multiples of the golden ratio.
fn numbers(count: usize, scale: f32) -> Vec<f32> {
    (0..count)
        .map(|i| scale * ((i as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0) as f32)
        .collect()
}
