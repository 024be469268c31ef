//! Contract of an animator with colliders and layers: both stay over resets and changes of mode,
//! and results do not depend on the number of threads.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;

use common::*;
use glam::Vec3;
use std::sync::Arc;
use unic_core::{
    Animator, AnimatorError, Collider, Corrects, IntersectionMode, Layers, Model, Start,
    parallel::{Rayon, Serial},
    subdivide::subdivided,
};

const ROBUST: IntersectionMode = IntersectionMode::Robust {
    margin_m: 0.003,
    corrects: Corrects::Display,
};

fn tube() -> Arc<Model> {
    model(&variant("second order"))
}

fn lowest(frame: &[Vec3]) -> f32 {
    frame.iter().map(|p| p.y).fold(f32::INFINITY, f32::min)
}

#[test]
fn the_ground_stays_over_resets_and_modes() {
    let (poses, model) = (motion(12), tube());
    let mut animator = Animator::new(model);
    animator.set_intersection(ROBUST);
    let bare: Vec<f32> = run(&mut animator, &poses).iter().map(|f| lowest(f)).collect();
    let ground = bare.iter().copied().fold(f32::INFINITY, f32::min) + 0.05;
    animator.set_colliders([Collider::ground(ground)]);
    for mode in [ROBUST, IntersectionMode::Off, ROBUST] {
        animator.set_intersection(mode);
        let frames = run(&mut animator, &poses);
        let above = frames[1..].iter().all(|frame| lowest(frame) >= ground - 1e-4);
        assert_eq!(above, mode == ROBUST, "{mode:?}");
    }
    animator.colliders_mut()[0] = Collider::ground(ground - 1.0);
    let lowered: Vec<f32> = run(&mut animator, &poses).iter().map(|f| lowest(f)).collect();
    assert_eq!(lowered, bare, "ground far below changes nothing");
}

#[test]
fn results_with_colliders_and_layers_do_not_depend_on_threads() {
    let (poses, model) = (motion(8), tube());
    let layers = |model: &Model| {
        let half = model.vertex_count() / 2;
        let numbers = (0..model.vertex_count()).map(|v| u32::from(v >= half)).collect();
        Layers::new(model.character(), model.garment(), numbers).unwrap()
    };
    let bytes = |mut animator: Animator| {
        animator.set_intersection(ROBUST);
        animator.set_colliders([
            Collider::ground(0.3),
            Collider::sphere(0.1, Vec3::new(0.1, 0.9, 0.1)),
        ]);
        animator.set_layers(layers(&model)).unwrap();
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        (1..poses.len())
            .map(|t| bits(animator.step(&input(&poses, t)).unwrap()))
            .collect::<Vec<_>>()
    };
    let [one, many] = [0, 1].map(|many| {
        let mut animator = Animator::new(Arc::clone(&model));
        match many {
            0 => animator.set_threads(Arc::new(Serial)),
            _ => animator.set_threads(Arc::new(Rayon)),
        }
        bytes(animator)
    });
    assert!(one == many);
}

#[test]
fn layers_of_another_garment_are_refused() {
    let model = tube();
    let smaller = Layers::new(
        model.character(),
        model.garment(),
        vec![0; model.vertex_count() - 1],
    );
    assert!(smaller.is_err());
    let layers = Layers::new(model.character(), model.garment(), vec![0; model.vertex_count()]).unwrap();
    assert_eq!(
        Animator::new(Arc::clone(&model)).set_layers(layers.clone()),
        Ok(())
    );
    let finer = subdivided(&model.garment().rest).mesh;
    let fine = Arc::new(model.with_mesh(finer).unwrap());
    let found = Animator::new(fine).set_layers(layers);
    assert!(matches!(found, Err(AnimatorError::Vertices { .. })), "{found:?}");
}
