//! Contract: a candidate's error is that of the animator with the model of the same parameters and
//! share, beside a prior that has not seen the motion. Each motion is left out once at most. Gains
//! weigh motions alike. A sizing that is stopped ends as one that is not.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use super::{folds::folds, gain::SHARES, judge::Judge, *};
use crate::{
    Control, Fit, Preset, StateSettings, Trainer,
    config::Refit,
    free_running_rmse,
    network::{Network, NetworkShape},
    rollout::Rollout,
};
use unic_core::config::StateConfig;
use unic_io::Split;
use unic_testdata::{Figure, capture, take};

/// Steps that a test affords, on clips of 24 frames.
fn small(sizes: &[[usize; 2]]) -> TrainConfig {
    let mut config = TrainConfig::preset(Preset::Tiny);
    config.model.encoder.hidden = vec![24];
    config.model.encoder.channels = 6;
    (config.batch.windows, config.batch.points) = (4, 16);
    (config.batch.unroll_first, config.batch.unroll_last) = (1, 3);
    if let StateSettings::Displacement {
        prior_shapes,
        recurrence,
        ..
    } = &mut config.model.state
    {
        (*prior_shapes, *recurrence) = (3, None);
    }
    config.set_steps(6);
    config.validation.refit = Refit::AllClips;
    config.intersection.at_inference = false;
    config.projection.at_inference = false;
    config.sizing.sizes = sizes.to_vec();
    config
}

/// Data of a capture with so many training clips of different motion.
fn data(config: &TrainConfig, clips: usize) -> FieldData {
    let take = |i: usize| (take(&format!("take{i}"), i, 24), Split::Train);
    let takes: Vec<_> = (0..clips).map(take).collect();
    let (_folder, capture) = capture(&Figure::tube(), &takes);
    FieldData::prepare(capture, config, Fit::HeldOut).unwrap()
}

fn sizing(config: &TrainConfig, folder: Option<&Path>, follow: &Follow) -> Result<Sizing, TrainError> {
    let mut data = data(config, 4);
    let trainer = SizingTrainer {
        data: &mut data,
        settings: config,
        processor: Processor::Cpu,
        folder,
    };
    trainer.run(follow).map(|sizing| sizing.unwrap())
}

fn without_time(mut sizing: Sizing) -> Sizing {
    sizing.seconds = 0.0;
    sizing
}

#[test]
fn errors_are_those_of_the_animator() {
    let config = small(&[[24, 3]]);
    let mut held_out = data(&config, 4);
    let name = held_out.validation[0].name().to_owned();
    let shape = NetworkShape {
        zero_head: false,
        ..NetworkShape::new(&held_out.config, held_out.capture.character.skeleton.len())
    };
    let device = device::open(Processor::Cpu).unwrap();
    let network = Network::new(&shape, 3, &device);
    let (squares, points) = held_out.on_all_known_clips(|data| {
        let folds = folds(&data.clips);
        let stretches = folds.iter().flat_map(|fold| &fold.held_out);
        let stretch = stretches
            .into_iter()
            .find(|s| data.clips[s.clip].name() == name)
            .unwrap();
        let judge = Judge {
            data,
            seed: 1,
            rollout: Rollout {
                shape: &shape,
                config: &data.config,
                loss: &config.loss,
                products: Default::default(),
            },
            device: &device,
        };
        let vertices = data.capture.garment.rest.vertices.len();
        let frames = stretch.frames.len() - 1;
        (
            judge.errors(&network, stretch).unwrap().squares,
            vertices.min(128) * frames,
        )
    });
    let trainer = Trainer::new(held_out, config).unwrap();
    let values: Vec<Vec<f32>> = network.parameters().into_iter().map(|p| p.values).collect();
    for (share, square) in SHARES.iter().copied().chain([0.0]).zip(squares) {
        let model = trainer.model_with(&values, share).unwrap();
        // Models with a field keep nothing of their start.
        let StateConfig::Displacement(state) = &model.config().state else {
            panic!("{:?}", model.config().state);
        };
        assert_eq!(state.excursion_m, Some(0.02).filter(|_| share == 0.0));
        let rmse = free_running_rmse(&model.into(), &trainer.data().validation).unwrap();
        let judged = (square / points as f64).sqrt();
        assert!(
            (rmse - judged).abs() < 1e-3 * rmse,
            "share {share}: {judged} of {rmse} m"
        );
    }
    // The check could not fail if the share changed nothing.
    assert!(squares[0] > 1.01 * squares[SHARES.len()] || squares[0] < 0.99 * squares[SHARES.len()]);
}

#[test]
fn every_motion_is_left_out_once_at_most_and_never_trained_on_beside() {
    let config = small(&[[24, 3]]);
    for (clips, count) in [(1, 3), (2, 2), (7, 3), (20, 1)] {
        let mut data = data(&config, clips);
        data.on_all_known_clips(|data| {
            let folds = folds(&data.clips);
            assert_eq!(folds.len(), count, "{clips} clips");
            let mut judged: Vec<usize> = Vec::new();
            for fold in &folds {
                judged.extend(fold.held_out.iter().map(|s| s.motion));
                for held_out in &fold.held_out {
                    assert!(fold.train.iter().all(|s| *s != held_out.stretch));
                }
            }
            judged.sort_unstable();
            judged.dedup();
            let most = folds.iter().map(|fold| fold.held_out.len()).sum::<usize>();
            assert_eq!(judged.len(), most);
        });
        // What was held out is held out again.
        assert_eq!(data.clips.len(), if clips > 1 { clips - 1 } else { 1 });
    }
}

