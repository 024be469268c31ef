//! Prints the rates of a training step beside the multiply-add peak of the same process.
//!
//! `cargo run --release -p unic-train --example training_rate -- [--json] [CAPTURE]`
//!
//! The field's forward and backward: fused through Burn's autodiff, composed of Burn's own
//! operations, and the bare kernels; then whole optimiser steps of the presets on a capture, where
//! there is one. On a shared machine wall time says how long it took and CPU time what it cost.
//! Rates and the peak are by CPU time, and each repeat measures the peak anew, since clock rates
//! move.

use burn::optim::GradientsParams;
use burn::tensor::{Device, Tensor, TensorData};
use serde::Serialize;
use std::{path::Path, time::Instant};
use unic_kernels::{
    BackwardScratch, Batch as Points, Field, FieldShape, Gradients, SavedActivations, fma_peak,
};
use unic_train::*;

type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

/// Medians are taken over so many repeats, after one that warms up.
const REPEATS: usize = 7;
/// Windows and points of the field's step, the same for all shapes.
const GROUPS: usize = 32;
const POINTS: usize = 128;
const CAPTURE: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../../shared/data/captures/tshirt_blender"
);

#[derive(Serialize)]
struct Report {
    threads: usize,
    field: Vec<FieldRow>,
    steps: Vec<StepRow>,
}

/// The field's forward and backward on one batch.
#[derive(Serialize)]
struct FieldRow {
    shape: &'static str,
    how: &'static str,
    #[serde(flatten)]
    time: Time,
    /// Rate of useful work. The products of a latent vector count once per group of points.
    gflops: f64,
    percent_of_peak: f64,
}

/// One optimiser step at the end of a preset's run, where windows are longest.
#[derive(Serialize)]
struct StepRow {
    preset: String,
    gather: Time,
    forward: Time,
    backward: Time,
    update: Time,
    total_wall_ms: f64,
    field_percent_of_cpu_time: f64,
}

/// Milliseconds; CPU time is that of all threads together.
#[derive(Clone, Copy, Default, Serialize)]
struct Time {
    wall_ms: f64,
    cpu_ms: f64,
    /// Multiply-add peak of one core, measured just before, in GFLOP/s.
    peak_gflops: f64,
}

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let json = arguments.iter().any(|a| a == "--json");
    let capture = arguments
        .iter()
        .find(|a| !a.starts_with("--"))
        .map_or(CAPTURE, String::as_str);
    let capture = Path::new(capture);
    let mut reports = Vec::new();
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        // Errors are not Send, so they cross threads as text.
        let report = pool.install(|| measure(threads, capture).map_err(|e| e.to_string()))?;
        if !json {
            print(&report);
        }
        reports.push(report);
    }
    if json {
        println!("{}", serde_json::json!({ "reports": reports }));
    }
    Ok(())
}

fn measure(threads: usize, capture: &Path) -> Result<Report> {
    let mut field = Vec::new();
    for (name, preset) in [("paper", Preset::Paper), ("standard", Preset::Standard)] {
        let shape = field_shape(&TrainConfig::preset(preset).model);
        let row = |how, time: Time| {
            let flops = 3.0 * (GROUPS * POINTS) as f64 * shape.flops_per_point() as f64;
            let gflops = 1e-6 * flops / time.cpu_ms;
            FieldRow {
                shape: name,
                how,
                time,
                gflops,
                percent_of_peak: 100.0 * gflops / time.peak_gflops,
            }
        };
        field.push(row("kernels alone", bare(shape)?));
        field.push(row("fused, Burn's autodiff", through_burn(shape, true)?));
        field.push(row("Burn's own operations", through_burn(shape, false)?));
    }
    let mut steps = Vec::new();
    for preset in [Preset::Paper, Preset::Standard] {
        match capture.exists() {
            true => steps.push(whole_step(preset, capture)?),
            false => eprintln!(
                "skipped: the step of {preset:?}, no capture at {}",
                capture.display()
            ),
        }
    }
    Ok(Report {
        threads,
        field,
        steps,
    })
}

fn field_shape(model: &ModelSettings) -> FieldShape {
    let inputs = match &model.state {
        StateSettings::RootRelative => 1,
        StateSettings::Displacement { inputs, .. } => inputs.len(),
    };
    FieldShape {
        point_inputs: 3 * inputs,
        latent: model.encoder.latent_len(),
        hidden: model.field.width,
        hidden_layers: model.field.hidden_layers,
        skip: model.field.skip,
        outputs: 3,
    }
}

