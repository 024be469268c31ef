//! Contract: a run is a function of capture and settings, whatever the number of threads and however
//! often it is interrupted; what cannot be trained on is refused, and a run that diverges says so.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use std::path::Path;
use unic_io::Split;
use unic_train::*;

/// What a run leaves behind, without the time that it took.
type Result = (Progress, Vec<(String, Vec<Vec<f32>>)>);

fn newest(folder: &Path) -> Result {
    let mut checkpoint = Checkpoint::newest(folder).unwrap().unwrap();
    checkpoint.progress.seconds = 0.0;
    (checkpoint.progress, checkpoint.groups)
}

fn trainer(config: &TrainConfig) -> Trainer {
    Trainer::new(dataset(config), config.clone()).unwrap()
}

fn straight(config: &TrainConfig) -> Result {
    let folder = tempfile::tempdir().unwrap();
    let outcome = trainer(config)
        .run(Some(folder.path()), &mut |_| Control::Continue)
        .unwrap();
    assert_eq!(outcome, Outcome::Finished);
    newest(folder.path())
}

/// Stopped after `steps`, then resumed by another trainer.
fn interrupted(config: &TrainConfig, steps: u64) -> Result {
    let folder = tempfile::tempdir().unwrap();
    let mut listen = |event: &Event| match event {
        Event::Step { step, .. } if *step == steps => Control::Stop,
        _ => Control::Continue,
    };
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
        config.intersection.from_step = Some(5);
        config.keep = Keep::Best;
        for average in [0.0, 0.9] {
            config.regularisation.average = average;
            let whole = straight(&config);
            let names: Vec<&str> = whole.1.iter().map(|g| g.0.as_str()).collect();
            let expected: &[&str] = match average > 0.0 {
                true => &["average", "best", "first_moments", "parameters", "second_moments"],
                false => &["best", "first_moments", "parameters", "second_moments"],
            };
            assert_eq!(names, expected);
            // Before and after the first validation, which `best` comes from.
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
fn the_number_of_threads_changes_nothing() {
    for preset in PRESETS {
        let mut config = small(preset);
        config.intersection.from_step = Some(5);
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

fn losses(config: &TrainConfig) -> Vec<f32> {
    let mut losses = Vec::new();
    let mut listen = |event: &Event| {
        if let Event::Step { loss, .. } = event {
            losses.push(*loss);
        }
        Control::Continue
    };
    trainer(config).run(None, &mut listen).unwrap();
    losses
}

#[test]
fn intersections_are_handled_from_their_step_on() {
    for preset in PRESETS {
        let mut config = small(preset);
        let free = losses(&config);
        config.intersection.from_step = Some(6);
        let handled = losses(&config);
        assert_eq!(free[..6], handled[..6], "{preset:?}");
        assert_ne!(free[6], handled[6], "{preset:?}");
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
        config.validate_every = 1000;
        let error = trainer(&config)
            .run(None, &mut |_| Control::Continue)
            .unwrap_err();
        assert!(matches!(error, TrainError::Diverged { .. }), "{error}");
        assert!(error.to_string().contains("learning_rate"), "{error}");
    }
}

#[test]
fn captures_without_enough_to_train_on_are_refused() {
    let config = small(Preset::Tiny);
    let (_folder, none) = capture(&[(take("one", 0, FRAMES), Split::Test)]);
    let error = Dataset::new(none, &config).err().unwrap();
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
    let checkpoint = || Checkpoint::newest(folder.path()).unwrap().unwrap();
    let refused = |config: &TrainConfig, checkpoint: Checkpoint| {
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
