//! Contract: on a small capture on disk, predictors that must be exact are; results have the same
//! bytes for any number of threads; handled predictors are moved as an animator's positions are;
//! errors name predictor and clip.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

use glam::{Quat, Vec3};
use std::path::Path;
use unic_core::{
    Corrects, IntersectionMode, Pose,
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_eval::{
    Error, Evaluation, Event, HandledPredictor, IntersectionHandler, Mode, NamedPredictor, Predictor,
    PredictorError, PreparedClip, baselines, evaluate, training_set,
};
use unic_io::{Capture, Split};
use unic_testdata::{Figure, Take};

/// Motion of the garment: rigid with its joints, or swinging in addition.
#[derive(Clone, Copy)]
enum Motion {
    Rigid,
    Swinging,
}

/// Tetrahedron in a strip that follows its root alone, so that every baseline can be exact.
fn figure() -> Figure {
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let skeleton = Skeleton::new(SkeletonParts {
        names: vec!["hip".into(), "foot".into()],
        parents: vec![-1, 0],
        joints: vec![Vec3::ZERO, Vec3::NEG_Y],
        ..SkeletonParts::default()
    });
    let root_alone =
        |vertices: usize| SkinningWeights::from_dense(&[1.0, 0.0].repeat(vertices), vertices, 2).unwrap();
    let strip = (0..8)
        .map(|i| Vec3::new((i % 2) as f32, 2.0, (i / 2) as f32 * 0.5))
        .collect();
    let squares = (0..3).flat_map(|r| [[2 * r, 2 * r + 2, 2 * r + 1], [2 * r + 1, 2 * r + 2, 2 * r + 3]]);
    Figure {
        character: Character {
            body: TriMesh::new(corners, faces).unwrap(),
            skeleton: skeleton.unwrap(),
            weights: root_alone(4),
            file_mesh: None,
        },
        garment: Garment::new(TriMesh::new(strip, squares.collect()).unwrap(), root_alone(8)),
        contact_joints: [1; 4],
    }
}

fn clip(name: &str, seed: usize) -> Clip {
    let pose = |t: usize| {
        let t = (t + 13 * seed) as f32;
        Pose {
            trans: Vec3::new(0.02 * t, 0.0, (0.1 * t).sin()),
            local: vec![
                Quat::from_rotation_y(0.05 * t),
                Quat::from_rotation_x((0.3 * t).sin()),
            ],
        }
    };
    Clip {
        name: name.into(),
        fps: 30.0,
        poses: (0..70).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

fn write_capture(folder: &Path, motion: Motion) -> Capture {
    let figure = figure();
    let splits = [
        ("a", Split::Train),
        ("b", Split::Train),
        ("c", Split::Test),
        ("d", Split::Test),
    ];
    let take = |(seed, (name, split)): (usize, (&str, Split))| {
        let clip = clip(name, seed);
        let mut garment = figure.skinned(&clip);
        if let Motion::Swinging = motion {
            for (positions, pose) in garment.iter_mut().zip(&clip.poses) {
                let swing = pose.local[1].to_scaled_axis().x;
                let offset = pose.local[0] * Vec3::Z * 0.1 * swing;
                positions.iter_mut().for_each(|p| *p += offset);
            }
        }
        (Take { clip, garment }, split)
    };
    let takes: Vec<_> = splits.into_iter().enumerate().map(take).collect();
    unic_testdata::write_capture(&folder.join("small"), &figure, &takes)
}

fn evaluation(capture: &Capture) -> Evaluation {
    let mut predictors = baselines::fit(&training_set(capture).unwrap());
    let clips = capture.clip_names(Split::Test).to_vec();
    evaluate(capture, &mut predictors, &clips, &mut |_| Ok(())).unwrap()
}

fn rmse(evaluation: &Evaluation, row: &str) -> f64 {
    let by_mode = &evaluation.pooled.baselines[row];
    by_mode
        .free_running
        .as_ref()
        .or(by_mode.one_step.as_ref())
        .unwrap()
        .rmse_mm
}

#[test]
fn a_rigid_garment_is_exact_for_every_baseline() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Rigid);
    let evaluation = evaluation(&capture);
    let names: Vec<_> = evaluation.pooled.baselines.keys().map(String::as_str).collect();
    let expected = "hold mean_shape skinning skinning_mean skinning_first ridge linear_dynamics";
    assert_eq!(names.join(" "), expected);
    for name in names {
        assert!(
            rmse(&evaluation, name) < 1e-2,
            "{name}: {} mm",
            rmse(&evaluation, name)
        );
    }
    assert_eq!(evaluation.clips.keys().collect::<Vec<_>>(), ["c", "d"]);
}

#[test]
fn regressions_learn_a_displacement_that_follows_the_pose() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Swinging);
    let evaluation = evaluation(&capture);
    assert!(rmse(&evaluation, "skinning_mean") > 50.0);
    assert!(rmse(&evaluation, "ridge") < 10.0, "{evaluation}");
    assert!(rmse(&evaluation, "linear_dynamics") < 10.0, "{evaluation}");
}

#[test]
fn results_have_the_same_bytes_for_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Swinging);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| serde_json::to_string(&evaluation(&capture)).unwrap())
    };
    let one = with(1);
    assert!(
        one.starts_with("{\"baselines\":{\"hold\":{\"one_step\":{\"rmse_mm\":"),
        "{one}"
    );
    assert!(one.contains("\"bands\":[") && one.contains("\"judge_accuracy_percent\":null"));
    assert_eq!(one, with(2));
    assert_eq!(one, with(4));
    assert_eq!(one, with(5));
}

/// Predicts the truth as far as it may read it, and fails on demand.
struct Truth {
    fails_at: Option<usize>,
    vertices: usize,
}

