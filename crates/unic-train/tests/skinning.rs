//! Contract: fitted skinning weights are those that the captured garment moves with, as far as its
//! motion shows them, and everything that the capture has fixed stays.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use unic_core::{
    Model, character::Garment, intersection::ContactFilter, skinning::SkinningWeights, transform::Rigid,
};
use unic_io::Split;
use unic_train::*;

const JOINTS: usize = 6;
/// Number of vertices of a ring of the tube.
const RING: usize = 12;

/// Settings of a model whose weights come from `source`.
fn settings(source: SkinningSource) -> TrainConfig {
    let mut config = small(Preset::Tiny);
    match &mut config.model.state {
        StateSettings::Displacement { skinning, .. } => *skinning = source,
        other => panic!("a state without skinning: {other:?}"),
    }
    config
}

/// Figure whose garment moves with its own weights and comes with others: those of the hip flow
/// into the chest, and those of the chest into the left arm more than into the right one.
fn misbound() -> (Figure, Vec<(Take, Split)>) {
    let mut figure = Figure::tube();
    let skinned = takes().into_iter().map(|(take, split)| {
        let garment = figure.skinned(&take.clip);
        (Take { garment, ..take }, split)
    });
    let takes = skinned.collect();
    let given = figure.garment.weights.to_dense();
    let wrong = given.chunks_exact(JOINTS).flat_map(|w| {
        let (hip, chest) = (0.6 * w[0], 0.4 * w[0] + 0.5 * w[1]);
        let [left, right] = [0.3, 0.2].map(|part| part * w[1]);
        [hip, chest, w[2] + left, w[3] + right, w[4], w[5]]
    });
    let wrong: Vec<f32> = wrong.collect();
    figure.garment.weights = SkinningWeights::from_dense(&wrong, VERTICES, JOINTS).unwrap();
    (figure, takes)
}

fn dataset_with(figure: &Figure, takes: &[(Take, Split)], source: SkinningSource) -> Dataset {
    let (_folder, capture) = unic_testdata::capture(figure, takes);
    Dataset::load(capture, &settings(source), Fit::HeldOut).unwrap()
}

/// Garment with fitted weights.
fn fitted(figure: &Figure, takes: &[(Take, Split)]) -> Garment {
    dataset_with(figure, takes, SkinningSource::Fitted)
        .capture
        .garment
}

/// Model with fitted weights.
fn model(figure: &Figure, takes: &[(Take, Split)]) -> Model {
    let (_folder, capture) = unic_testdata::capture(figure, takes);
    let config = settings(SkinningSource::Fitted);
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    Trainer::new(data, config).unwrap().model().unwrap()
}

/// Weights with those of the hip on the chest.
fn moved_to_chest(weights: &SkinningWeights) -> SkinningWeights {
    let dense = weights.to_dense();
    let rows = dense.chunks_exact(JOINTS);
    let moved = rows.flat_map(|w| [0.0, w[0] + w[1], w[2], w[3], w[4], w[5]]);
    let moved: Vec<f32> = moved.collect();
    SkinningWeights::from_dense(&moved, weights.len(), JOINTS).unwrap()
}

/// RMS distance of the skinned rest shape from what clips show that the fit has not seen, metres.
fn error_m(data: &Dataset, garment: &Garment) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    let mut shown = Vec::new();
    for clip in &data.validation {
        for t in 0..clip.len() {
            let world_from_rest: &[Rigid] = clip.kinematics.world_from_rest(t);
            garment
                .weights
                .skin(&garment.rest.vertices, world_from_rest, &mut shown);
            let truth: &[Vec3] = clip.captured.garment.frame(t);
            sum += shown
                .iter()
                .zip(truth)
                .map(|(a, b)| a.distance_squared(*b))
                .sum::<f32>();
            count += truth.len();
        }
    }
    (sum / count as f32).sqrt()
}

#[test]
fn weights_that_the_garment_moves_with_are_found() {
    let (figure, takes) = misbound();
    let sources = [SkinningSource::Given, SkinningSource::Fitted];
    let [given, fitted] = sources.map(|source| dataset_with(&figure, &takes, source));
    assert_eq!(given.capture.garment.weights, figure.garment.weights);
    let [before, after] = [&given, &fitted].map(|data| error_m(data, &data.capture.garment));
    assert!(
        before > 0.005,
        "weights that are hardly wrong test nothing: {before} m"
    );
    assert!(after < 0.35 * before, "{before} m, then {after} m");
}

#[test]
fn given_weights_stay_as_carriers() {
    let (figure, takes) = misbound();
    let garment = fitted(&figure, &takes);
    assert_eq!(garment.carriers(), &figure.garment.weights);
    assert_ne!(garment.carriers(), &garment.weights);
}

/// Sum of the weights of the hip.
fn hip(weights: &SkinningWeights) -> f32 {
    weights.to_dense().chunks_exact(JOINTS).map(|row| row[0]).sum()
}

#[test]
fn vertices_are_bound_to_ancestors_that_move_the_body() {
    let (mut figure, takes) = misbound();
    let own = Figure::tube().garment.weights;
    figure.garment.weights = moved_to_chest(&own);
    let bound = hip(&fitted(&figure, &takes).weights);
    assert!(bound > 0.8 * hip(&own), "{bound}");
    // The hip moves nothing of this body.
    figure.character.weights = moved_to_chest(&figure.character.weights);
    let weights = fitted(&figure, &takes).weights;
    assert_eq!(hip(&weights), 0.0);
}

