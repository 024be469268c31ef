//! Times of a frame on this machine's GPU by stage, compared with the device's peak rate of
//! multiply-adds.
//!
//! Garments have the sizes of the paper's; networks have the sizes of the presets `paper` and
//! `standard`.
//!
//! ```text
//! cargo run --release -p unic-gpu --example gpu_rate
//! cargo run --release -p unic-gpu --example gpu_rate -- --json --vertices 3653,34907 --seconds 2
//! cargo run --release -p unic-gpu --example gpu_rate -- --network standard --precision f32
//! ```
//!
//! Weights are random, since times do not depend on them. Stages are timed by the device's clock.
//! `frame` is the wall-clock time from the call to the end of the device's work. `in a row` is that
//! of one of 16 frames that are submitted before the host waits, as in a game that does not wait for
//! each of them. `floor` is the time of the field's arithmetic at the peak rate.

use serde_json::{Map, Value, json};
use std::{
    error::Error,
    sync::Arc,
    time::{Duration, Instant},
};
use unic_builtin::scale::{NetworkSize, VERTICES, random_model, walk};
use unic_core::{Model, Pose, Start, StepInput};
use unic_gpu::{GpuAnimator, GpuContext, GpuError, GpuModel, MultiplyAdds, Precision, StageTime, wgpu};

/// Number of frames before the first measured one: the first steps include compilation and page
/// faults.
const WARM_UP: usize = 2;
/// Number of frames that are submitted before the host waits.
const ROW: usize = 16;
/// Smallest number of measured frames.
const MIN_FRAMES: usize = 3;

struct Arguments {
    is_json: bool,
    vertices: Vec<usize>,
    /// Name of the only network; none for all.
    network: Option<String>,
    /// Name of the only precision; none for all.
    precision: Option<String>,
    /// Time for each case.
    budget: Duration,
}

/// Measurements of one model.
struct Case {
    vertices: usize,
    network: &'static str,
    precision: Precision,
    /// Median wall-clock time of a frame, milliseconds.
    frame_ms: f64,
    /// Median wall-clock time of one of [`ROW`] frames that are submitted in a row, milliseconds.
    row_ms: f64,
    /// Median time of each stage.
    stages: Vec<StageTime>,
    /// Time of the field's arithmetic at the peak rate, measured next to each frame, milliseconds.
    floor_ms: f64,
    /// Ratio of `floor_ms` to the time of the field.
    field_share: f64,
    /// Ratio of `floor_ms` to the time of all stages.
    frame_share: f64,
}

fn main() -> Result<(), Box<dyn Error + Send + Sync>> {
    let arguments = arguments()?;
    let context = match GpuContext::with_matrix_units() {
        Err(GpuError::NoAdapter(why)) => {
            println!("no GPU: {why}");
            return Ok(());
        }
        context => context?,
    };
    let mut precisions = vec![Precision::F32];
    if context.has(wgpu::Features::SHADER_F16) {
        precisions.push(Precision::F16);
    }
    if context.has_matrix_units() {
        precisions.push(Precision::F16Matrix);
    }
    if let Some(wanted) = &arguments.precision {
        precisions.retain(|&precision| precision_name(precision) == *wanted);
    }
    let mut networks = vec![NetworkSize::Standard, NetworkSize::Paper];
    if let Some(wanted) = &arguments.network {
        networks.retain(|network| network.name() == wanted);
    }
    if precisions.is_empty() || networks.is_empty() {
        return Err("this device measures no such network and precision".into());
    }
    let peaks: Vec<MultiplyAdds> = (precisions.iter())
        .map(|&precision| MultiplyAdds::new(&context, precision))
        .collect::<Result<_, _>>()?;
    if !arguments.is_json {
        print_head(&context);
    }
    let mut cases = Vec::new();
    for network in networks {
        for &vertices in &arguments.vertices {
            let model = Arc::new(random_model(network, vertices)?);
            for (&precision, peak) in precisions.iter().zip(&peaks) {
                let case = match measure(&context, &model, precision, peak, arguments.budget) {
                    Err(error @ GpuError::TooLarge { .. }) => {
                        eprintln!("left out, {} in {precision:?}: {error}", network.name());
                        continue;
                    }
                    case => case?,
                };
                let case = Case {
                    network: network.name(),
                    ..case
                };
                if !arguments.is_json {
                    print_case(&case);
                }
                cases.push(case);
            }
        }
    }
    if arguments.is_json {
        println!("{}", to_json(&context, &cases));
    }
    Ok(())
}

fn arguments() -> Result<Arguments, Box<dyn Error + Send + Sync>> {
    let mut arguments = Arguments {
        is_json: false,
        vertices: VERTICES.to_vec(),
        network: None,
        precision: None,
        budget: Duration::from_secs(2),
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value"));
        match word.as_str() {
            "--json" => arguments.is_json = true,
            "--vertices" => {
                arguments.vertices = value()?.split(',').map(str::parse).collect::<Result<_, _>>()?
            }
            "--network" => arguments.network = Some(value()?),
            "--precision" => arguments.precision = Some(value()?),
            "--seconds" => arguments.budget = Duration::from_secs_f64(value()?.parse()?),
            other => return Err(format!("unknown argument {other}").into()),
        }
    }
    Ok(arguments)
}