fn bare(shape: FieldShape) -> Result<Time> {
    let parameters = numbers(shape.parameter_count(), (6.0 / shape.hidden as f32).sqrt());
    let (x, z) = (
        numbers(GROUPS * POINTS * shape.point_inputs, 1.0),
        numbers(GROUPS * shape.latent, 1.0),
    );
    let batch = Points {
        points: &x,
        latents: &z,
        points_per_group: POINTS,
    };
    let mut field = Field::new(shape)?;
    let mut outputs = vec![0.0; GROUPS * POINTS * shape.outputs];
    let (mut dx, mut dz, mut dp) = (x.clone(), z.clone(), parameters.clone());
    let (mut saved, mut scratch) = (SavedActivations::default(), BackwardScratch::default());
    median(|| {
        timed(|| {
            field.load(&parameters)?;
            field.forward(&batch, &mut outputs, &mut saved)?;
            let gradients = Gradients {
                points: &mut dx,
                latents: &mut dz,
                parameters: &mut dp,
            };
            field.backward(&batch, &saved, &outputs, gradients, &mut scratch)?;
            Ok(())
        })
        .map(|(time, ())| time)
    })
}

fn through_burn(shape: FieldShape, fused: bool) -> Result<Time> {
    let device = Device::flex().autodiff();
    let matrix = |sizes: [usize; 2]| {
        let data = TensorData::new(numbers(sizes[0] * sizes[1], 1.0), sizes);
        Tensor::<2>::from_data(data, &device).require_grad()
    };
    let (x, z) = (
        matrix([GROUPS * POINTS, shape.point_inputs]),
        matrix([GROUPS, shape.latent]),
    );
    let count = shape.parameter_count();
    let parameters = TensorData::new(numbers(count, (6.0 / shape.hidden as f32).sqrt()), [count]);
    let parameters = Tensor::<1>::from_data(parameters, &device).require_grad();
    median(|| {
        timed(|| {
            let outputs = match fused {
                true => PackedField::new(shape, parameters.clone(), Products::F32)?
                    .forward(x.clone(), z.clone())?,
                false => composed(&shape, x.clone(), z.clone(), parameters.clone()),
            };
            outputs.sum().backward();
            Ok(())
        })
        .map(|(time, ())| time)
    })
}

/// Times the parts of a training step: gather, forward, backward and update.
fn whole_step(preset: Preset, capture: &Path) -> Result<StepRow> {
    let config = TrainConfig::preset(preset);
    let data = FieldData::prepare(unic_io::Capture::open(capture)?, &config, Fit::HeldOut)?;
    let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
    let network = Network::new(&shape, config.seed, &Device::flex().autodiff());
    let moments = Moments::new(&network);
    let mut run = Run {
        config: &config,
        data: &data,
        shape: &shape,
        network,
        moments,
    };
    let rows: Result<Vec<[Time; 4]>> = (0..=REPEATS).map(|_| run.step()).collect();
    let rows = rows?;
    let parts = [0, 1, 2, 3].map(|i| middle(rows[1..].iter().map(|r| r[i]).collect()));
    let sum = |of: fn(&Time) -> f64| parts.iter().map(of).sum::<f64>();
    let points = config.unroll(config.optimiser.steps - 1) * config.batch.windows * config.batch.points;
    let field_ms = bare(shape.field)?.cpu_ms * points as f64 / (GROUPS * POINTS) as f64;
    let [gather, forward, backward, update] = parts;
    Ok(StepRow {
        preset: format!("{preset:?}"),
        gather,
        forward,
        backward,
        update,
        total_wall_ms: sum(|t| t.wall_ms),
        field_percent_of_cpu_time: 100.0 * field_ms / sum(|t| t.cpu_ms),
    })
}

/// Parts of a trainer, held separately so that each can be timed.
struct Run<'a> {
    config: &'a TrainConfig,
    data: &'a FieldData,
    shape: &'a NetworkShape,
    network: Network,
    moments: Moments,
}