#[test]
fn two_frames_that_move_no_joint_against_another_keep_the_weights() {
    let (mut figure, mut takes) = misbound();
    figure.garment = Figure::tube().garment;
    for (take, _) in &mut takes {
        let still = take.clip.poses[0].local.clone();
        take.clip.poses.truncate(2);
        take.clip
            .poses
            .iter_mut()
            .for_each(|pose| pose.local.clone_from(&still));
        take.garment = figure.skinned(&take.clip);
    }
    let weights = fitted(&figure, &takes).weights;
    let both = weights
        .to_dense()
        .into_iter()
        .zip(figure.garment.weights.to_dense());
    // Weights below a thousandth are left out after the fit.
    assert!(
        both.into_iter()
            .all(|(after, before)| (after - before).abs() < 2e-3)
    );
}

#[test]
fn a_model_pushes_vertices_by_the_given_weights_after_its_file_is_read() {
    let (figure, takes) = misbound();
    let model = model(&figure, &takes);
    let read = Model::from_bytes(&model.to_bytes().unwrap()).unwrap();
    assert_eq!(read.garment(), model.garment());
    let of_given = ContactFilter::new(&figure.character, &figure.garment);
    assert_eq!(ContactFilter::new(read.character(), read.garment()), of_given);
    // The weights of the file would say otherwise.
    let fitted = Garment::new(read.garment().rest.clone(), read.garment().weights.clone());
    assert_ne!(ContactFilter::new(read.character(), &fitted), of_given);
}

#[test]
fn the_mask_keeps_its_share_of_the_given_weights() {
    let (mut figure, takes) = misbound();
    let weights = |figure: &Figure| fitted(figure, &takes).weights;
    let whole = weights(&figure);
    // Rings of the tube, so that a vertex and its mirror image have one share.
    let share = |v: usize| [1.0, 0.0, 0.5][v / RING % 3];
    figure.garment.mask = Some((0..VERTICES).map(share).collect());
    let masked = weights(&figure);
    let expected = figure.garment.weights.blended(&whole, share).unwrap();
    assert_eq!(masked, expected);
    assert_ne!(masked, whole);
}

#[test]
fn a_mask_of_a_model_shows_the_given_weights() {
    let (figure, takes) = misbound();
    let model = model(&figure, &takes);
    let masked = model.with_mask(&[0.0; VERTICES]).unwrap();
    assert_eq!(masked.garment().weights, figure.garment.weights);
    assert_eq!(
        model.with_mask(&[1.0; VERTICES]).unwrap().garment().weights,
        model.garment().weights
    );
    assert!(model.with_mask(&[f32::NAN; VERTICES]).is_err());
    assert!(model.with_mask(&[1.5; VERTICES]).is_err());
}

#[test]
fn weights_do_not_jump_where_a_joint_is_given_to_one_vertex_and_not_to_the_next() {
    let mut figure = Figure::tube();
    // A tube of a tenth of the size: a ring is 2 cm from the next one.
    let small = |v: Vec3| Vec3::new(0.0, 0.7, 0.0) + (v - Vec3::new(0.0, 0.7, 0.0)) * 0.1;
    figure
        .garment
        .rest
        .vertices
        .iter_mut()
        .for_each(|v| *v = small(*v));
    let half_hip = |_| vec![(0, 0.5f32), (1, 0.5)].into_iter();
    figure.garment.weights = SkinningWeights::from_rows(JOINTS, (0..VERTICES).map(half_hip)).unwrap();
    let skinned = takes().into_iter().map(|(take, split)| {
        let garment = figure.skinned(&take.clip);
        (Take { garment, ..take }, split)
    });
    let takes: Vec<(Take, Split)> = skinned.collect();
    // The chest is given to the upper three of five rings alone, and hardly any of it.
    let given = |v: usize| match v < 2 * RING {
        true => vec![(0, 1.0f32)].into_iter(),
        false => vec![(0, 0.97), (1, 0.03)].into_iter(),
    };
    figure.garment.weights = SkinningWeights::from_rows(JOINTS, (0..VERTICES).map(given)).unwrap();
    let weights = fitted(&figure, &takes).weights.to_dense();
    let chest: Vec<f32> = (weights.chunks_exact(JOINTS).step_by(RING))
        .map(|row| row[1])
        .collect();
    let (first, last) = (chest[0], chest[chest.len() - 1]);
    assert!(
        last - first > 0.15,
        "weights that do not differ test nothing: {chest:?}"
    );
    let steps = chest.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let largest = steps.fold(0.0, f32::max);
    assert!(largest < 0.7 * (last - first), "{chest:?}");
}

#[test]
fn a_symmetric_garment_has_symmetric_weights() {
    let (figure, takes) = misbound();
    let weights = fitted(&figure, &takes).weights.to_dense();
    let swapped = [0, 1, 3, 2, 5, 4];
    for vertex in 0..VERTICES {
        for joint in 0..JOINTS {
            let here = weights[vertex * JOINTS + joint];
            let there = weights[opposite(vertex as u32) as usize * JOINTS + swapped[joint]];
            assert!(
                (here - there).abs() < 1e-4,
                "vertex {vertex}, joint {joint}: {here} {there}"
            );
        }
    }
}

#[test]
fn one_thread_and_four_give_the_same_bits() {
    let (figure, takes) = misbound();
    let weights = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| fitted(&figure, &takes).weights)
    };
    assert_eq!(weights(1), weights(4));
}
