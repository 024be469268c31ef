//! How fast the runtime is here: the field's rate on one thread beside the peak of the same
//! instructions in the same process, both by CPU time of the thread, and the time of an animator's step.
//!
//! ```text
//! cargo run --release -p unic-core --example animator_rate          # field and steps
//! cargo run --release -p unic-core --example animator_rate field    # the field alone
//! cargo run --release -p unic-core --example animator_rate field "int8 Avx512"
//! ```

#[path = "../../tests/common/mod.rs"]
mod common;
mod peaks;

use glam::Vec3;
use peaks::{cpu_seconds, peak};
use std::{hint::black_box, sync::Arc, time::Instant};
use unic_core::{
    animator::{Animator, Start},
    config::*,
    model::Model,
    motion::{MotionLayout, MotionSpec, VelocityScheme},
    network::{
        Encoder, EncoderScratch, Field, FieldBiases, FieldScratch, Instructions, Linear, Precision, TILE,
    },
};

/// The paper's field: 8 layers of 256, the input again before the sixth, 128 numbers of latent.
const PAPER_FIELD: FieldConfig = FieldConfig {
    width: 256,
    hidden_layers: 8,
    skip: Some(5),
};
const LATENT: usize = 128;
const ROUNDS: usize = 61;

fn main() {
    field_rates();
    encoder_rates();
    if std::env::args().nth(1).as_deref() == Some("field") {
        return;
    }
    for vertices in [3_020, 3_660, 62_000] {
        step_time("paper", vertices, IntersectionMode::Off);
        step_time("paper", vertices, IntersectionMode::Paper { relaxation_m: 0.005 });
        step_time("second order", vertices, IntersectionMode::Off);
    }
}

/// The field alone in every precision on every instruction set, one thread.
fn field_rates() {
    let (field, flop) = paper_field();
    let only = std::env::args().nth(2);
    for precision in Precision::ALL {
        for set in Instructions::available(precision) {
            let name = format!("{} {set:?}", precision.name());
            if !only.as_ref().is_none_or(|only| name.contains(only)) {
                continue;
            }
            let rate = rate(&field.clone().with_kernel(precision, set), flop);
            println!("field, {name}: {rate}");
        }
    }
}

/// Median of rounds, each beside a fresh measurement of the peak: clock rates move.
fn rate(field: &Field, flop: f64) -> String {
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
        (peak.map_or(f64::NAN, |peak| rate / peak), rate)
    };
    let rounds: Vec<(f64, f64)> = (0..ROUNDS).map(|_| round()).collect();
    let median = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let mut values: Vec<f64> = rounds.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values[ROUNDS / 2]
    };
    let (share, rate) = (median(&|r| r.0), median(&|r| r.1) / 1e9);
    match share.is_nan() {
        true => format!("{rate:.0} GFLOP/s"),
        false => format!("{rate:.0} GFLOP/s, {:.1} % of the peak", share * 100.0),
    }
}

/// The paper's encoder at batch one: 23.4 million weights from memory, by CPU time of one thread.
fn encoder_rates() {
    let config = EncoderConfig {
        hidden: vec![4096, 4096],
        channels: LATENT,
        categories: 8,
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
        let bytes = weights * [4, 2, 2, 1][precision as usize];
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let seconds = pool.expect("a thread").install(|| encode_seconds(&encoder));
        let (ms, rate) = (seconds * 1e3, bytes as f64 / seconds / 1e9);
        println!("encoder, {}: {ms:.2} ms, {rate:.1} GB/s", precision.name());
    }
}

/// Median.
fn encode_seconds(encoder: &Encoder) -> f64 {
    let (pair, mut latent) = (vec![0.5; 590], [0.0; LATENT]);
    let mut scratch = EncoderScratch::default();
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = cpu_seconds();
            encoder.encode(black_box(&pair), &mut scratch, &mut latent);
            black_box(&latent);
            cpu_seconds() - start
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[ROUNDS / 2]
}

/// With the FLOP of one vertex once the latent is folded into the biases: 922,112 in the paper's sizes.
fn paper_field() -> (Field, f64) {
    let mut noise = common::Noise(1);
    let mut linear = |inputs: usize, outputs: usize| Linear {
        inputs,
        outputs,
        weight: (0..inputs * outputs).map(|_| noise.number() * 0.1).collect(),
        bias: vec![0.0; outputs],
    };
    let input = 3 + LATENT;
    let mut layers = vec![linear(input, 256)];
    layers.extend((1..8).map(|i| linear(if i == 5 { 256 + input } else { 256 }, 256)));
    layers.push(linear(256, 3));
    let multiply_adds: usize = layers.iter().map(|l| l.weight.len()).sum::<usize>() - 2 * 256 * LATENT;
    (
        Field::new(&PAPER_FIELD, 3, LATENT, layers).expect("sizes of the paper"),
        2.0 * multiply_adds as f64,
    )
}

/// Median milliseconds of a step in the paper's sizes, on all threads of the rayon pool.
fn step_time(variant: &str, vertices: usize, intersection: IntersectionMode) {
    let variant = common::variant(variant);
    let character = common::character();
    let config = ModelConfig {
        fps: 30.0,
        motion: MotionSpec::new(
            MotionLayout::Heading,
            VelocityScheme::Backward,
            [2, 2, 3, 3],
            &character,
        )
        .expect("joints of the character"),
        encoder: EncoderConfig {
            hidden: vec![512, 512],
            channels: LATENT,
            categories: 16,
        },
        field: PAPER_FIELD,
        state: variant.state,
        intersection,
    };
    let garment = common::tube(vertices / 20, 20, 0.27);
    let prior = common::prior(garment.rest.vertices.len(), 0);
    let parts = common::with_networks(config, garment, prior, Some(5.0));
    let mut animator = Animator::new(Arc::new(Model::new(parts).expect("parts that fit")));
    let poses = common::motion(40);
    animator
        .reset(&common::input(&poses, 0), Start::MeanShape)
        .expect("a sound pose");
    let mut times: Vec<f64> = (1..poses.len())
        .map(|t| {
            let start = Instant::now();
            let frame = animator.step(&common::input(&poses, t)).expect("a sound pose");
            black_box(frame.positions.iter().copied().sum::<Vec3>());
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    times.sort_by(f64::total_cmp);
    let (middle, name) = (times[times.len() / 2], variant.name);
    println!("step, {vertices} vertices, {name}, intersection {intersection:?}: {middle:.2} ms");
}
