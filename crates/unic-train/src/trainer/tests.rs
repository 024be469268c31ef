//! Contract: the bending of the strain projection is that with which the garment bends most like the
//! truth over several motions, each predicted by a prior that has not seen it; they choose the factor
//! of the replay, too. Chords that they choose reach the model.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

use super::Trainer;
use crate::{
    Control, Fit, Preset, SkinningSource, StateSettings, TrainConfig,
    config::Refit,
    error::TrainError,
    field_data::FieldData,
    validation::{Chosen, Measured, ShownTrial},
};
use glam::Vec3;
use std::{
    f32::consts::TAU,
    iter::zip,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
};
use unic_core::{
    Animator, IntersectionMode, Model, Start, StepInput, character::Garment, mesh::TriMesh,
    model::ModelParts, projection::welded_edges, skinning::SkinningWeights,
};
use unic_eval::{BendingRatio, PreparedClip};
use unic_io::Split;
use unic_testdata::{Figure, Take, capture, take};

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
fn a_validation_is_the_same_on_any_number_of_threads() {
    let validation = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let validation = || replaying(5).validation(&|| Control::Continue).unwrap().unwrap();
        pool.unwrap().install(validation)
    };
    let one = validation(1);
    assert!(one.trials.len() > 3, "{one:?}");
    for threads in [2, 8] {
        assert_eq!(validation(threads), one, "{threads} threads");
    }
}

#[test]
fn an_answer_to_stop_ends_all_motions_left_out() {
    let trainer = replaying(5);
    let count = AtomicU64::new(0);
    let asked = |stop_at: u64| {
        count.store(0, Ordering::Relaxed);
        let ask = || match count.fetch_add(1, Ordering::Relaxed) == stop_at {
            true => Control::Stop,
            false => Control::Continue,
        };
        let validation = trainer.validation(&ask);
        (validation, count.load(Ordering::Relaxed))
    };
    let (validation, all) = asked(u64::MAX);
    assert!(validation.is_ok() && all <= trainer.most_validation_frames());
    // In the middle the shown cloth is judged.
    let (stopped, frames) = asked(all / 2);
    assert!(matches!(stopped, Err(TrainError::Stopped)), "{stopped:?}");
    let on_their_way = rayon::current_num_threads() as u64;
    assert!(frames <= all / 2 + 1 + on_their_way, "{frames} of {all}");
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

/// Trainer of a wide skirt of 2,304 vertices around a column, which shrinks and grows.
fn hanging() -> Trainer {
    let (sides, rings) = (96u32, 24u32);
    let mut figure = Figure::tube();
    let place = |i: u32| {
        let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        Vec3::new(0.25 * sin, 0.5 + 0.01 * (i / sides) as f32, 0.25 * cos)
    };
    let quad = |i: u32| {
        let (ring, side) = (i / sides * sides, i % sides);
        let [a, b] = [ring + side, ring + (side + 1) % sides];
        [[a, b, b + sides], [a, b + sides, a + sides]]
    };
    let (vertices, faces) = (
        (0..sides * rings).map(place),
        (0..sides * (rings - 1)).flat_map(quad),
    );
    let rest = TriMesh::new(vertices.collect(), faces.collect()).unwrap();
    let hip = |vertices: usize| [1.0, 0.0, 0.0, 0.0, 0.0, 0.0].repeat(vertices);
    let weights = SkinningWeights::from_dense(&hip(rest.vertices.len()), rest.vertices.len(), 6).unwrap();
    figure.garment = Garment::new(rest, weights);
    let take = |i: usize| {
        let Take { clip, .. } = take(&format!("take{i}"), i, 24);
        let mut garment = figure.skinned(&clip);
        for (t, frame) in garment.iter_mut().enumerate() {
            let centre = frame.iter().sum::<Vec3>() / frame.len() as f32;
            let scale = 1.0 + 0.03 * ((t + i) as f32).sin();
            frame.iter_mut().for_each(|p| *p = centre + scale * (*p - centre));
        }
        (Take { clip, garment }, Split::Train)
    };
    let takes: Vec<_> = (0..3).map(take).collect();
    let (_folder, capture) = capture(&figure, &takes);
    let config = settings();
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    Trainer::new(data, config).unwrap()
}

#[test]
fn chosen_chords_reach_the_model() {
    let mut trainer = hanging();
    let limits = |chord_deviations| {
        let chosen = Chosen {
            chord_deviations,
            ..Chosen::SETTINGS
        };
        let model = trainer.model_of(&trainer.learner.kept(), chosen).unwrap();
        model.to_parts().strain_limits
    };
    let (short, long) = (limits(Some(1.5)), limits(Some(0.0)));
    assert_eq!(short, limits(None), "the first of the settings");
    let edges = welded_edges(&trainer.data().capture.garment.rest).len();
    assert_eq!(short[..edges], long[..edges]);
    let longer = zip(&short, &long).filter(|(short, long)| long.shortest > short.shortest);
    assert!(longer.count() > 100);

    let mut validation = trainer.validation(&|| Control::Continue).unwrap().unwrap();
    assert!(validation.chord_deviations.is_some());
    let bends = |trial: &&ShownTrial| matches!(trial.measured, Measured::Bending { .. });
    let bends: Vec<_> = validation.trials.iter().filter(bends).collect();
    for (i, trial) in bends.iter().enumerate() {
        let is_again = bends[..i]
            .iter()
            .any(|earlier| earlier.chosen.shows_as(&trial.chosen));
        assert!(!is_again, "tried twice: {trial}");
    }
    // The bending is chosen with the shortest chords.
    assert_eq!(bends[0].chosen.chord_deviations, Some(1.5));
    assert_eq!(bends[0].chosen.bending, Some(BENDINGS[0]));
    validation.chord_deviations = Some(0.0);
    trainer.set_validation(validation);
    assert_eq!(trainer.model().unwrap().to_parts().strain_limits, long);
    // The fit on all clips has measured lengths of its own.
    let config = trainer.config().clone();
    let data = trainer.into_data().on_all_clips().unwrap();
    let all = Trainer::new(data, config).unwrap().model().unwrap();
    let all = all.to_parts().strain_limits;
    assert!(all.len() == short.len() && all != short && all != long);
}

#[test]
fn a_garment_without_chords_has_none_to_choose() {
    let validation = trainer(3).validation(&|| Control::Continue).unwrap().unwrap();
    assert!(validation.bending.is_some());
    assert_eq!(validation.chord_deviations, None);
}
