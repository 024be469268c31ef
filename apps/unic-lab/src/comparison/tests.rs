//! Contract: networks of other methods learn what follows from their inputs and nothing else, stay
//! finite in free running, and do not depend on the number of threads.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use super::*;
use glam::{Quat, Vec3};
use unic_core::Pose;
use unic_core::character::{Character, Garment};
use unic_core::config::LatentCode;
use unic_core::features::PointFrame;
use unic_core::motion::{MotionLayout, MotionSpec, VelocityScheme};
use unic_eval::{Mode, Predictor, PreparedClip, TrainingSet, training_set, training_set_of};
use unic_io::Split;
use unic_testdata::{FPS, Figure, Take, capture as capture_of, take};
use unic_train::Products;

fn character() -> Character {
    Figure::tube().character
}

fn garment() -> Garment {
    Figure::tube().garment
}

/// Writes takes as a capture and opens it. The folder goes with the first value.
fn capture(takes: &[(Take, Split)]) -> (tempfile::TempDir, unic_io::Capture) {
    capture_of(&Figure::tube(), takes)
}

const LENGTH: usize = 200;

/// Replaces the garment of a take by u = offset + slope · (height over 1 m) in the frame of each
/// vertex.
fn with_slope(mut take: Take, slope: &dyn Fn(usize) -> Vec3) -> Take {
    let (character, garment) = (character(), garment());
    for (t, pose) in take.clip.poses.iter().enumerate() {
        let (mut joints, mut transforms) = (Vec::new(), Vec::new());
        character.skeleton.forward_kinematics(pose, &mut joints);
        character.skeleton.world_from_rest(&joints, &mut transforms);
        let position = |(vertex, rest): (usize, &Vec3)| {
            let u = Vec3::Z * 0.02 + slope(t) * (rest.y - 1.0);
            PointFrame::new(&garment, vertex, &transforms).position(u)
        };
        take.garment[t] = garment.rest.vertices.iter().enumerate().map(position).collect();
    }
    take
}

/// Take whose garment follows the pose alone, not linearly.
fn posed(seed: usize) -> Take {
    let take = take(&format!("take{seed}"), 5 * seed, LENGTH);
    let poses = take.clip.poses.clone();
    with_slope(take, &|t| {
        let local = &poses[t].local;
        let (arm, lean) = (local[2].z, local[1].x);
        Vec3::new(arm * arm, arm * lean, lean)
    })
}

/// Take whose garment follows the root's velocity a tenth of a second ago.
fn dragged(seed: usize) -> Take {
    let take = take(&format!("take{seed}"), 5 * seed, LENGTH);
    let poses = take.clip.poses.clone();
    with_slope(take, &|t| {
        let before = t.saturating_sub(3).max(1);
        let velocity = (poses[before].trans - poses[before - 1].trans) * FPS;
        Vec3::new(0.3, 0.0, 0.1) * velocity.x
    })
}

fn small(kind: ComparisonKind) -> ComparisonConfig {
    let mut config = ComparisonConfig::of(kind);
    config.space = match config.space {
        SpaceSettings::Components(_) => SpaceSettings::Components(8),
        SpaceSettings::VirtualBones(_) => SpaceSettings::VirtualBones(3),
    };
    config.hidden = vec![48];
    (config.dropout, config.input_dropout) = (0.0, 0.0);
    config.frames = 64;
    config.optimiser.steps = 400;
    config.optimiser.learning_rate = 4e-3;
    config.optimiser.warmup = 0.05;
    if let Some(feature) = &mut config.global_feature {
        feature.encoder.hidden = vec![24];
        feature.encoder.channels = 6;
        (feature.hidden, feature.width) = (16, 8);
    }
    config
}

fn spec(config: &ComparisonConfig) -> MotionSpec {
    let contact_joints = Figure::tube().contact_joints;
    MotionSpec::new(config.layout, config.velocity, contact_joints, &character()).unwrap()
}

/// Training set of three takes, and a fourth take.
fn sets(take: fn(usize) -> Take) -> (TrainingSet, PreparedClip) {
    sets_of(&small(ComparisonKind::PoseOnly), take)
}

/// Training set and fourth take, with the motion vectors of these settings.
fn sets_of(config: &ComparisonConfig, take: fn(usize) -> Take) -> (TrainingSet, PreparedClip) {
    let splits = [Split::Train, Split::Train, Split::Train, Split::Validation];
    let takes: Vec<_> = splits.iter().enumerate().map(|(i, s)| (take(i), *s)).collect();
    let (_folder, capture) = capture(&takes);
    let mut set = training_set_of(&capture, &spec(config)).unwrap();
    let unseen = set.validation.pop().unwrap();
    (set, unseen)
}

