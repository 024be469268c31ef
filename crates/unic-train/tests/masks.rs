//! Contract: a mask in `garment.npz` blends what a model learns and plays to plain skinning, the
//! same way in both; a mask of ones changes no byte, and the published method has none.

#![allow(clippy::unwrap_used, reason = "a failed set-up fails the test")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{Animator, Model, Start, StepInput, features::PointFrame};
use unic_train::*;

/// Mask of three vertices: model alone, skinning alone, and a blend of both.
const SHARES: [f32; 3] = [1.0, 0.0, 0.4];

fn figure(share: impl Fn(usize) -> f32) -> Figure {
    let mut figure = Figure::tube();
    figure.garment.mask = Some((0..VERTICES).map(share).collect());
    figure
}

fn trained(figure: &Figure, preset: Preset) -> Trainer {
    let config = small(preset);
    let mut trainer = Trainer::new(dataset_for(figure, &config), config).unwrap();
    run(&mut trainer);
    trainer
}

#[test]
fn masked_vertices_follow_the_skeleton_and_the_others_the_model() {
    let trainer = trained(&figure(|v| SHARES[v % 3]), Preset::Tiny);
    let bytes = trainer.model().unwrap().to_bytes().unwrap();
    let model = Arc::new(Model::from_bytes(&bytes).unwrap());
    let clip = &trainer.data().clips[0];
    let input = |t: usize| StepInput {
        pose: &clip.captured.clip.poses[t],
        next_pose: None,
        ground_height: 0.0,
        wind: Vec3::ZERO,
    };
    let mut animator = Animator::new(Arc::clone(&model));
    let garment = &clip.captured.garment;
    animator
        .reset(&input(0), Start::Positions(garment.frame(0)))
        .unwrap();
    let mut largest = 0.0f32;
    for t in 1..clip.len() {
        let shown = animator.step(&input(t)).unwrap().positions;
        for (vertex, x) in shown.iter().enumerate() {
            let frame = PointFrame::new(model.garment(), vertex, clip.kinematics.world_from_rest(t));
            match frame.share {
                0.0 => assert!(x.distance(frame.skinned) < 1e-6, "frame {t}, vertex {vertex}"),
                _ => largest = largest.max(x.distance(frame.skinned)),
            }
        }
    }
    assert!(
        largest > 0.01,
        "a garment that hardly leaves skinning tests nothing: {largest} m"
    );
}

#[test]
fn the_prior_learns_the_blended_garment() {
    let [masked, whole] = [figure(|v| SHARES[v % 3]), Figure::tube()]
        .map(|figure| dataset_for(&figure, &small(Preset::Tiny)).prior);
    let means = masked.mean.iter().zip(&whole.mean).enumerate();
    for (v, (masked, whole)) in means {
        assert!((*masked - *whole * SHARES[v % 3]).length() < 1e-6, "vertex {v}");
    }
    let moves = |v: usize| (0..masked.len()).any(|k| masked.components.vector(v, k) != Vec3::ZERO);
    assert!((0..VERTICES).all(|v| v % 3 != 1 || !moves(v)));
    // Vertices that hardly move are rounded to zero.
    for share in [0, 2] {
        let moving = (share..VERTICES).step_by(3).filter(|v| moves(*v)).count();
        assert!(moving > VERTICES / 6, "{moving} of {}", VERTICES / 3);
    }
}

#[test]
fn mask_of_ones_changes_no_byte() {
    let bytes = |figure: &Figure| {
        let mut parts = trained(figure, Preset::Tiny).model().unwrap().to_parts();
        parts.about.training = serde_json::Value::Null;
        Model::new(parts).unwrap().to_bytes().unwrap()
    };
    assert!(bytes(&figure(|_| 1.0)) == bytes(&Figure::tube()));
}

#[test]
fn the_published_method_has_no_mask() {
    let model = trained(&figure(|v| SHARES[v % 3]), Preset::Paper)
        .model()
        .unwrap();
    assert_eq!(model.garment().mask, None);
}