fn measure(
    context: &GpuContext,
    model: &Arc<Model>,
    precision: Precision,
    peak: &MultiplyAdds,
    budget: Duration,
) -> Result<Case, GpuError> {
    let mut walker = Walker::new(context, model, precision)?;
    let (mut frames, mut rows) = (Vec::new(), Vec::new());
    let (mut stages, mut floors) = (Vec::new(), Vec::new());
    for _ in 0..WARM_UP {
        walker.step_timed()?;
    }
    let flop = walker.animator.asset().field_flop();
    let start = Instant::now();
    while frames.len() < MIN_FRAMES || start.elapsed() < budget {
        let frame = Instant::now();
        walker.step()?;
        context.wait()?;
        frames.push(frame.elapsed().as_secs_f64() * 1e3);
        let row = Instant::now();
        (0..ROW).try_for_each(|_| walker.step())?;
        context.wait()?;
        rows.push(row.elapsed().as_secs_f64() * 1e3 / ROW as f64);
        stages.push(walker.step_timed()?);
        floors.push(flop / peak.rate()? * 1e3);
    }
    let share = |ms: fn(&[StageTime]) -> f64| {
        let shares = floors
            .iter()
            .zip(&stages)
            .map(|(floor, stages)| floor / ms(stages));
        median(shares.collect())
    };
    Ok(Case {
        vertices: model.vertex_count(),
        network: "",
        precision,
        frame_ms: median(frames),
        row_ms: median(rows),
        field_share: share(|stages| stage_ms(stages, "field")),
        frame_share: share(device_ms),
        stages: medians(&stages),
        floor_ms: median(floors),
    })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn medians(frames: &[Vec<StageTime>]) -> Vec<StageTime> {
    let stage = |i: usize, name| StageTime {
        name,
        ms: median(frames.iter().map(|stages| stages[i].ms).collect()),
    };
    frames[0]
        .iter()
        .enumerate()
        .map(|(i, first)| stage(i, first.name))
        .collect()
}

/// Animator with the number of its current frame.
struct Walker {
    animator: GpuAnimator,
    frame: usize,
}

impl Walker {
    fn new(context: &GpuContext, model: &Arc<Model>, precision: Precision) -> Result<Self, GpuError> {
        let asset = Arc::new(GpuModel::new(context, Arc::clone(model), precision)?);
        let mut animator = GpuAnimator::new(asset)?;
        animator.reset(&input(&walk(0)), Start::MeanShape)?;
        Ok(Self { animator, frame: 0 })
    }

    fn step(&mut self) -> Result<(), GpuError> {
        self.frame += 1;
        self.animator.step(&input(&walk(self.frame)))
    }

    fn step_timed(&mut self) -> Result<Vec<StageTime>, GpuError> {
        self.frame += 1;
        self.animator.step_timed(&input(&walk(self.frame)))
    }
}

fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: glam::Vec3::ZERO,
    }
}

fn print_head(context: &GpuContext) {
    println!("{}", context.adapter_name());
    if context.device().adapter_info().device_type == wgpu::DeviceType::Cpu {
        println!("a software device: its times say nothing about any GPU");
    }
    println!(
        "milliseconds, medians; floor: the field's arithmetic at the rate of a kernel that only multiplies and adds\n"
    );
    println!("vertices  network   precision   frame  in a row  device   floor  field at  frame at  stages");
}

fn print_case(case: &Case) {
    let stages: Vec<String> = case
        .stages
        .iter()
        .map(|s| format!("{} {:.3}", s.name, s.ms))
        .collect();
    println!(
        "{:>8}  {:<8}  {:<9} {:>7.2} {:>9.2} {:>7.2} {:>7.2} {:>7.1} % {:>7.1} %  {}",
        case.vertices,
        case.network,
        format!("{:?}", case.precision),
        case.frame_ms,
        case.row_ms,
        device_ms(&case.stages),
        case.floor_ms,
        100.0 * case.field_share,
        100.0 * case.frame_share,
        stages.join(", "),
    );
}

fn precision_name(precision: Precision) -> String {
    format!("{precision:?}").to_lowercase()
}

fn device_ms(stages: &[StageTime]) -> f64 {
    stages.iter().map(|stage| stage.ms).sum()
}

fn stage_ms(stages: &[StageTime], name: &str) -> f64 {
    let named = stages.iter().filter(|stage| stage.name == name);
    named.map(|stage| stage.ms).sum()
}

fn to_json(context: &GpuContext, cases: &[Case]) -> Value {
    let adapter = context.adapter_name();
    let cases: Vec<Value> = cases.iter().map(|case| case_to_json(&adapter, case)).collect();
    json!({ "adapter": adapter, "cases": cases })
}

fn case_to_json(adapter: &str, case: &Case) -> Value {
    let stages: Map<String, Value> = (case.stages.iter())
        .map(|stage| (stage.name.to_owned(), json!(stage.ms)))
        .collect();
    let field_ms = stage_ms(&case.stages, "field");
    json!({
        "vertices": case.vertices,
        "network": case.network,
        "precision": precision_name(case.precision),
        "device": adapter,
        "threads": 1,
        "sampling_percent": 100,
        "frame_ms": case.frame_ms,
        "in_a_row_ms": case.row_ms,
        "fps": 1e3 / case.frame_ms,
        "device_ms": device_ms(&case.stages),
        "forward_only_ms": stage_ms(&case.stages, "encoder") + field_ms,
        // Random weights have no accuracy to compare.
        "added_rmse_mm": null,
        "floor_ms": case.floor_ms,
        "field_floor_share": case.field_share,
        "frame_floor_share": case.frame_share,
        "stages_ms": stages,
    })
}
