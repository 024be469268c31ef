//! Time of one frame of inference, in total and by stage, at garment sizes that publications use.
//!
//! Networks have the sizes of the presets `standard` and `paper` and random weights. The character
//! walks; it has 24 joints and 6,890 body vertices.
//!
//! ```text
//! cargo bench -p unic-core --bench frame
//! ```
//!
//! `frame` is [`Animator::step`] with the intersection handling of the preset's models,
//! `frame_unhandled` is a step without it. The stages sum to less than a frame, which also gathers
//! inputs, skins the garment and computes normals. Rayon's `RAYON_NUM_THREADS` sets the number of
//! threads; the stages of field and intersections run on one.
//!
//! Trained weights give more zero activations than random ones, so that f32 is faster with them.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the run")]

use divan::{Bencher, black_box, counter::ItemsCount};
use glam::Vec3;
use std::sync::Arc;
use unic_builtin::scale::{NetworkSize, VERTICES, random_model, walk};
use unic_core::{
    Animator, IntersectionMode, Model, Pose, Start, StepInput,
    intersection::{BodySnapshot, PaperIntersection},
    model::ModelParts,
    motion::{MotionInput, MotionState},
    network::{Encoder, EncoderScratch, Field, FieldBiases, FieldScratch, TILE},
};

/// Network size as a type, which names a benchmark.
trait Named {
    const NETWORK: NetworkSize;

    fn model(vertices: usize) -> Model {
        random_model(Self::NETWORK, vertices).unwrap()
    }
}

struct Standard;
struct Paper;

impl Named for Standard {
    const NETWORK: NetworkSize = NetworkSize::Standard;
}

impl Named for Paper {
    const NETWORK: NetworkSize = NetworkSize::Paper;
}

fn main() {
    divan::main();
}

#[divan::bench(args = VERTICES, types = [Standard, Paper], sample_count = 20, sample_size = 1, max_time = 4)]
fn frame<P: Named>(bencher: Bencher, vertices: usize) {
    let mut walker = Walker::new::<P>(vertices);
    bencher
        .counter(ItemsCount::new(vertices))
        .bench_local(|| walker.step());
}

#[divan::bench(args = VERTICES, types = [Standard, Paper], sample_count = 20, sample_size = 1, max_time = 4)]
fn frame_unhandled<P: Named>(bencher: Bencher, vertices: usize) {
    let mut walker = Walker::new::<P>(vertices);
    walker.animator.set_intersection(IntersectionMode::Off);
    bencher
        .counter(ItemsCount::new(vertices))
        .bench_local(|| walker.step());
}

/// Forward kinematics and the motion vector, which do not depend on the garment.
#[divan::bench]
fn stage_motion(bencher: Bencher) {
    let model = Standard::model(VERTICES[0]);
    let poses: Vec<Pose> = (0..30).map(walk).collect();
    let (spec, skeleton) = (&model.config().motion, &model.character().skeleton);
    let input = |t: usize| MotionInput {
        pose: &poses[t % poses.len()],
        next_pose: None,
        ground_height: 0.0,
        dt: 1.0 / model.config().fps,
        wind: Vec3::ZERO,
    };
    let mut state = MotionState::start(spec, skeleton, &input(0));
    let mut t = 0;
    bencher.bench_local(|| {
        t += 1;
        state.advance(spec, skeleton, &input(t));
        state.pair().1[0]
    });
}

/// Motion encoder, and folding of the latent vector into the field's biases.
#[divan::bench(types = [Standard, Paper])]
fn stage_encoder<P: Named>(bencher: Bencher) {
    let ModelParts {
        config,
        encoder,
        field,
        normalisation,
        ..
    } = P::model(VERTICES[0]).to_parts();
    let pair = vec![0.1; 2 * normalisation.mean.len()];
    let (points, channels) = (config.state.input_len(), config.encoder.latent_len());
    let encoder = Encoder::new(&config.encoder, pair.len(), encoder).unwrap();
    let field = Field::new(&config.field, points, channels, field).unwrap();
    let (mut scratch, mut biases) = (EncoderScratch::default(), FieldBiases::default());
    let mut latent = vec![0.0; config.encoder.latent_len()];
    bencher.bench_local(|| {
        encoder.encode(black_box(&pair), &[], &mut scratch, &mut latent);
        field.fold(&latent, &mut biases);
    });
}

/// Deformation field at all vertices, on one thread.
#[divan::bench(args = VERTICES, types = [Standard, Paper], sample_count = 10, sample_size = 1, max_time = 3)]
fn stage_field<P: Named>(bencher: Bencher, vertices: usize) {
    let ModelParts { config, field, .. } = P::model(VERTICES[0]).to_parts();
    let (points, channels) = (config.state.input_len(), config.encoder.latent_len());
    let field = Field::new(&config.field, points, channels, field).unwrap();
    let mut biases = FieldBiases::default();
    field.fold(&vec![0.1; config.encoder.latent_len()], &mut biases);
    let inputs = vec![[0.3; TILE]; field.point_inputs()];
    let (mut scratch, mut outputs) = (FieldScratch::default(), [[0.0; TILE]; 3]);
    bencher.counter(ItemsCount::new(vertices)).bench_local(|| {
        for _ in 0..vertices.div_ceil(TILE) {
            field.evaluate(&biases, black_box(&inputs), &mut scratch, &mut outputs);
            black_box(&outputs);
        }
    });
}

/// Intersection handling of the paper on one thread: preparing a posed body for searches, and the
/// nearest body vertex of each garment vertex.
#[divan::bench(args = VERTICES, sample_count = 10, sample_size = 1, max_time = 3)]
fn stage_intersections(bencher: Bencher, vertices: usize) {
    let ModelParts {
        character, garment, ..
    } = Paper::model(vertices).to_parts();
    let rule = PaperIntersection::default();
    let mut body = BodySnapshot::default();
    bencher.counter(ItemsCount::new(vertices)).bench_local(|| {
        body.prepare(&character.body.vertices, &character.body.faces);
        let corrected = garment
            .rest
            .vertices
            .iter()
            .filter_map(|&p| rule.correct(&body, p));
        corrected.sum::<Vec3>()
    });
}

/// An animator of a walking character.
struct Walker {
    animator: Animator,
    frame: usize,
}

impl Walker {
    fn new<P: Named>(vertices: usize) -> Self {
        let mut animator = Animator::new(Arc::new(P::model(vertices)));
        let pose = walk(0);
        animator.reset(&input(&pose), Start::MeanShape).unwrap();
        Self { animator, frame: 0 }
    }

    fn step(&mut self) -> Vec3 {
        self.frame += 1;
        let pose = walk(self.frame);
        self.animator.step(&input(&pose)).unwrap().positions[0]
    }
}

fn input(pose: &Pose) -> StepInput<'_> {
    StepInput {
        pose,
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    }
}
