//! Contract: a model feels the wind of a capture's clips as it feels motion through the air, and
//! still air changes no byte, recorded or not.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Start, StepInput, clip::Clip};
use unic_io::{Capture, CaptureWriter, Manifest, Split, capture::JointReference};
use unic_train::*;

/// World, m/s: gusts that differ from clip to clip.
fn gust(clip: usize, t: usize) -> Vec3 {
    let time = t as f32 / FPS + 1.7 * clip as f32;
    Vec3::new(2.0 * (1.3 * time).sin(), 0.0, 2.0 * (0.9 * time).cos())
}

/// The garment swings after its way through the air: as in still air that stands while the ground
/// moves.
fn in_air(clip: Clip) -> Take {
    let way = |t: usize| -> Vec3 { clip.wind.iter().take(t + 1).map(|wind| *wind / FPS).sum() };
    let mut carried = clip.clone();
    for (t, pose) in carried.poses.iter_mut().enumerate() {
        pose.trans -= way(t);
    }
    let mut garment = Figure::tube().swung(carried).garment;
    for (t, frame) in garment.iter_mut().enumerate() {
        frame.iter_mut().for_each(|x| *x += way(t));
    }
    Take { clip, garment }
}

/// Air as clips record it.
#[derive(Clone, Copy, PartialEq)]
enum Air {
    Gusts,
    RecordedStill,
    Still,
}

fn windy_capture(air: Air) -> (tempfile::TempDir, Capture) {
    let splits = [
        Split::Train,
        Split::Train,
        Split::Train,
        Split::Train,
        Split::Validation,
    ];
    let clips = splits.into_iter().enumerate().map(|(i, split)| {
        let mut clip = clip(&format!("take{i}"), i, 4 * FRAMES);
        clip.wind = match air {
            Air::Gusts => (0..clip.len()).map(|t| gust(i, t)).collect(),
            Air::RecordedStill => vec![Vec3::ZERO; clip.len()],
            Air::Still => Vec::new(),
        };
        (clip, split)
    });
    written(clips)
}

fn written(clips: impl Iterator<Item = (Clip, Split)>) -> (tempfile::TempDir, Capture) {
    let folder = tempfile::tempdir().unwrap();
    let (root, figure) = (folder.path().join("tube"), Figure::tube());
    let mut manifest = Manifest::new("tube", FPS);
    manifest.contact_joints = Some(figure.contact_joints.map(JointReference::Index));
    let (character, garment) = (&figure.character, &figure.garment);
    let mut writer = CaptureWriter::create(&root, manifest, character, garment, &Default::default()).unwrap();
    for (clip, split) in clips {
        let take = in_air(clip);
        let mut out = writer.begin_clip(&take.clip, split).unwrap();
        take.garment.iter().for_each(|frame| out.push(frame).unwrap());
        out.finish().unwrap();
    }
    writer.finish().unwrap();
    let capture = Capture::open(&root).unwrap();
    (folder, capture)
}

fn trained(air: Air) -> (Trainer, Arc<Model>) {
    let (_folder, capture) = windy_capture(air);
    let mut config = small(Preset::Tiny);
    config.optimiser.steps = 20;
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    let mut trainer = Trainer::new(data, config).unwrap();
    run(&mut trainer);
    let model = trainer.model().unwrap();
    (trainer, Arc::new(model))
}

/// Root mean square error over the clip held out, metres.
fn error(trainer: &Trainer, model: &Arc<Model>, factor: f32) -> f32 {
    let captured = &trainer.data().validation[0].captured;
    let input = |t: usize| StepInput {
        pose: &captured.clip.poses[t],
        next_pose: None,
        ground_height: 0.0,
        wind: captured.clip.wind_at(t) * factor,
    };
    let mut animator = Animator::new(Arc::clone(model));
    animator
        .reset(&input(0), Start::Positions(captured.garment.frame(0)))
        .unwrap();
    let (mut sum, mut count) = (0.0, 0);
    for t in 1..captured.clip.len() {
        let found = animator.step(&input(t)).unwrap().positions;
        let errors = found.iter().zip(captured.garment.frame(t));
        sum += errors.map(|(a, b)| a.distance_squared(*b)).sum::<f32>();
        count += found.len();
    }
    (sum / count as f32).sqrt()
}

#[test]
fn model_reproduces_the_wind_of_its_training() {
    let (trainer, model) = trained(Air::Gusts);
    let read = Arc::new(Model::from_bytes(&model.to_bytes().unwrap()).unwrap());
    let [with, without] = [1.0, 0.0].map(|factor| error(&trainer, &read, factor));
    assert!(
        with < 0.6 * without,
        "{with} m in the wind, {without} m in still air"
    );
    let rmse_mm = trainer
        .validation(&|| Control::Continue)
        .unwrap()
        .unwrap()
        .rmse_mm;
    assert!(
        (rmse_mm - 1e3 * f64::from(with)).abs() < 0.1,
        "validation error {rmse_mm} mm"
    );
}

#[test]
fn still_air_changes_no_byte() {
    let bytes = |air| {
        let mut parts = trained(air).1.to_parts();
        parts.about.training = serde_json::Value::Null;
        Model::new(parts).unwrap().to_bytes().unwrap()
    };
    assert!(bytes(Air::RecordedStill) == bytes(Air::Still));
}

/// Names of clips.
fn names(clips: &[unic_eval::PreparedClip]) -> Vec<&str> {
    clips.iter().map(unic_eval::PreparedClip::name).collect()
}

#[test]
fn motion_is_held_out_in_every_wind_and_restored_in_place() {
    // Clips 0 and 2 are one motion in two winds.
    let clips = [0, 1, 0, 2].into_iter().enumerate().map(|(i, motion)| {
        let mut clip = clip(&format!("take{i}"), motion, 4 * FRAMES);
        clip.wind = (0..clip.len()).map(|t| gust(i, t)).collect();
        (clip, Split::Train)
    });
    let (_folder, capture) = written(clips);
    let mut config = small(Preset::Tiny);
    config.validation.refit = Refit::AllClips;
    let mut left = std::collections::BTreeSet::new();
    for seed in 1..=6 {
        config.seed = seed;
        let held_out = FieldData::prepare(capture.clone(), &config, Fit::HeldOut).unwrap();
        let expected = match names(&held_out.validation)[0] {
            "take1" => vec!["take0", "take2", "take3"],
            "take3" => vec!["take0", "take1", "take2"],
            _ => vec!["take1", "take3"],
        };
        assert_eq!(names(&held_out.clips), expected);
        left.insert(expected.len());
        let all = FieldData::prepare(capture.clone(), &config, Fit::AllClips).unwrap();
        let back = held_out.on_all_clips().unwrap();
        assert_eq!(names(&back.clips), names(&all.clips));
        assert_eq!(back.coefficients, all.coefficients);
        for (back, all) in back.motion.iter().zip(&all.motion) {
            assert_eq!(back.frame(7, View::Direct), all.frame(7, View::Direct));
        }
    }
    assert_eq!(left.len(), 2, "seeds draw both kinds");
}
