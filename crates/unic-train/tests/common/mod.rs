//! A small symmetric figure in a tube, captured in a temporary folder.
#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]
#![allow(
    dead_code,
    unused_imports,
    reason = "every test file is a program of its own and uses a part of this"
)]

use burn::tensor::Device;
use glam::{Quat, Vec3};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    config::{EncoderConfig, FieldConfig, LatentCode},
    recurrence::RecurrenceScratch,
};
use unic_io::{Capture, Split};
pub(crate) use unic_testdata::{FPS, Figure, Take, VERTICES, clip, opposite, take};
use unic_train::*;

/// Frames of a take.
pub(crate) const FRAMES: usize = 24;

pub(crate) fn character() -> Character {
    Figure::tube().character
}

pub(crate) fn garment() -> Garment {
    Figure::tube().garment
}

/// The skinned garment in every frame of a clip.
pub(crate) fn skinned(clip: &Clip) -> Vec<Vec<Vec3>> {
    Figure::tube().skinned(clip)
}

/// The same seen in a mirror.
pub(crate) fn mirror_image(take: &Take, name: &str) -> Take {
    let flip = |q: Quat| Quat::from_xyzw(q.x, -q.y, -q.z, q.w);
    let mut other = take.clone();
    other.clip.name = name.into();
    for pose in &mut other.clip.poses {
        pose.trans = mirrored(pose.trans);
        pose.local = [0, 1, 3, 2, 5, 4].map(|j: usize| flip(pose.local[j])).to_vec();
    }
    for (frame, original) in other.garment.iter_mut().zip(&take.garment) {
        *frame = (0..VERTICES as u32)
            .map(|v| mirrored(original[opposite(v) as usize]))
            .collect();
    }
    other
}

/// Writes takes as a capture and opens it. The folder goes with the first value.
pub(crate) fn capture(takes: &[(Take, Split)]) -> (tempfile::TempDir, Capture) {
    unic_testdata::capture(&Figure::tube(), takes)
}

/// Takes as training data. Clips stay mapped when the folder goes.
pub(crate) fn dataset_of(takes: &[(Take, Split)], config: &TrainConfig) -> FieldData {
    let (_folder, capture) = capture(takes);
    FieldData::prepare(capture, config, Fit::HeldOut).unwrap()
}

/// Dataset of three takes to train on and one to validate.
pub(crate) fn dataset(config: &TrainConfig) -> FieldData {
    dataset_for(&Figure::tube(), config)
}

/// [`dataset`] of another figure with the same motion.
pub(crate) fn dataset_for(figure: &Figure, config: &TrainConfig) -> FieldData {
    let (_folder, capture) = unic_testdata::capture(figure, &takes());
    FieldData::prepare(capture, config, Fit::HeldOut).unwrap()
}

/// Takes: three to train on, one to validate.
pub(crate) fn takes() -> Vec<(Take, Split)> {
    let splits = [Split::Train, Split::Train, Split::Train, Split::Validation];
    let take = |(i, split)| (take(&format!("take{i}"), i, FRAMES), split);
    splits.into_iter().enumerate().map(take).collect()
}

/// Recurrence settings of a preset that has some.
pub(crate) fn recurrence_of(config: &mut TrainConfig) -> &mut RecurrenceSettings {
    match &mut config.model.state {
        StateSettings::Displacement {
            recurrence: Some(recurrence),
            ..
        } => recurrence,
        other => panic!("a state without recurrence: {other:?}"),
    }
}

/// Coefficients that the final prior predicts for a training clip, by frame.
pub(crate) fn final_coefficients(data: &FieldData, clip: usize) -> Vec<Vec<f32>> {
    let motion = &data.motion[clip];
    let (mut scratch, mut state) = (RecurrenceScratch::default(), Vec::new());
    let of = |t: usize| {
        let pair = [t.saturating_sub(1), t]
            .map(|t| motion.frame(t, View::Direct))
            .concat();
        let mut out = Vec::new();
        data.prior.coefficients(&pair, &mut out);
        if let Some(recurrence) = &data.prior.recurrence {
            recurrence.embed(&pair, &mut scratch);
            match t {
                0 => recurrence.start(&mut scratch, &mut state),
                _ => recurrence.advance(&mut scratch, &mut state),
            }
            recurrence.add_to(&state, &mut scratch, &mut out);
        }
        out
    };
    (0..data.clips[clip].len()).map(of).collect()
}

