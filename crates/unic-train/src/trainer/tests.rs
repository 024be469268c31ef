//! Contract: the bending of the strain projection is that with which the garment bends most like the
//! truth over several motions, each predicted by a prior that has not seen it; they choose the factor
//! of the replay, too.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use super::Trainer;
use crate::{
    Control, Fit, Preset, SkinningSource, StateSettings, TrainConfig, config::Refit, field_data::FieldData,
    validation::Chosen,
};
use std::sync::Arc;
use unic_core::{Animator, IntersectionMode, Model, Start, StepInput, model::ModelParts};
use unic_eval::{BendingRatio, PreparedClip};
use unic_io::Split;
use unic_testdata::{Figure, capture, take};

/// Two values between which the motions are at odds.
const BENDINGS: [f32; 2] = [0.0178, 0.0223];

fn settings() -> TrainConfig {
    let mut config = TrainConfig::preset(Preset::Tiny);
    if let StateSettings::Displacement {
        skinning,
        prior_shapes,
        recurrence,
        ..
    } = &mut config.model.state
    {
        (*skinning, *prior_shapes, *recurrence) = (SkinningSource::Given, 3, None);
    }
    config.set_steps(6);
    config.validation.refit = Refit::AllClips;
    config.intersection.at_inference = false;
    config.projection.at_inference = true;
    config.projection.bending = BENDINGS.to_vec();
    config.sizing.sizes = Vec::new();
    config
}

/// Trainer of a capture with so many training clips of different motion.
fn trainer(clips: usize) -> Trainer {
    let config = settings();
    let take = |i: usize| (take(&format!("take{i}"), i, 24), Split::Train);
    let takes: Vec<_> = (0..clips).map(take).collect();
    let (_folder, capture) = capture(&Figure::tube(), &takes);
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    Trainer::new(data, config).unwrap()
}

/// Adds the bending of a model on a clip.
fn add(ratio: &mut BendingRatio, model: Model, clip: &PreparedClip) {
    let (motion, garment) = (&clip.captured.clip, &clip.captured.garment);
    let every = (model.config().fps / 10.0).round() as usize;
    let mut animator = Animator::new(Arc::new(model));
    animator.set_intersection(IntersectionMode::Off);
    let start = Start::Positions(garment.frame(0));
    animator.reset(&StepInput::of_clip(motion, 0), start).unwrap();
    for t in 1..garment.len() {
        let shown = animator.step(&StepInput::of_clip(motion, t)).unwrap().positions;
        if t % every == 0 {
            ratio.add(shown, garment.frame(t));
        }
    }
}

#[test]
fn several_motions_choose_the_bending() {
    let trainer = trainer(4);
    let data = trainer.data();
    let drawn = data.validation[0].name();
    let mut names: Vec<&str> = data.judges.iter().map(|judge| &judge.clip[..]).collect();
    names.push(drawn);
    names.sort_unstable();
    assert_eq!(names, ["take0", "take1", "take2", "take3"]);
    let models = |bending: f32| {
        let chosen = Chosen {
            bending: Some(bending),
            ..Chosen::SETTINGS
        };
        let model = trainer.model_of(&trainer.learner.kept(), chosen).unwrap();
        let others = data.judges.iter().map(|judge| {
            assert!(judge.prior != data.prior, "{}", judge.clip);
            let parts = ModelParts {
                prior: judge.prior.clone(),
                ..model.to_parts()
            };
            let clip = data.clips.iter().find(|clip| clip.name() == judge.clip);
            (Model::new(parts).unwrap(), clip.unwrap())
        });
        let others: Vec<_> = others.collect();
        std::iter::once((model, &data.validation[0])).chain(others)
    };
    // Logarithm of the bending by the truth's, on the first motions.
    let excess = |bending: f32, motions: usize| {
        let mut ratio = BendingRatio::new(&data.capture.garment.rest);
        models(bending)
            .take(motions)
            .for_each(|(model, clip)| add(&mut ratio, model, clip));
        ratio.ratio().unwrap().ln()
    };
    let nearest = |motions: usize| {
        let errors = BENDINGS.map(|bending| (excess(bending, motions).abs(), bending));
        errors.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).unwrap().1
    };
    let validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
    assert_eq!(validation.bending, Some(nearest(4)));
    // One motion alone would choose another.
    let excesses = BENDINGS.map(|bending| [1, 4].map(|motions| excess(bending, motions)));
    assert!(nearest(1) != nearest(4), "{excesses:?}");
}

/// Trainer of a capture with so many clips, whose wrinkles are too lively at first.
fn replaying(clips: usize) -> Trainer {
    let mut config = settings();
    config.replay.at_inference = true;
    config.replay.deviation = 1.5;
    let take = |i: usize| (take(&format!("take{i}"), i, 150), Split::Train);
    let takes: Vec<_> = (0..clips).map(take).collect();
    let (_folder, capture) = capture(&Figure::tube(), &takes);
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    Trainer::new(data, config).unwrap()
}

#[test]
fn motions_left_out_choose_the_factor_of_the_replay() {
    let mut trainer = replaying(5);
    let scales = |model: &Model| model.prior().replay.as_ref().unwrap().library().scales().to_vec();
    let before = scales(&trainer.model().unwrap());
    assert!(before.iter().any(|scale| *scale > 0.0));
    let validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
    let factor = validation.replay_factor.unwrap();
    assert!((0.5..1.0).contains(&factor), "{factor}");
    trainer.set_validation(validation);
    let after = scales(&trainer.model().unwrap());
    for (after, before) in after.iter().zip(before) {
        assert_eq!(*after, factor * before);
    }
}

#[test]
fn few_motions_do_not_judge_wrinkles_nor_a_lone_clip_those_that_are_its_own() {
    for clips in [1, 4] {
        let trainer = replaying(clips);
        assert!(trainer.data().prior.replay.is_some());
        let validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
        assert_eq!(validation.replay_factor, None, "{clips} clips");
    }
}

#[test]
fn more_motions_than_needed_are_thinned_out_evenly() {
    let trainer = trainer(12);
    let judges: Vec<&str> = trainer
        .data()
        .judges
        .iter()
        .map(|judge| &judge.clip[..])
        .collect();
    let drawn = trainer.data().validation[0].name();
    let names: Vec<String> = (0..12).map(|i| format!("take{i}")).collect();
    let others: Vec<&str> = names
        .iter()
        .map(|name| &name[..])
        .filter(|name| *name != drawn)
        .collect();
    // The middles of five parts of eleven motions.
    assert_eq!(judges, [1, 3, 5, 7, 9].map(|i| others[i]));
}

#[test]
fn a_lone_motion_judges_nothing_that_was_fitted_to_it() {
    assert!(trainer(1).data().judges.is_empty());
}
