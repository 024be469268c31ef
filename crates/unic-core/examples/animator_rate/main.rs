//! Speed of the runtime on this machine: the field's rate, the encoder's time and the time of a
//! step.
//!
//! The field's rate on one thread is printed beside the peak rate of the same instructions,
//! measured in the same process. All times are CPU times of one thread.
//!
//! ```text
//! cargo run --release -p unic-core --example animator_rate          # networks and steps
//! cargo run --release -p unic-core --example animator_rate field    # networks alone
//! cargo run --release -p unic-core --example animator_rate steps    # steps alone
//! cargo run --release -p unic-core --example animator_rate field "int8 Avx512"
//! ```

#[path = "../../tests/common/mod.rs"]
mod common;
mod peaks;

use peaks::{cpu_seconds, peak};
use std::{hint::black_box, sync::Arc};
use unic_builtin::scale::{NetworkSize, VERTICES, random_model, walk};
use unic_core::{
    Animator, Model, Pose, Precision, Start, StepInput,
    animator::Stage,
    config::*,
    network::{Encoder, EncoderScratch, Field, FieldBiases, FieldScratch, Linear, TILE},
};

/// Sizes of the paper's field: 8 layers of 256, the sixth of which reads the input again.
const PAPER_FIELD: FieldConfig = FieldConfig {
    width: 256,
    hidden_layers: 8,
    skip: Some(5),
};
/// Length of the latent vector.
const LATENT: usize = 128;
/// Rounds of a measurement, of which the median is printed.
const ROUNDS: usize = 61;

fn main() {
    let only = std::env::args().nth(1);
    let only = only.as_deref();
    if only != Some("steps") {
        field_rates();
        encoder_rates();
    }
    if only != Some("field") {
        steps();
    }
}

fn steps() {
    for network in [NetworkSize::Standard, NetworkSize::Paper] {
        for vertices in [VERTICES[0], VERTICES[3]] {
            let model = random_model(network, vertices).expect("enough vertices");
            for (precision, share) in Precision::ALL.iter().flat_map(|p| [(*p, 1.0), (*p, 0.25)]) {
                let model = model.clone().with_precision(precision).with_sampling(share);
                step_times(network, model.expect("a share"));
            }
        }
    }
}

/// Measures the field in every precision on every instruction set.
///
/// With positive weights all activations are above zero. With weights of both signs some are zero,
/// whose products are left out.
fn field_rates() {
    let [dense, sparse] = [f32::abs, |weight| weight].map(paper_field);
    let only = std::env::args().nth(2);
    for precision in Precision::ALL {
        for set in precision.instructions() {
            let name = format!("{} {set:?}", precision.name());
            if !only.as_ref().is_none_or(|only| name.contains(only)) {
                continue;
            }
            let [dense, sparse] =
                [&dense, &sparse].map(|field| rate(&field.clone().with_kernel(precision, set)));
            println!("field, {name}: {dense} with all channels on, {sparse} with some off");
        }
    }
}

/// Measures the field's rate and its share of the peak, as text.
///
/// Every round measures the peak again, because clock rates change.
fn rate(field: &Field) -> String {
    let flop = flop_of_vertex(field);
    let mut biases = FieldBiases::default();
    field.fold(&[0.1; LATENT], &mut biases);
    let inputs = [[0.3; TILE]; 3];
    let (mut scratch, mut outputs) = (FieldScratch::default(), [[0.0; TILE]; 3]);
    let mut round = || {
        let peak = peak(field.precision(), field.instructions());
        let (start, tiles) = (cpu_seconds(), 2_000 / TILE);
        for _ in 0..tiles {
            field.evaluate(&biases, black_box(&inputs), &mut scratch, &mut outputs);
            black_box(&outputs);
        }
        let rate = (tiles * TILE) as f64 * flop / (cpu_seconds() - start);
        Round {
            rate,
            share_of_peak: peak.map_or(f64::NAN, |peak| rate / peak),
        }
    };
    let rounds: Vec<Round> = (0..ROUNDS).map(|_| round()).collect();
    let median = |of: &dyn Fn(&Round) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[ROUNDS / 2]
    };
    let (share, rate) = (median(&|r| r.share_of_peak), median(&|r| r.rate) / 1e9);
    match share.is_nan() {
        true => format!("{rate:.0} GFLOP/s"),
        false => format!("{rate:.0} GFLOP/s ({:.1} % of the peak)", share * 100.0),
    }
}

/// One measurement of the field.
struct Round {
    /// FLOP a second.
    rate: f64,
    /// Share of the peak rate; NaN where there is no loop for the peak.
    share_of_peak: f64,
}

