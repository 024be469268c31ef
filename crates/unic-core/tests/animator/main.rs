//! Contract of the animator: a step computes the documented formulas, restored states continue with
//! the same bytes, unusable inputs are refused and change nothing, and displacements stay bounded.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod bounds;
#[path = "../common/mod.rs"]
mod common;
mod formulas;
mod handling;
mod live_garment;
#[path = "../common/reference.rs"]
mod reference;
mod refusals;
mod states;
mod threads;
mod tick_interpolator;

use common::*;
use glam::{Quat, Vec3};
use reference::Reference;
use std::sync::{
    Arc,
    atomic::{AtomicU64, AtomicUsize, Ordering},
};
use unic_core::{
    Animator, AnimatorError, AnimatorState, Corrects, IntersectionMode, Model, Pose, Precision, Start,
    StepInput, Threads, TickInterpolator,
    config::StateConfig,
    intersection::{BodySnapshot, PaperIntersection},
    parallel::Serial,
    subdivide::{Subdivided, subdivided},
    surface::Surface,
};

/// Largest distance from the reference, metres: the rounding of positions near 1 m, which the
/// networks pass on without shrinking it.
const TOLERANCE: f64 = 5e-5;

/// Every way to handle intersections.
const MODES: [IntersectionMode; 4] = [
    IntersectionMode::Off,
    IntersectionMode::Paper { relaxation_m: 0.005 },
    robust(Corrects::Display),
    robust(Corrects::State),
];

const fn robust(corrects: Corrects) -> IntersectionMode {
    IntersectionMode::Robust {
        margin_m: 0.003,
        corrects,
    }
}

/// Skins the garment's rest shape to a pose.
fn skinned(model: &Model, pose: &Pose) -> Vec<Vec3> {
    let (mut joints, mut transforms, mut positions) = (vec![], vec![], vec![]);
    let skeleton = &model.character().skeleton;
    skeleton.forward_kinematics(pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    let (rest, weights) = (&model.garment().rest, &model.garment().weights);
    weights.skin(&rest.vertices, &transforms, &mut positions);
    positions
}

/// A garment whose mean displacement is 9 cm inwards, so that it intersects the body.
fn tight(name: &str) -> Arc<Model> {
    let mut parts = parts(&variant(name));
    let inwards = |v: &Vec3| -v.with_y(0.0).normalize() * 0.09;
    parts.prior.mean = parts.garment.rest.vertices.iter().map(inwards).collect();
    Arc::new(Model::new(parts).unwrap())
}