impl Predictor for Truth {
    fn modes(&self) -> &[Mode] {
        &[Mode::OneStep, Mode::FreeRunning]
    }

    fn start(&mut self, _: &PreparedClip, _: Mode) -> Result<(), PredictorError> {
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        if self.fails_at == Some(frame) {
            return Err("out of cloth".into());
        }
        positions.clear();
        positions.extend_from_slice(&clip.captured.garment.frame(frame)[..self.vertices]);
        Ok(())
    }
}

fn run_truth(capture: &Capture, truth: Truth, seen: &mut Vec<usize>) -> unic_eval::Result<Evaluation> {
    let clips = capture.clip_names(Split::Test).to_vec();
    let mut observe = |event: &Event| {
        if let Event::Predicted {
            mode: Mode::FreeRunning,
            frame,
            ..
        } = event
        {
            seen.push(*frame);
        }
        Ok(())
    };
    evaluate(capture, &mut [NamedPredictor::model(truth)], &clips, &mut observe)
}

#[test]
fn a_perfect_model_has_no_error_and_the_jitter_of_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Swinging);
    let mut seen = Vec::new();
    let truth = Truth {
        fails_at: None,
        vertices: 8,
    };
    let model = run_truth(&capture, truth, &mut seen)
        .unwrap()
        .pooled
        .model
        .unwrap();
    for metrics in [model.one_step.unwrap(), model.free_running.unwrap()] {
        assert_eq!((metrics.rmse_mm, metrics.hausdorff_mm), (0.0, 0.0));
        assert_eq!(
            (metrics.jitter_ratio, metrics.edge_length_error_percent),
            (1.0, 0.0)
        );
        // Measures of life are of free running alone.
        assert!(metrics.bands.iter().all(|band| band.living_ratio == 1.0));
        assert!([None, Some(1.0)].contains(&metrics.popping_ratio));
        assert_eq!(metrics.bands.is_empty(), metrics.popping_ratio.is_none());
    }
    assert_eq!(seen, [(1..70).collect::<Vec<_>>(), (1..70).collect()].concat());
}

#[test]
fn errors_name_the_predictor_and_the_clip() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Rigid);
    let run = |fails_at, vertices| {
        run_truth(&capture, Truth { fails_at, vertices }, &mut Vec::new())
            .unwrap_err()
            .to_string()
    };
    assert_eq!(run(Some(40), 8), "model on clip c: out of cloth");
    assert_eq!(
        run(None, 5),
        "model on clip c: expected 8 garment vertices, found 5"
    );
    let none = evaluate(&capture, &mut [], &[], &mut |_| Ok(()));
    assert!(matches!(none, Err(Error::NoClips { .. })));
}

/// Predicts every vertex at one place, which moves with the root as the body does.
struct At(Vec3);

impl Predictor for At {
    fn modes(&self) -> &[Mode] {
        &[Mode::FreeRunning]
    }

    fn start(&mut self, _: &PreparedClip, _: Mode) -> Result<(), PredictorError> {
        Ok(())
    }

    fn predict(
        &mut self,
        clip: &PreparedClip,
        frame: usize,
        positions: &mut Vec<Vec3>,
    ) -> Result<(), PredictorError> {
        let place = clip.kinematics.world_from_rest(frame)[0].point(self.0);
        *positions = vec![place; 8];
        Ok(())
    }
}

#[test]
fn handling_moves_only_vertices_inside_the_body() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Rigid);
    let clips = capture.clip_names(Split::Test).to_vec();
    let modes = [Corrects::State, Corrects::Display].map(|corrects| IntersectionMode::Robust {
        margin_m: 0.003,
        corrects,
    });
    for mode in modes
        .into_iter()
        .chain([IntersectionMode::Paper { relaxation_m: 0.003 }])
    {
        let handler = || IntersectionHandler::new(mode, &capture.character, &capture.garment).unwrap();
        let (inside, outside) = (Vec3::new(0.2, 0.2, 0.001), Vec3::new(5.0, 5.0, 5.0));
        let mut predictors = [
            NamedPredictor::baseline("inside", At(inside)),
            NamedPredictor::baseline("inside_handled", HandledPredictor::new(At(inside), handler())),
            NamedPredictor::baseline("outside", At(outside)),
            NamedPredictor::baseline("outside_handled", HandledPredictor::new(At(outside), handler())),
        ];
        let evaluation = evaluate(&capture, &mut predictors, &clips, &mut |_| Ok(())).unwrap();
        let metrics = |row: &str| evaluation.pooled.baselines[row].free_running.clone().unwrap();
        assert_eq!(metrics("inside").intersecting_vertices_percent_closest, 100.0);
        assert_eq!(
            metrics("inside_handled").intersecting_vertices_percent_closest,
            0.0,
            "{mode:?}"
        );
        assert_eq!(metrics("outside"), metrics("outside_handled"), "{mode:?}");
    }
    assert!(IntersectionHandler::new(IntersectionMode::Off, &capture.character, &capture.garment).is_none());
}

#[test]
fn ridge_handled_is_fitted_where_there_is_a_handler() {
    let folder = tempfile::tempdir().unwrap();
    let capture = write_capture(folder.path(), Motion::Swinging);
    let set = training_set(&capture).unwrap();
    let mode = IntersectionMode::Robust {
        margin_m: IntersectionMode::MARGIN_M,
        corrects: Corrects::Display,
    };
    let handler = IntersectionHandler::new(mode, &capture.character, &capture.garment);
    let predictors = baselines::fit_with(&set, handler);
    let names: Vec<&str> = predictors.iter().map(|named| named.name.as_str()).collect();
    assert_eq!(
        names.join(" "),
        "hold mean_shape skinning skinning_mean skinning_first ridge ridge_handled linear_dynamics"
    );
}
