//! Contract: fitted skinning weights are those that the captured garment moves with, as far as its
//! motion shows them, and everything that the capture has fixed stays.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use unic_core::{
    Model,
    character::Garment,
    intersection::{ContactFilter, MIN_CARRYING_WEIGHT},
    skinning::SkinningWeights,
    transform::Rigid,
};
use unic_io::Split;
use unic_train::*;

const JOINTS: usize = 6;

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
/// into the chest, and those of the chest into the arms.
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
        let arm = 0.25 * w[1];
        [hip, chest, w[2] + arm, w[3] + arm, w[4], w[5]]
    });
    let wrong: Vec<f32> = wrong.collect();
    figure.garment.weights = SkinningWeights::from_dense(&wrong, VERTICES, JOINTS).unwrap();
    (figure, takes)
}

fn fitted(figure: &Figure, takes: &[(Take, Split)], source: SkinningSource) -> Dataset {
    let (_folder, capture) = unic_testdata::capture(figure, takes);
    Dataset::load(capture, &settings(source), Fit::HeldOut).unwrap()
}

/// RMS distance of the skinned rest shape from what the clips show, metres.
fn error_m(data: &Dataset, garment: &Garment) -> f32 {
    let (mut sum, mut count) = (0.0, 0);
    let mut shown = Vec::new();
    for clip in &data.clips {
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
    let [given, fitted] =
        [SkinningSource::Given, SkinningSource::Fitted].map(|source| fitted(&figure, &takes, source));
    assert_eq!(given.capture.garment.weights, figure.garment.weights);
    let [before, after] = [&given, &fitted].map(|data| error_m(data, &data.capture.garment));
    assert!(
        before > 0.005,
        "weights that are hardly wrong test nothing: {before} m"
    );
    assert!(after < 0.35 * before, "{before} m, then {after} m");
}

#[test]
fn given_weights_stay_as_carriers_and_fitted_ones_are_of_their_ancestors() {
    let (figure, takes) = misbound();
    let given = &figure.garment.weights;
    let garment = fitted(&figure, &takes, SkinningSource::Fitted).capture.garment;
    let parents = figure.character.skeleton.parents();
    for vertex in 0..VERTICES {
        let carriers: Vec<usize> = garment.carriers().row(vertex).map(|(joint, _)| joint).collect();
        let heavy = given.row(vertex).filter(|(_, w)| *w >= MIN_CARRYING_WEIGHT);
        assert_eq!(carriers, heavy.map(|(joint, _)| joint).collect::<Vec<_>>());
        let sum: f32 = garment.weights.row(vertex).map(|(_, w)| w).sum();
        assert!((sum - 1.0).abs() < 1e-5);
        for (joint, _) in garment.weights.row(vertex) {
            let is_above = |child: usize| {
                std::iter::successors(Some(child), |j| parents[*j]).any(|above| above == joint)
            };
            assert!(given.row(vertex).any(|(child, _)| is_above(child)));
        }
    }
}

#[test]
fn a_model_pushes_vertices_by_the_given_weights_after_its_file_is_read() {
    let (figure, takes) = misbound();
    let (_folder, capture) = unic_testdata::capture(&figure, &takes);
    let config = settings(SkinningSource::Fitted);
    let data = FieldData::prepare(capture, &config, Fit::HeldOut).unwrap();
    let model = Trainer::new(data, config).unwrap().model().unwrap();
    let read = Model::from_bytes(&model.to_bytes().unwrap()).unwrap();
    assert_eq!(read.garment(), model.garment());
    let of_given = ContactFilter::new(&figure.character, &figure.garment);
    assert_eq!(ContactFilter::new(read.character(), read.garment()), of_given);
    // The weights of the file would say otherwise.
    let fitted = Garment::new(read.garment().rest.clone(), read.garment().weights.clone());
    assert_ne!(ContactFilter::new(read.character(), &fitted), of_given);
}

#[test]
fn the_mask_keeps_the_given_weights() {
    let (mut figure, takes) = misbound();
    let shares = [1.0, 0.0, 0.5];
    figure.garment.mask = Some((0..VERTICES).map(|v| shares[v % 3]).collect());
    let weights = fitted(&figure, &takes, SkinningSource::Fitted)
        .capture
        .garment
        .weights;
    let given = &figure.garment.weights;
    let same = |v: usize| weights.row(v).eq(given.row(v));
    // The mirror image of a vertex has another mask, so only rows without any count here.
    assert!((0..VERTICES).all(|v| same(v) || shares[v % 3] > 0.0));
    assert!((0..VERTICES).any(|v| !same(v)));
}

#[test]
fn a_symmetric_garment_has_symmetric_weights() {
    let (figure, takes) = misbound();
    let weights = fitted(&figure, &takes, SkinningSource::Fitted)
        .capture
        .garment
        .weights
        .to_dense();
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
        pool.install(|| {
            fitted(&figure, &takes, SkinningSource::Fitted)
                .capture
                .garment
                .weights
        })
    };
    assert_eq!(weights(1), weights(4));
}
