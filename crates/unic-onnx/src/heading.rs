//! Heading of the character ([`unic_core::heading`]) as a part of a graph.

use crate::graph::{Graph, Value};
use std::f32::consts::{PI, TAU};
use unic_core::heading::{CORRECTION_TIME_S, MIN_CERTAINTY, SMALL_HALF_SINE};

/// Yaw of a single pose, and its certainty, (1, 1) each.
struct UprightYaw {
    yaw: Value,
    certainty: Value,
}

/// Yaw (1, 1) of the first frame, from the root's rotation (1, 4).
pub(crate) fn start(graph: &mut Graph, root: Value) -> Value {
    let UprightYaw { yaw, certainty } = upright_yaw(graph, root);
    let forward = graph.constant(&[1, 3], &[0.0, 0.0, 1.0]);
    let matrix = graph.matrices(root);
    let forward = graph.rotated(matrix, forward);
    let [x, z] = [0, 2].map(|axis| graph.slice(forward, axis, axis + 1, 1));
    let projected = graph.angle(x, z);
    let is_uncertain = graph.is_below(certainty, MIN_CERTAINTY);
    graph.choose(is_uncertain, projected, yaw)
}

/// Yaw (1, 1) one tick of `dt` seconds after `yaw`, between which the root turns from `previous` to
/// `root` (1, 4).
pub(crate) fn advance(graph: &mut Graph, yaw: Value, [previous, root]: [Value; 2], dt: f32) -> Value {
    let turn = turn_between(graph, previous, root);
    let turn = rotation_vector(graph, turn);
    let turn = graph.slice(turn, 1, 2, 1);
    let turned = graph.add(yaw, turn);
    let UprightYaw {
        yaw: target,
        certainty,
    } = upright_yaw(graph, root);
    // gain = 1 − exp(−certainty² dt / time)
    let squared = graph.mul(certainty, certainty);
    let exponent = graph.scale(squared, -dt / CORRECTION_TIME_S);
    let kept = graph.map("Exp", exponent);
    let one = graph.scalar(1.0);
    let gain = graph.sub(one, kept);
    let error = graph.sub(target, turned);
    let error = wrapped(graph, error);
    let correction = graph.mul(gain, error);
    let yaw = graph.add(turned, correction);
    wrapped(graph, yaw)
}

/// Rotation (1, 4) that leads from one rotation to another, in world axes.
pub(crate) fn turn_between(graph: &mut Graph, from: Value, to: Value) -> Value {
    let inverse = graph.conjugate(from);
    graph.product(to, inverse)
}

/// Axis times angle (1, 3) of a unit quaternion (1, 4), the angle in 0..=π radians.
pub(crate) fn rotation_vector(graph: &mut Graph, rotation: Value) -> Value {
    let w = graph.slice(rotation, 3, 4, 1);
    let is_negative = graph.is_below(w, 0.0);
    let negative = graph.map("Neg", rotation);
    let positive = graph.choose(is_negative, negative, rotation);
    let w = graph.slice(positive, 3, 4, 1);
    let axis = graph.slice(positive, 0, 3, 1);
    let squared = graph.squared_lengths(axis);
    let half_sine = graph.map("Sqrt", squared);
    let half = graph.angle(half_sine, w);
    let angle = graph.scale(half, 2.0);
    let divisor = graph.at_least(half_sine, SMALL_HALF_SINE);
    let factor = graph.div(angle, divisor);
    // The limit for small angles.
    let two = graph.scalar(2.0);
    let is_small = graph.is_below(half_sine, SMALL_HALF_SINE);
    let factor = graph.choose(is_small, two, factor);
    graph.mul(axis, factor)
}

fn upright_yaw(graph: &mut Graph, root: Value) -> UprightYaw {
    let y = graph.slice(root, 1, 2, 1);
    let w = graph.slice(root, 3, 4, 1);
    let half = graph.angle(y, w);
    let yaw = graph.scale(half, 2.0);
    let [yy, ww] = [y, w].map(|v| graph.mul(v, v));
    UprightYaw {
        yaw: wrapped(graph, yaw),
        certainty: graph.add(yy, ww),
    }
}

/// Wraps an angle to −π..=π.
fn wrapped(graph: &mut Graph, angle: Value) -> Value {
    let turns = graph.scale(angle, 1.0 / TAU);
    let turns = graph.map("Round", turns);
    let whole = graph.scale(turns, TAU);
    let rest = graph.sub(angle, whole);
    graph.clamp(rest, PI)
}
