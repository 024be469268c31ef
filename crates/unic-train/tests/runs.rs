//! Contract: a run is a function of capture and settings, whatever the number of threads and
//! however often it is interrupted. Captures that cannot be trained on are refused, and a diverging
//! run ends with an error.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use std::path::Path;
use unic_io::Split;
use unic_train::*;

/// The newest checkpoint of a run, without the time that the run took.
fn newest(folder: &Path) -> Checkpoint<FieldRecord> {
    let mut checkpoint = Checkpoint::<FieldRecord>::newest(folder).unwrap().unwrap();
    checkpoint.position.seconds = 0.0;
    checkpoint.record.prior_seconds = 0.0;
    checkpoint
}

fn trainer(config: &TrainConfig) -> Trainer {
    Trainer::new(dataset(config), config.clone()).unwrap()
}

fn straight(config: &TrainConfig) -> Checkpoint<FieldRecord> {
    let folder = tempfile::tempdir().unwrap();
    let outcome = trainer(config)
        .run(Some(folder.path()), &mut |_| Control::Continue)
        .unwrap();
    assert_eq!(outcome, Outcome::Finished);
    newest(folder.path())
}

/// Stopped after `steps`, then resumed by another trainer.
fn interrupted(config: &TrainConfig, steps: u64) -> Checkpoint<FieldRecord> {
    let listen = |event: &Event| match event {
        Event::Step { step, .. } if *step == steps => Control::Stop,
        _ => Control::Continue,
    };
    resumed(config, steps, listen)
}

/// Stopped within the measurement after `steps`, after that of its first frame, then resumed.
fn interrupted_in_measuring(config: &TrainConfig, steps: u64) -> Checkpoint<FieldRecord> {
    let mut frames = 0;
    let listen = |event: &Event| match event {
        Event::Measuring { step } if *step == steps => {
            frames += 1;
            if frames > 1 {
                Control::Stop
            } else {
                Control::Continue
            }
        }
        _ => Control::Continue,
    };
    resumed(config, steps, listen)
}

fn resumed(
    config: &TrainConfig,
    steps: u64,
    mut listen: impl FnMut(&Event) -> Control,
) -> Checkpoint<FieldRecord> {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(
        trainer(config).run(Some(folder.path()), &mut listen).unwrap(),
        Outcome::Stopped
    );
    let mut other = trainer(config);
    other
        .resume(Checkpoint::newest(folder.path()).unwrap().unwrap(), folder.path())
        .unwrap();
    assert_eq!(other.step(), steps);
    other
        .run(Some(folder.path()), &mut |_| Control::Continue)
        .unwrap();
    newest(folder.path())
}

#[test]
fn a_resumed_run_ends_where_an_uninterrupted_one_does() {
    for preset in PRESETS {
        let mut config = small(preset);
        for average in [0.0, 0.9] {
            config.regularisation.average = average;
            let whole = straight(&config);
            let names: Vec<&str> = whole.groups.iter().map(|g| g.0.as_str()).collect();
            let expected: &[&str] = match average > 0.0 {
                true => &["average", "first_moments", "parameters", "second_moments"],
                false => &["first_moments", "parameters", "second_moments"],
            };
            assert_eq!(names, expected);
            // Before and after the first validation, which the best error comes from.
            for steps in [3, 7] {
                assert!(
                    interrupted(&config, steps) == whole,
                    "{preset:?}, average {average}, {steps} steps"
                );
            }
        }
    }
}

#[test]
fn a_measurement_that_was_stopped_is_made_again() {
    let config = small(PRESETS[0]);
    let whole = straight(&config);
    for steps in [config.validation.every, config.optimiser.steps] {
        assert!(interrupted_in_measuring(&config, steps) == whole, "{steps} steps");
    }
}

#[test]
fn the_number_of_threads_changes_nothing() {
    for preset in PRESETS {
        let mut config = small(preset);
        // Wide enough that work is shared out.
        config.model.encoder.hidden = vec![512];
        config.batch.points = VERTICES;
        config.batch.windows = 16;
        let by_threads = |count: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(count)
                .build()
                .unwrap();
            pool.install(|| straight(&config))
        };
        assert!(by_threads(1) == by_threads(2), "{preset:?}");
    }
}

#[test]
fn training_lowers_the_loss_and_the_free_running_error() {
    let mut config = small(Preset::Tiny);
    config.optimiser.steps = 150;
    config.optimiser.learning_rate = 3e-3;
    config.regularisation.dropout = 0.0;
    config.regularisation.input_dropout = 0.0;
    let mut trainer = trainer(&config);
    let error = |t: &Trainer| {
        free_running_rmse(&std::sync::Arc::new(t.model().unwrap()), &t.data().validation).unwrap()
    };
    let before = error(&trainer);
    run(&mut trainer);
    let after = error(&trainer);
    assert!(after < 0.7 * before, "{before} m to {after} m");
}