fn trained(set: &TrainingSet, config: ComparisonConfig) -> ComparisonPredictor {
    let trainer = ComparisonTrainer::new(set, &spec(&config), &character().skeleton, config).unwrap();
    trainer.train(&|_, _| Control::Continue).unwrap()
}

fn predicted(predictor: &mut ComparisonPredictor, clip: &PreparedClip, mode: Mode) -> Vec<Vec<Vec3>> {
    predictor.start(clip, mode).unwrap();
    let frame = |t: usize| {
        let mut positions = Vec::new();
        predictor.predict(clip, t, &mut positions).unwrap();
        positions
    };
    (1..clip.len()).map(frame).collect()
}

/// Squared error, as a share of that of the mean displacement of the training clips.
fn error_share(set: &TrainingSet, predictor: &mut ComparisonPredictor, clip: &PreparedClip) -> f32 {
    let mut mean = unic_eval::baselines::Skinning::mean(&garment().into(), set);
    let squares = |positions: &[Vec3], t: usize| -> f32 {
        let truth = clip.captured.garment.frame(t);
        positions
            .iter()
            .zip(truth)
            .map(|(a, b)| a.distance_squared(*b))
            .sum()
    };
    let (mut left, mut all, mut positions) = (0.0, 0.0, Vec::new());
    mean.start(clip, Mode::FreeRunning).unwrap();
    for (i, predicted) in predicted(predictor, clip, Mode::FreeRunning).iter().enumerate() {
        mean.predict(clip, i + 1, &mut positions).unwrap();
        all += squares(&positions, i + 1);
        left += squares(predicted, i + 1);
    }
    left / all
}

#[test]
fn pose_only_learns_a_garment_that_follows_the_pose() {
    let (set, unseen) = sets(posed);
    let mut predictor = trained(&set, small(ComparisonKind::PoseOnly));
    let share = error_share(&set, &mut predictor, &unseen);
    assert!(share < 0.03, "{share}");
}

#[test]
fn pose_only_reads_nothing_but_the_pose_and_the_vertical() {
    let (set, _) = sets(posed);
    let mut predictor = trained(
        &set,
        ComparisonConfig {
            optimiser: OptimiserConfig {
                steps: 30,
                epochs: None,
                ..small(ComparisonKind::PoseOnly).optimiser
            },
            ..small(ComparisonKind::PoseOnly)
        },
    );
    // The same pose turned about the vertical, at another place, in another motion.
    let turn = Quat::from_rotation_y(1.1);
    let moved = |pose: &Pose| {
        let mut pose = pose.clone();
        pose.local[0] = turn * pose.local[0];
        pose.trans = Vec3::new(3.0, 0.4, -2.0) * pose.trans.z;
        pose
    };
    let run = |predictor: &mut ComparisonPredictor, take: Take| -> Vec<Vec<Vec3>> {
        let (_folder, capture) = capture(&[(take, Split::Train)]);
        let clip = training_set(&capture).unwrap().train.remove(0);
        let frames = predicted(predictor, &clip, Mode::FreeRunning);
        // Displacements in the frames of the vertices.
        let displacement = |(i, positions): (usize, &Vec<Vec3>)| {
            let transforms = clip.kinematics.world_from_rest(i + 1);
            let own = |(v, x): (usize, &Vec3)| PointFrame::new(&garment(), v, transforms).displacement(*x);
            positions.iter().enumerate().map(own).collect()
        };
        frames.iter().enumerate().map(displacement).collect()
    };
    let plain = posed(7);
    let mut other = plain.clone();
    other.clip.poses = plain.clip.poses.iter().rev().map(moved).collect();
    let (plain, other) = (run(&mut predictor, plain), run(&mut predictor, other));
    // Frame t of the first clip is frame LENGTH − 1 − t of the second. Both predictions lack frame
    // 0.
    for (a, b) in plain[..LENGTH - 2].iter().zip(other[..LENGTH - 2].iter().rev()) {
        for (a, b) in a.iter().zip(b) {
            assert!(a.distance(*b) < 1e-4, "{a} {b}");
        }
    }
}

#[test]
fn virtual_bones_learn_an_affine_garment_that_follows_recent_motion() {
    let (set, unseen) = sets(dragged);
    let mut predictor = trained(&set, small(ComparisonKind::VirtualBones));
    let share = error_share(&set, &mut predictor, &unseen);
    assert!(share < 0.1, "{share}");
}

