//! The animator's contract: a step is the documented formulas, states continue to the byte, inputs
//! that do not belong are refused and change nothing, and no motion drives a displacement away.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod bounds;
#[path = "../common/mod.rs"]
mod common;
mod display;
mod formulas;
mod handling;
#[path = "../common/reference.rs"]
mod reference;
mod refusals;
mod states;
mod threads;

use common::*;
use glam::{Quat, Vec3};
use reference::Reference;
use std::sync::{
    Arc,
    atomic::{AtomicU64, AtomicUsize, Ordering},
};
use unic_core::{
    animator::{Animator, AnimatorError, AnimatorState, Display, Start, StepInput},
    config::{Corrects, IntersectionMode, StateConfig},
    intersection::{BodySnapshot, PaperIntersection},
    model::Model,
    network::Precision,
    parallel::{Serial, Threads},
    skeleton::Pose,
    subdivide::subdivided,
    surface::Surface,
};

/// Positions of the animator against the reference, metres: rounding of positions near 1 m, carried
/// on by networks that do not shrink it.
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

/// The garment's rest shape where the skeleton carries it.
fn skinned(model: &Model, pose: &Pose) -> Vec<Vec3> {
    let (mut joints, mut transforms, mut positions) = (vec![], vec![], vec![]);
    let skeleton = &model.character().skeleton;
    skeleton.forward_kinematics(pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    let (rest, weights) = (&model.garment().rest, &model.garment().weights);
    weights.skin(&rest.vertices, &transforms, &mut positions);
    positions
}

/// A garment that hangs 9 cm too far in.
fn tight(name: &str) -> Arc<Model> {
    let mut parts = parts(&variant(name));
    let inwards = |v: &Vec3| -v.with_y(0.0).normalize() * 0.09;
    parts.prior.mean = parts.garment.rest.vertices.iter().map(inwards).collect();
    Arc::new(Model::new(parts).unwrap())
}