#[test]
fn a_learning_rate_beyond_reason_is_reported_as_divergence() {
    for preset in PRESETS {
        let mut config = small(preset);
        config.optimiser.learning_rate = 1e30;
        config.optimiser.clip_norm = 0.0;
        config.validation.every = 1000;
        let error = trainer(&config)
            .run(None, &mut |_| Control::Continue)
            .unwrap_err();
        assert!(matches!(error, TrainError::Diverged { .. }), "{error}");
        assert!(error.to_string().contains("learning_rate"), "{error}");
    }
}

/// Positions so far away that squared errors overflow, from frame 1 on.
fn beyond_numbers(clip: &unic_eval::PreparedClip) -> unic_eval::PreparedClip {
    let mut clip = clip.clone();
    let frames = clip.captured.garment.len();
    let mut numbers: Vec<f32> = (clip.captured.garment.frame(0).iter())
        .flat_map(|v| v.to_array())
        .collect();
    numbers.resize(frames * numbers.len(), 1e30);
    clip.captured.garment = unic_io::GarmentFrames::new(numbers, frames, VERTICES).unwrap();
    clip
}

#[test]
fn checkpoints_of_a_run_without_a_finite_validation_error_read_back() {
    for preset in PRESETS {
        let config = small(preset);
        let lost = |config: &TrainConfig| {
            let mut data = dataset(config);
            data.validation = vec![beyond_numbers(&data.validation[0])];
            Trainer::new(data, config.clone()).unwrap()
        };
        let folder = tempfile::tempdir().unwrap();
        let mut errors = Vec::new();
        let mut listen = |event: &Event| {
            if let Event::Validated { rmse, .. } = event {
                errors.push(*rmse);
            }
            Control::Continue
        };
        lost(&config).run(Some(folder.path()), &mut listen).unwrap();
        assert!(
            !errors.is_empty() && errors.iter().all(|e| e.is_infinite()),
            "{errors:?}"
        );
        let checkpoint = Checkpoint::<FieldRecord>::newest(folder.path()).unwrap().unwrap();
        assert_eq!(checkpoint.record.best_rmse, None);
        assert_eq!(checkpoint.position.step, config.optimiser.steps);
        let mut resumed = lost(&config);
        resumed.resume(checkpoint, folder.path()).unwrap();
        assert!(resumed.model().unwrap().to_bytes().is_ok());
    }
}

/// Three clips to train on and none to validate, and settings that want a second fit.
fn undivided() -> (tempfile::TempDir, unic_io::Capture, TrainConfig) {
    let takes: Vec<_> = (0..3)
        .map(|i| (take(&format!("take{i}"), i, FRAMES), Split::Train))
        .collect();
    let (folder, capture) = capture(&takes);
    let mut config = small(Preset::Tiny);
    config.validation.refit = Refit::AllClips;
    (folder, capture, config)
}

#[test]
fn a_drawn_clip_is_held_out_of_the_first_fit_and_back_in_the_second() {
    let (_folder, capture, config) = undivided();
    let [first, second] = Fit::of_run(&capture, &config) else {
        panic!("two fits")
    };
    let names = |clips: &[unic_eval::PreparedClip]| -> Vec<String> {
        clips.iter().map(|c| c.name().to_owned()).collect()
    };
    let held_out = FieldData::prepare(capture.clone(), &config, *first).unwrap();
    assert_eq!((held_out.clips.len(), held_out.validation.len()), (2, 1));
    assert!(!names(&held_out.clips).contains(&names(&held_out.validation)[0]));
    let all = FieldData::prepare(capture.clone(), &config, *second).unwrap();
    assert_eq!(names(&all.clips), capture.clip_names(Split::Train));
    assert!(all.validation.is_empty());
    // The prior has not seen it; what motion vectors are scaled by is one for both fits.
    assert_eq!(held_out.normalisation, all.normalisation);
    assert_ne!(held_out.prior, all.prior);
    assert_ne!(held_out.config, all.config);
    // The second fit begins with what it would have made itself.
    let next = held_out.on_all_clips().unwrap();
    assert_eq!((next.fit, names(&next.clips)), (*second, names(&all.clips)));
    assert!(
        FieldData::prepare(capture.clone(), &config, *second)
            .unwrap()
            .on_all_clips()
            .is_none()
    );
    assert!(next.validation.is_empty() && next.prior == all.prior && next.config == all.config);
    assert_eq!(next.coefficients, all.coefficients);
    for (next, all) in next.motion.iter().zip(&all.motion) {
        assert_eq!(next.frame(5, View::Mirrored), all.frame(5, View::Mirrored));
    }
}

#[test]
fn run_without_a_drawn_clip_has_one_fit() {
    let (_folder, undivided, mut config) = undivided();
    let one = |takes: &[(Take, Split)], config: &TrainConfig| {
        let (_folder, capture) = capture(takes);
        assert_eq!(Fit::of_run(&capture, config), [Fit::HeldOut]);
    };
    one(&[(take("alone", 0, FRAMES), Split::Train)], &config);
    let named = [
        (take("a", 0, FRAMES), Split::Train),
        (take("b", 1, FRAMES), Split::Train),
        (take("c", 2, FRAMES), Split::Validation),
    ];
    one(&named, &config);
    config.validation.refit = Refit::Never;
    assert_eq!(Fit::of_run(&undivided, &config), [Fit::HeldOut]);
}