/// Measures the paper's encoder at batch size one, which reads 23.4 million weights from memory.
fn encoder_rates() {
    let config = EncoderConfig {
        hidden: vec![4096, 4096],
        channels: LATENT,
        categories: 8,
        code: LatentCode::PickedLogit,
    };
    let mut noise = common::Noise(2);
    let linear = |w: &[usize]| Linear {
        inputs: w[0],
        outputs: w[1],
        weight: (0..w[0] * w[1]).map(|_| noise.number() * 0.01).collect(),
        bias: vec![0.0; w[1]],
    };
    let layers: Vec<Linear> = config.widths(590).windows(2).map(linear).collect();
    let weights: usize = layers.iter().map(|l| l.weight.len()).sum();
    let encoder = Encoder::new(&config, 590, layers).expect("sizes of the paper");
    for precision in Precision::ALL {
        let encoder = encoder.clone().with_precision(precision);
        let bytes = weights * [4, 1, 2, 1][precision as usize];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let seconds = pool.expect("a thread").install(|| encode_seconds(&encoder));
        let (ms, rate) = (seconds * 1e3, bytes as f64 / seconds / 1e9);
        println!("encoder, {}: {ms:.2} ms, {rate:.1} GB/s", precision.name());
    }
}

/// Returns the median time of the encoder, seconds.
fn encode_seconds(encoder: &Encoder) -> f64 {
    let (pair, mut latent) = (vec![0.5; 590], [0.0; LATENT]);
    let mut scratch = EncoderScratch::default();
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = cpu_seconds();
            encoder.encode(black_box(&pair), &[], &mut scratch, &mut latent);
            black_box(&latent);
            cpu_seconds() - start
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

/// Makes a field of the paper's sizes; `weight` maps random numbers to weights.
fn paper_field(weight: fn(f32) -> f32) -> Field {
    let mut noise = common::Noise(1);
    let mut linear = |inputs: usize, outputs: usize| Linear {
        inputs,
        outputs,
        weight: (0..inputs * outputs)
            .map(|_| weight(noise.number() * 0.1))
            .collect(),
        bias: vec![0.0; outputs],
    };
    let input = 3 + LATENT;
    let mut layers = vec![linear(input, 256)];
    layers.extend((1..8).map(|i| linear(if i == 5 { 256 + input } else { 256 }, 256)));
    layers.push(linear(256, 3));
    Field::new(&PAPER_FIELD, 3, LATENT, layers).expect("sizes of the paper")
}

/// FLOP of one vertex after the latent vector is folded into the biases: 922,112 in the paper's
/// sizes.
fn flop_of_vertex(field: &Field) -> f64 {
    let weights: usize = field.layers().iter().map(|l| l.weight.len()).sum();
    let multiply_adds = weights - 2 * 256 * LATENT;
    2.0 * multiply_adds as f64
}

/// Prints the median time of a step and of its stages, milliseconds.
fn step_times(network: NetworkSize, model: Model) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    let share = model.sampling().map_or(1.0, |s| s.share());
    let name = format!(
        "{} vertices, {}, {}, {:.0} % sampled",
        model.vertex_count(),
        network.name(),
        model.precision().name(),
        100.0 * share
    );
    let frames = pool.expect("a thread").install(|| frames(Arc::new(model)));
    let median = |of: &dyn Fn(&[f64; Stage::ALL.len()]) -> f64| {
        let mut values: Vec<f64> = frames.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[values.len() / 2] * 1e3
    };
    let stages: Vec<String> = (Stage::ALL.iter())
        .map(|&s| format!("{} {:.2}", s.name(), median(&|f| f[s as usize])))
        .collect();
    println!(
        "step, {name}: {:.2} ms ({})",
        median(&|f| f.iter().sum()),
        stages.join(", ")
    );
}

/// Returns the CPU seconds of every stage, frame by frame.
fn frames(model: Arc<Model>) -> Vec<[f64; Stage::ALL.len()]> {
    let mut animator = Animator::new(model);
    animator
        .reset(&input(&walk(0)), Start::MeanShape)
        .expect("a sound pose");
    let mut frames = Vec::new();
    for t in 1..12 {
        let (mut times, mut last) = ([0.0; Stage::ALL.len()], cpu_seconds());
        let pose = walk(t);
        let garment = animator.step_observed(&input(&pose), &mut |stage| {
            let now = cpu_seconds();
            times[stage as usize] += now - last;
            last = now;
        });
        black_box(garment.expect("a sound pose").positions);
        frames.push(times);
    }
    // The first frames allocate.
    frames.split_off(2)
}

fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: glam::Vec3::ZERO,
    }
}
