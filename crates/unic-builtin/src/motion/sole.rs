//! Contact points of a foot with the ground.

use super::{PerformerError, Side};
use glam::Vec3;
use unic_core::character::Character;

/// Height above the lowest vertex up to which vertices count as the sole, metres.
const SOLE_THICKNESS: f32 = 0.012;

/// Left ankle in SMPL's order; the right one follows.
const ANKLE: usize = 7;

/// Left ball of the foot, the joint between foot and toes, in SMPL's order; the right one follows.
const BALL: usize = 10;

/// Contact points of one foot, metres.
///
/// The origin lies on the ground below the ankle. Axes are those of the bind pose: +Y up, +Z
/// towards the toes.
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

/// Soles of both feet of a character in the bind pose.
pub(super) struct Soles {
    /// Left sole, then right.
    pub(super) soles: [Sole; 2],
    /// Height of the ground, metres.
    pub(super) ground: f32,
}

/// Measures the soles on the vertices that the joints of the feet move most.
pub(super) fn measure_soles(character: &Character) -> Result<Soles, PerformerError> {
    let feet = Side::BOTH.map(|side| foot_vertices(character, side));
    let ground = (feet.iter().flatten().map(|v| v.y)).fold(f32::INFINITY, f32::min);
    if feet.iter().any(Vec::is_empty) || !ground.is_finite() {
        return Err(PerformerError::NoFeet);
    }
    Ok(Soles {
        soles: Side::BOTH.map(|side| sole(character, side, &feet[side.index()], ground)),
        ground,
    })
}

fn foot_vertices(character: &Character, side: Side) -> Vec<Vec3> {
    let joints = [ANKLE + side.index(), BALL + side.index()];
    // Rows of skinning weights begin with the largest weight.
    let leading = |v: usize| character.weights.row(v).next().map(|(j, _)| j);
    (character.body.vertices.iter().enumerate())
        .filter(|(v, _)| leading(*v).is_some_and(|j| joints.contains(&j)))
        .map(|(_, &position)| position)
        .collect()
}

fn sole(character: &Character, side: Side, foot: &[Vec3], ground: f32) -> Sole {
    let joints = character.skeleton.joints();
    let (ankle, ball) = (joints[ANKLE + side.index()], joints[BALL + side.index()]);
    let origin = Vec3::new(ankle.x, ground, ankle.z);
    let low = foot.iter().filter(|v| v.y < ground + SOLE_THICKNESS).map(|v| v.z);
    let (rear, front) = low.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), z| {
        (a.min(z), b.max(z))
    });
    Sole {
        ankle: ankle - origin,
        heel: Vec3::new(0.0, 0.0, rear - origin.z),
        ball: ball - origin,
        // The toe lies in front of the ball even on a body whose toes have no low vertices.
        toe: Vec3::new(ball.x - origin.x, 0.0, front.max(ball.z) - origin.z),
    }
}