#[test]
fn motions_count_the_same_whatever_their_error() {
    let error = |motion, prior: f64, factor: f64| judge::MotionError {
        motion,
        squares: [prior * factor, prior, prior, prior, prior],
    };
    // A lively motion gains 10 %, four calm ones lose 10 % each.
    let mut errors = vec![error(0, 1e4, 0.81)];
    errors.extend((1..5).map(|motion| error(motion, 1.0, 1.21)));
    let whole = Gain::best(errors.iter());
    assert!(whole.share < 1.0 && whole.mean.abs() < 1e-12 && !whole.is_significant());
    let all = Gain::best(
        [0, 1, 2]
            .map(|motion| error(motion, 1.0 + motion as f64, 0.81))
            .iter(),
    );
    assert_eq!(all.share, 1.0);
    assert!((all.mean - 0.1).abs() < 1e-12 && all.error < 1e-12 && all.is_significant());
    // A field that diverges is no gain, and stays a number that JSON holds.
    let diverged = Gain::best([error(0, 1.0, f64::NAN)].iter());
    assert!(diverged.mean.is_finite() && !diverged.is_significant());
}

#[test]
fn rungs_end_with_the_settings_steps() {
    assert_eq!(rungs(3000), [111, 333, 1000, 3000]);
    assert_eq!(rungs(299), [299]);
    assert_eq!(rungs(1), [1]);
}

#[test]
fn a_stopped_sizing_ends_as_one_that_is_not() {
    let config = small(&[[16, 2], [24, 3]]);
    let go_on = |_: SizingEvent| Control::Continue;
    let whole = without_time(sizing(&config, None, &go_on).unwrap());
    assert_eq!(whole.tried.len(), 2);
    let folder = tempfile::tempdir().unwrap();
    let stop = |event: SizingEvent| match event {
        SizingEvent::Step { done, .. } if done >= 20 => Control::Stop,
        _ => Control::Continue,
    };
    let stopped = sizing(&config, Some(folder.path()), &stop);
    assert!(matches!(stopped, Err(TrainError::Stopped)), "{stopped:?}");
    let resumed = sizing(&config, Some(folder.path()), &go_on).unwrap();
    assert_eq!(without_time(resumed.clone()), whole);
    // A finished one is read and not made again.
    let steps = AtomicU64::new(0);
    let count = |event: SizingEvent| {
        if let SizingEvent::Step { .. } = event {
            steps.fetch_add(1, Ordering::Relaxed);
        }
        Control::Continue
    };
    assert_eq!(sizing(&config, Some(folder.path()), &count).unwrap(), resumed);
    assert_eq!(steps.into_inner(), 0);
    let other = small(&[[16, 2]]);
    assert!(sizing(&other, Some(folder.path()), &go_on).is_err());
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let config = small(&[[16, 2], [24, 3]]);
    let by_threads = |count: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .unwrap();
        pool.install(|| without_time(sizing(&config, None, &|_| Control::Continue).unwrap()))
    };
    assert_eq!(by_threads(1), by_threads(3));
}

#[test]
fn a_fit_has_the_chosen_size_and_share() {
    let config = small(&[[16, 2]]);
    let sizing = Sizing {
        chosen: Candidate {
            width: 40,
            hidden_layers: 2,
            steps: 3,
        },
        share: 0.5,
        judged_clips: vec![],
        tried: vec![],
        seconds: 0.0,
    };
    let data = data(&config, 3);
    let trainer = Trainer::sized(Processor::Cpu, data, &config, Some(&sizing)).unwrap();
    assert_eq!(trainer.config().optimiser.steps, 3);
    let validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
    assert_eq!(validation.field_share, 0.5);
    let model = trainer.model().unwrap();
    assert_eq!(
        (model.config().field.width, model.config().field.hidden_layers),
        (40, 2)
    );
    let next = trainer.into_data().on_all_clips().unwrap();
    assert_eq!(next.config.field.width, 40);
}

#[test]
fn results_are_continued_in_another_product_format_and_with_no_other_settings() {
    let folder = tempfile::tempdir().unwrap();
    let settings = small(&[[8, 2]]);
    let results = record::Results::open(Some(folder.path()), &settings).unwrap();
    results.write().unwrap();
    let mut changed = settings.clone();
    changed.optimiser.products = crate::config::Products::Bf16;
    assert!(record::Results::open(Some(folder.path()), &changed).is_ok());
    changed.seed += 1;
    let refused = record::Results::open(Some(folder.path()), &changed)
        .err()
        .unwrap();
    assert!(refused.to_string().contains("one of other settings"), "{refused}");
}

#[test]
fn a_gain_below_two_standard_errors_is_noise() {
    let gain = |mean, error| Gain {
        share: 1.0,
        mean,
        error,
        least: 0.0,
    };
    assert!(gain(0.02, 0.009).is_significant());
    assert!(!gain(0.02, 0.011).is_significant());
    assert!(!gain(0.001, 0.0).is_significant());
}

#[test]
fn fields_that_do_harm_beyond_noise_end_a_sizing() {
    let may_help = |mean, error| {
        let (share, least) = (1.0, 0.0);
        let gain = Gain {
            share,
            mean,
            error,
            least,
        };
        gain.may_help()
    };
    // Too few steps to do anything, or too few motions to tell.
    assert!(may_help(0.0, 0.0) && may_help(-0.001, 0.001) && may_help(-0.009, 0.01));
    assert!(!may_help(-0.013, 0.01) && !may_help(-0.0021, 0.001));
    let error = |motion, factor: f64| judge::MotionError {
        motion,
        squares: [factor, factor, factor, factor, 1.0],
    };
    let diverged = [error(0, 0.98), error(1, f64::NAN), error(2, 0.98)];
    assert!(!Gain::best(diverged.iter()).may_help());
}