#[test]
fn run_may_have_one_fit_on_all_clips() {
    let (_folder, capture, mut config) = undivided();
    config.validation.refit = Refit::Only;
    assert_eq!(Fit::of_run(&capture, &config), [Fit::AllClips]);
}

#[test]
fn limited_motion_takes_the_same_share_of_every_clip() {
    let (_folder, capture, mut config) = undivided();
    let lengths = |config: &TrainConfig| -> Vec<usize> {
        let data = FieldData::prepare(capture.clone(), config, Fit::HeldOut).unwrap();
        (data.clips.iter().chain(&data.validation))
            .map(unic_eval::PreparedClip::len)
            .collect()
    };
    assert_eq!(lengths(&config), [FRAMES; 3]);
    // Three clips to train on in the end: a quarter of each.
    config.motion_seconds = Some(0.25 * 3.0 * FRAMES as f64 / f64::from(FPS));
    assert_eq!(lengths(&config), [FRAMES / 4, FRAMES / 4, FRAMES]);
    config.motion_seconds = Some(1e9);
    assert_eq!(lengths(&config), [FRAMES; 3]);
}

#[test]
fn fit_on_all_clips_records_the_validation_of_the_fit_before() {
    let (_folder, capture, mut config) = undivided();
    config.projection.at_inference = true;
    let data = FieldData::prepare(capture, &config, Fit::AllClips).unwrap();
    let mut trainer = Trainer::new(data, config).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let mut listen = |event: &Event| {
        assert!(!matches!(event, Event::Validated { .. }), "{event:?}");
        Control::Continue
    };
    trainer.run(Some(folder.path()), &mut listen).unwrap();
    assert_eq!(trainer.validation(&|| Control::Continue).unwrap(), None);
    trainer.set_validation(Validation {
        fit: Fit::HeldOut,
        motion: ValidationMotion::Unseen,
        clips: vec!["take1".into()],
        rmse_mm: 41.5,
        field_share: 0.5,
        bending: Some(0.35),
        chord_deviations: None,
        order: None,
        replay_factor: None,
        trials: vec![],
    });
    let training = trainer.model().unwrap().about().training.clone();
    assert_eq!(training["fit"], "all_clips");
    assert_eq!(training["training_clips"].as_array().unwrap().len(), 3);
    assert_eq!(training["validation"]["fit"], "held_out");
    assert_eq!(training["validation"]["rmse_mm"], 41.5);
    let model = trainer.model().unwrap();
    assert_eq!(model.config().projection.unwrap().bending, 0.35);
    // A checkpoint of the other fit is not mistaken for one of this.
    let mut checkpoint = Checkpoint::<FieldRecord>::newest(folder.path()).unwrap().unwrap();
    checkpoint.record.fit = Fit::HeldOut;
    let error = trainer.resume(checkpoint, folder.path()).unwrap_err().to_string();
    assert!(error.contains("another fit"), "{error}");
}

#[test]
fn captures_without_enough_to_train_on_are_refused() {
    let config = small(Preset::Tiny);
    let (_folder, none) = capture(&[(take("one", 0, FRAMES), Split::Test)]);
    let error = FieldData::prepare(none, &config, Fit::HeldOut).err().unwrap();
    assert!(matches!(error, TrainError::NoClips { .. }), "{error}");
    let mut data = dataset(&config);
    // Captures hold no clip of one frame, but a caller may cut one.
    let mut captured = data.clips[0].captured.clone();
    captured.clip.poses.truncate(1);
    data.clips = vec![unic_eval::PreparedClip::new(
        &data.config.motion,
        &data.capture.character.skeleton,
        captured,
    )];
    let error = Trainer::new(data, config).err().unwrap();
    assert!(
        matches!(error, TrainError::ShortClip { frames: 1, .. }),
        "{error}"
    );
}

#[test]
fn checkpoints_of_another_run_are_refused() {
    let config = small(Preset::Tiny);
    let folder = tempfile::tempdir().unwrap();
    trainer(&config)
        .run(Some(folder.path()), &mut |_| Control::Continue)
        .unwrap();
    let checkpoint = || Checkpoint::<FieldRecord>::newest(folder.path()).unwrap().unwrap();
    let refused = |config: &TrainConfig, checkpoint: Checkpoint<FieldRecord>| {
        let error = trainer(config).resume(checkpoint, folder.path()).unwrap_err();
        assert!(matches!(error, TrainError::Checkpoint { .. }), "{error}");
    };
    let mut other = config.clone();
    other.seed += 1;
    refused(&other, checkpoint());
    for (name, damage) in [("average", 0), ("parameters", 1)] {
        let mut damaged = checkpoint();
        match damage {
            0 => damaged.groups.retain(|g| g.0 != name),
            _ => damaged
                .groups
                .iter_mut()
                .filter(|g| g.0 == name)
                .for_each(|g| g.1[0].truncate(1)),
        }
        refused(&config, damaged);
    }
}