impl Run<'_> {
    /// Gather, forward, backward, update.
    fn step(&mut self) -> Result<[Time; 4]> {
        let Self {
            config,
            data,
            shape,
            network,
            moments,
        } = self;
        let device = Device::flex().autodiff();
        let step = config.optimiser.steps - 1;
        let (gather, (batch, noise)) = timed(|| {
            let batch = Batch::gather(data, config, step);
            let rows = batch.encoder_rows();
            let noise = StepNoise::draw(shape, &config.regularisation, rows, config.seed, step);
            Ok((batch, noise))
        })?;
        let rollout = Rollout {
            shape,
            config: &data.config,
            loss: &config.loss,
            products: Products::F32,
        };
        let (forward, loss) = timed(|| Ok(rollout.loss(network, &batch, Some(&noise), &device)?))?;
        let (backward, gradients) = timed(|| Ok(GradientsParams::from_grads(loss.backward(), network)))?;
        let (update, _) = timed(|| {
            Ok(update(
                network,
                gradients,
                moments,
                &config.optimiser,
                1e-4,
                step,
            )?)
        })?;
        Ok([gather, forward, backward, update])
    }
}

fn print(report: &Report) {
    println!("{} thread(s)", report.threads);
    println!(
        "  field, {GROUPS} x {POINTS} points{:>21}{:>10}{:>10}{:>10}{:>8}",
        "wall ms", "CPU ms", "GFLOP/s", "peak", "share"
    );
    for row in &report.field {
        let Time {
            wall_ms,
            cpu_ms,
            peak_gflops,
        } = row.time;
        let (rate, share) = (row.gflops, row.percent_of_peak);
        let name = format!("{:<10}{:<24}", row.shape, row.how);
        println!("  {name}{wall_ms:>12.2}{cpu_ms:>10.2}{rate:>10.1}{peak_gflops:>10.1}{share:>7.1}%");
    }
    println!(
        "  optimiser step, wall/CPU ms{:>18}{:>18}{:>18}{:>18}",
        "gather", "forward", "backward", "update"
    );
    for row in &report.steps {
        let parts = [row.gather, row.forward, row.backward, row.update];
        let parts = parts
            .map(|t| format!("{:>18}", format!("{:.1}/{:.1}", t.wall_ms, t.cpu_ms)))
            .concat();
        let share = row.field_percent_of_cpu_time;
        println!(
            "  {:<26}{parts}  {:.1} ms, field {share:.0} % of CPU time",
            row.preset, row.total_wall_ms
        );
    }
}

fn median(mut run: impl FnMut() -> Result<Time>) -> Result<Time> {
    run()?;
    let times: Result<Vec<Time>> = (0..REPEATS)
        .map(|_| {
            Ok(Time {
                peak_gflops: peak()?,
                ..run()?
            })
        })
        .collect();
    Ok(middle(times?))
}

/// Multiply-adds of one core a second of CPU time: the kernel's own rate is by wall time.
fn peak() -> Result<f64> {
    let (time, rate) = timed(|| Ok(fma_peak()))?;
    Ok(1e-9 * rate * time.wall_ms / time.cpu_ms)
}

fn middle(times: Vec<Time>) -> Time {
    let of = |value: fn(&Time) -> f64| {
        let mut values: Vec<f64> = times.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2]
    };
    Time {
        wall_ms: of(|t| t.wall_ms),
        cpu_ms: of(|t| t.cpu_ms),
        peak_gflops: of(|t| t.peak_gflops),
    }
}

fn timed<T>(run: impl FnOnce() -> Result<T>) -> Result<(Time, T)> {
    let (cpu, wall) = (cpu_ms(), Instant::now());
    let value = run()?;
    let wall_ms = 1e3 * wall.elapsed().as_secs_f64();
    let cpu_ms = match (cpu, cpu_ms()) {
        (Some(before), Some(after)) => after - before,
        _ => wall_ms,
    };
    Ok((
        Time {
            wall_ms,
            cpu_ms,
            peak_gflops: 0.0,
        },
        value,
    ))
}

/// CPU time of all threads of the process; wall time on systems that do not report it.
#[cfg(unix)]
fn cpu_ms() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(1e3 * time.tv_sec as f64 + 1e-6 * time.tv_nsec as f64)
}

#[cfg(not(unix))]
fn cpu_ms() -> Option<f64> {
    None
}

/// Evenly spread numbers in ±scale: the golden ratio's multiples.
fn numbers(count: usize, scale: f32) -> Vec<f32> {
    (0..count)
        .map(|i| scale * ((i as f64 * 0.618_033_988_75).fract() * 2.0 - 1.0) as f32)
        .collect()
}