/// Returns the drawn clip's number, and the data of all clips with the prior that was fitted
/// without it. Checks that this prior predicts the coefficients that the clip's field is trained
/// with.
pub(crate) fn data_with_the_held_out_prior(held_out: FieldData) -> (usize, FieldData) {
    let (name, prior) = (held_out.validation[0].name().to_owned(), held_out.prior.clone());
    let mut data = held_out.on_all_clips().unwrap();
    let drawn = data.clips.iter().position(|c| c.name() == name).unwrap();
    assert_ne!(data.prior, prior);
    data.prior = prior;
    let predicted = final_coefficients(&data, drawn);
    assert_eq!(predicted.len(), data.coefficients[drawn].len());
    for (predicted, left_out) in predicted
        .iter()
        .flatten()
        .zip(data.coefficients[drawn].iter().flatten())
    {
        assert!((predicted - left_out).abs() < 1e-5, "{predicted} {left_out}");
    }
    (drawn, data)
}

/// Both kinds of state.
pub(crate) const PRESETS: [Preset; 2] = [Preset::Paper, Preset::Tiny];

/// A preset's method with networks and batches that a test affords.
pub(crate) fn small(preset: Preset) -> TrainConfig {
    let mut config = TrainConfig::preset(preset);
    config.model.encoder = EncoderConfig {
        hidden: vec![24],
        channels: 6,
        categories: 4,
        code: LatentCode::PickedLogit,
    };
    config.model.field = FieldConfig {
        width: 24,
        hidden_layers: 3,
        skip: Some(2),
    };
    if let StateSettings::Displacement {
        skinning,
        memory_s,
        prior_shapes,
        recurrence,
        ..
    } = &mut config.model.state
    {
        // Closed forms are in the frames of the capture's own weights.
        *skinning = SkinningSource::Given;
        // Longer than the clips, so that what is forgotten is training's to correct.
        *memory_s = 2.0;
        *prior_shapes = 3;
        *recurrence = Some(RecurrenceSettings {
            start: RecurrenceStart::Random,
            oscillators: 4,
            width: 8,
            steps: 20,
            epochs: 1000,
            learning_rate: 1e-2,
            windows: 4,
            frames: 12,
            dropout: 0.2,
            swing: 0.0,
        });
    }
    config.replay.at_inference = false;
    config.batch = BatchConfig {
        windows: 4,
        points: 16,
        unroll_first: 1,
        unroll_last: 3,
        unroll_grown: 0.5,
    };
    config.set_steps(10);
    config.optimiser.warmup = 0.2;
    config.validation.every = 4;
    config.validation.refit = Refit::Never;
    config.intersection.at_inference = false;
    // What is predicted is what is shown.
    config.projection.at_inference = false;
    config
}

/// Starts without noise: what is compared or differentiated is the same every time.
pub(crate) fn without_noise(mut config: TrainConfig) -> TrainConfig {
    config.regularisation.state_noise_m = 0.0;
    config
}

pub(crate) fn device() -> Device {
    Device::flex().autodiff()
}

/// Sizes and random parameters of the networks for a data set, the field's head among them.
pub(crate) fn network(data: &FieldData, seed: u64) -> (NetworkShape, Network) {
    let shape = NetworkShape::new(&data.config, data.capture.character.skeleton.len());
    let shape = NetworkShape {
        zero_head: false,
        ..shape
    };
    let network = Network::new(&shape, seed, &device());
    (shape, network)
}

/// Runs to the end without listening.
pub(crate) fn run(trainer: &mut Trainer) {
    trainer.run(None, &mut |_| Control::Continue).unwrap();
}

/// Numbers in ±scale that repeat: multiples of the golden ratio.
pub(crate) fn numbers(count: usize, scale: f32, seed: usize) -> Vec<f32> {
    let phase = |i: usize| ((i + 1000 * seed) as f64 * 0.618_033_988_749_895).fract();
    (0..count)
        .map(|i| scale * (2.0 * phase(i) - 1.0) as f32)
        .collect()
}

/// ‖a − b‖ / ‖b‖.
pub(crate) fn relative_error(a: &[f32], b: &[f32]) -> f64 {
    assert_eq!(a.len(), b.len());
    let square = |x: f32| f64::from(x).powi(2);
    let error: f64 = a.iter().zip(b).map(|(a, b)| square(a - b)).sum();
    (error / b.iter().map(|b| square(*b)).sum::<f64>().max(f64::MIN_POSITIVE)).sqrt()
}
