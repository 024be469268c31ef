//! Where a foot touches the ground.

use super::{MotionError, channel::Side};
use glam::Vec3;
use unic_core::character::Character;

/// Vertices this close to the lowest one are the sole, metres.
const SOLE_THICKNESS: f32 = 0.012;

/// Contact points of one foot in its sole frame: origin on the ground below the ankle, axes of the bind
/// pose (+Y up, +Z towards the toes), metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sole {
    /// The ankle joint.
    pub(super) ankle: Vec3,
    /// Rear edge of the sole.
    pub(super) heel: Vec3,
    /// The joint between foot and toes.
    pub(super) ball: Vec3,
    /// Front edge of the sole.
    pub(super) toe: Vec3,
}

/// The soles of both feet, from the vertices that the feet's joints move most, and the height of the
/// ground in the bind pose.
pub(super) fn soles(character: &Character) -> Result<([Sole; 2], f32), MotionError> {
    let feet = Side::BOTH.map(|side| foot_vertices(character, side));
    let ground = (feet.iter().flatten().map(|v| v.y)).fold(f32::INFINITY, f32::min);
    if feet.iter().any(Vec::is_empty) || !ground.is_finite() {
        return Err(MotionError::NoFeet);
    }
    Ok((
        Side::BOTH.map(|side| sole(character, side, &feet[side.index()], ground)),
        ground,
    ))
}

fn foot_vertices(character: &Character, side: Side) -> Vec<Vec3> {
    let joints = [7 + side.index(), 10 + side.index()];
    let leading = |v: usize| character.weights.row(v).next().map(|(j, _)| j);
    (character.body.vertices.iter().enumerate())
        .filter(|(v, _)| leading(*v).is_some_and(|j| joints.contains(&j)))
        .map(|(_, &position)| position)
        .collect()
}

fn sole(character: &Character, side: Side, foot: &[Vec3], ground: f32) -> Sole {
    let joints = character.skeleton.joints();
    let (ankle, ball) = (joints[7 + side.index()], joints[10 + side.index()]);
    let origin = Vec3::new(ankle.x, ground, ankle.z);
    let low = foot.iter().filter(|v| v.y < ground + SOLE_THICKNESS).map(|v| v.z);
    let (rear, front) = low.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), z| {
        (a.min(z), b.max(z))
    });
    Sole {
        ankle: ankle - origin,
        heel: Vec3::new(0.0, 0.0, rear - origin.z),
        ball: ball - origin,
        toe: Vec3::new(ball.x - origin.x, 0.0, front.max(ball.z) - origin.z),
    }
}