#[test]
fn a_diverging_network_stays_finite() {
    let (set, unseen) = sets(dragged);
    let mut config = small(ComparisonKind::GlobalFeature);
    // A learning rate at which the network's own output drives it away.
    config.optimiser.learning_rate = 0.3;
    config.optimiser.steps = 20;
    let mut predictor = trained(&set, config);
    assert_eq!(predictor.modes(), [Mode::OneStep, Mode::FreeRunning]);
    for mode in [Mode::OneStep, Mode::FreeRunning] {
        let frames = predicted(&mut predictor, &unseen, mode);
        assert!(frames.iter().flatten().all(|x| x.is_finite()), "{mode:?}");
    }
}

#[test]
fn one_step_starts_from_the_previous_true_garment() {
    let (set, unseen) = sets(dragged);
    let mut predictor = trained(&set, small(ComparisonKind::GlobalFeature));
    let squares = |frames: &[Vec<Vec3>]| -> f32 {
        let frame = |(i, x): (usize, &Vec<Vec3>)| -> f32 {
            let truth = unseen.captured.garment.frame(i + 1);
            x.iter().zip(truth).map(|(a, b)| a.distance_squared(*b)).sum()
        };
        frames.iter().enumerate().map(frame).sum()
    };
    let [one_step, free] =
        [Mode::OneStep, Mode::FreeRunning].map(|mode| squares(&predicted(&mut predictor, &unseen, mode)));
    assert!(one_step < 0.5 * free, "{one_step} {free}");
}

#[test]
fn root_relative_positions_follow_a_character_that_travels() {
    let mut config = small(ComparisonKind::GlobalFeature);
    config.layout = MotionLayout::Paper;
    config.velocity = VelocityScheme::Forward;
    config.surface = SurfaceKind::RootRelative;
    let (set, unseen) = sets_of(&config, dragged);
    let mut predictor = trained(&set, config);
    let centre = |positions: &[Vec3]| positions.iter().sum::<Vec3>() / positions.len() as f32;
    let (mut farthest, mut travelled) = (0f32, 0f32);
    let frames = predicted(&mut predictor, &unseen, Mode::FreeRunning);
    for (i, predicted) in frames.iter().enumerate() {
        let truth = centre(unseen.captured.garment.frame(i + 1));
        farthest = farthest.max(centre(predicted).distance(truth));
        travelled = travelled.max(truth.distance(centre(unseen.captured.garment.frame(0))));
    }
    assert!(
        farthest < 0.05 && travelled > 0.3,
        "{farthest} m off, {travelled} m travelled"
    );
}

#[test]
fn unsupported_settings_are_refused() {
    let (set, _) = sets(posed);
    let refused = |change: fn(&mut ComparisonConfig)| {
        let mut config = small(ComparisonKind::GlobalFeature);
        change(&mut config);
        let spec = spec(&small(ComparisonKind::GlobalFeature));
        let trainer = ComparisonTrainer::new(&set, &spec, &character().skeleton, config);
        trainer.err().unwrap().to_string()
    };
    for (change, message) in [
        (
            (|c| c.optimiser.epochs = Some(3)) as fn(&mut ComparisonConfig),
            "optimiser.epochs",
        ),
        (|c| c.optimiser.products = Products::Bf16, "optimiser.products"),
        (
            |c| c.global_feature.as_mut().unwrap().encoder.code = LatentCode::OneHot,
            "encoder.code",
        ),
        (
            |c| (c.layout, c.reads) = (MotionLayout::Paper, MotionElements::Pose),
            "layout",
        ),
        (|c| c.layout = MotionLayout::Paper, "expected motion vectors with"),
    ] {
        let error = refused(change);
        assert!(error.contains(message), "{message}: {error}");
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    for kind in [
        ComparisonKind::PoseOnly,
        ComparisonKind::VirtualBones,
        ComparisonKind::GlobalFeature,
    ] {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap().install(|| {
                let (set, unseen) = sets(dragged);
                let mut config = small(kind);
                config.dropout = 0.3;
                config.optimiser.steps = 10;
                predicted(&mut trained(&set, config), &unseen, Mode::FreeRunning)
            })
        };
        assert!(run(1) == run(3), "{kind:?}");
    }
}

#[test]
fn a_callback_stops_the_training() {
    let (set, _) = sets(posed);
    let config = small(ComparisonKind::PoseOnly);
    let trainer = ComparisonTrainer::new(&set, &spec(&config), &character().skeleton, config).unwrap();
    let stopped = trainer.train(&|done, _| {
        if done == 3 {
            Control::Stop
        } else {
            Control::Continue
        }
    });
    assert!(matches!(stopped, Err(TrainError::Stopped)));
}
