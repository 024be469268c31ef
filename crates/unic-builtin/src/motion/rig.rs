//! Inverse kinematics: the pose of a skeleton for given pelvis, chest, head, arms and feet.
//!
//! Joints have SMPL's indices. On the left: hip 1, knee 4, ankle 7, ball of the foot 10, collar 13,
//! shoulder 16, elbow 18, wrist 20, hand 22; the right twin follows each. In the middle: pelvis 0,
//! spine 3, 6 and 9 (chest), neck 12, head 15.

use super::{
    PerformerError, Side,
    foot::FootPose,
    gait::Stature,
    sole::{Sole, Soles, measure_soles},
};
use glam::{Mat3, Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use unic_core::{
    Pose,
    character::Character,
    skeleton::{SMPL_JOINT_NAMES, SMPL_PARENTS, Skeleton},
};

const JOINTS: usize = SMPL_JOINT_NAMES.len();

/// Parent of a joint in SMPL's tree; none for the root.
fn parent_of(joint: usize) -> Option<usize> {
    usize::try_from(SMPL_PARENTS[joint]).ok()
}

/// Limits on the distance from hip to ankle. Up to `soft` it is exact; beyond, it approaches
/// `hard`.
#[derive(Clone, Copy, Debug)]
struct ReachLimits {
    soft: f32,
    hard: f32,
}

/// Limits of a leg on the ground as shares of its length. The pelvis stays low enough for `soft`.
const REACH_ON_GROUND: ReachLimits = ReachLimits {
    soft: 0.9935,
    hard: 0.9995,
};

/// Limits of a leg in the air as shares of its length: the knee brakes long before it locks.
const REACH_IN_AIR: ReachLimits = ReachLimits {
    soft: 0.92,
    hard: 0.988,
};

/// Angles of one arm, radians: see the [channels](super::Channel) of the same names.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arm {
    pub(super) flexion: f32,
    pub(super) abduction: f32,
    pub(super) rotation: f32,
    pub(super) elbow: f32,
}

/// Posture of the body at one time. Rotations are from the bind pose (upright, facing +Z) to the
/// world.
#[derive(Clone, Copy, Debug)]
pub(super) struct Posture {
    /// World position of the pelvis joint, metres.
    pub(super) position: Vec3,
    pub(super) pelvis: Quat,
    pub(super) chest: Quat,
    pub(super) head: Quat,
    pub(super) arms: [Arm; 2],
    pub(super) feet: [FootPose; 2],
}

/// Skeleton with the measurements that inverse kinematics needs.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    /// Positions of the joints in the bind pose, metres.
    joints: Vec<Vec3>,
    /// World rotations of the joints in the bind pose.
    bind: Vec<Quat>,
    /// Rotation from the bone of pose zero to the axis of its limb: ±X for arms, −Y for legs.
    limb_from_bone: [Quat; JOINTS],
    /// Left sole, then right.
    pub(super) soles: [Sole; 2],
    pub(super) stature: Stature,
}

impl Rig {
    pub(super) fn new(character: &Character) -> Result<Self, PerformerError> {
        let skeleton = &character.skeleton;
        check_joints(skeleton)?;
        let Soles { soles, ground } = measure_soles(character)?;
        let joints = skeleton.joints().to_vec();
        let mut world = Vec::new();
        skeleton.forward_kinematics(&skeleton.bind_pose(), &mut world);
        let bind: Vec<Quat> = world.iter().map(|w| w.rotation).collect();
        let crown = character.body.vertices.iter().fold(ground, |top, v| top.max(v.y));
        let length = |a: usize, b: usize| joints[a].distance(joints[b]);
        let stature = Stature {
            height: f64::from(crown - ground),
            leg: f64::from(length(1, 4) + length(4, 7)),
        };
        // Negated, so that NaN is refused too.
        if !(stature.height > 0.1 && stature.leg > 0.05) {
            return Err(PerformerError::NoLegs);
        }
        let limb_from_bone = std::array::from_fn(|j| limb_from_bone(&joints, &bind, j));
        Ok(Self {
            joints,
            bind,
            limb_from_bone,
            soles,
            stature,
        })
    }

    /// Half the distance of the hip joints, metres.
    pub(super) fn half_width(&self) -> f64 {
        0.5 * f64::from((self.joints[1].x - self.joints[2].x).abs())
    }

    /// Position of a hip joint relative to the pelvis joint in the bind pose, metres.
    pub(super) fn hip(&self, side: Side) -> Vec3 {
        self.joints[1 + side.index()] - self.joints[0]
    }

    /// Computes the pose of a posture. Its `trans` puts the ground at world height zero.
    pub(super) fn pose(&self, posture: &Posture) -> Pose {
        // Every joint's world rotation is written below; local ones follow from the parents'.
        let mut world = [Quat::IDENTITY; JOINTS];
        self.trunk(posture, &mut world);
        for side in Side::BOTH {
            self.arm(posture, side, &mut world);
            self.leg(posture, side, &mut world);
        }
        let local = |j: usize| parent_of(j).map_or(world[j], |p| world[p].inverse() * world[j]);
        Pose {
            trans: posture.position - self.joints[0],
            local: (0..JOINTS).map(|j| shortest(local(j).normalize())).collect(),
        }
    }

    fn trunk(&self, posture: &Posture, world: &mut [Quat; JOINTS]) {
        let Posture {
            pelvis, chest, head, ..
        } = *posture;
        let mut set = |j: usize, rotation: Quat| world[j] = rotation * self.bind[j];
        // The spine's joints share the bend between pelvis and chest, the neck that of the head.
        set(0, pelvis);
        set(3, pelvis.slerp(chest, 0.3));
        set(6, pelvis.slerp(chest, 0.7));
        set(9, chest);
        set(12, chest.slerp(head, 0.5));
        set(15, head);
    }

    fn arm(&self, posture: &Posture, side: Side, world: &mut [Quat; JOINTS]) {
        let (arm, sign, i) = (posture.arms[side.index()], side.sign(), side.index());
        let collar = posture.chest * Quat::from_rotation_z(sign * collar_lift(arm, sign));
        world[13 + i] = collar * self.bind[13 + i];
        let upper = posture.chest * Quat::from_rotation_x(-arm.flexion) * lowered(arm, sign);
        world[16 + i] = upper * self.limb_from_bone[16 + i];
        let fore = upper * Quat::from_rotation_y(-sign * arm.elbow);
        world[18 + i] = fore * self.limb_from_bone[18 + i];
        // Relaxed hands bend a little inward.
        world[20 + i] = world[18 + i] * Quat::from_rotation_z(-sign * 0.1);
        world[22 + i] = world[20 + i] * Quat::from_rotation_z(-sign * 0.1);
    }

    fn leg(&self, posture: &Posture, side: Side, world: &mut [Quat; JOINTS]) {
        let (foot, i) = (posture.feet[side.index()], side.index());
        let hip = posture.position + posture.pelvis * self.hip(side);
        let facing = posture.pelvis * Vec3::Z;
        let toes = Quat::from_rotation_y(foot.heading as f32) * Vec3::Z;
        // The knee points half way between pelvis and toes.
        let [thigh, shank] = self.two_bones(side, foot.ankle - hip, facing + toes, foot.airborne);
        world[1 + i] = thigh * self.limb_from_bone[1 + i];
        world[4 + i] = shank * self.limb_from_bone[4 + i];
        world[7 + i] = foot.foot * self.bind[7 + i];
        world[10 + i] = foot.toes * self.bind[10 + i];
    }

    /// Rotations of thigh and shank that bring the ankle to `reach` from the hip, metres, while the
    /// knee bends towards `front`.
    ///
    /// In the rotated axes −Y runs along the bone and +Z to the front of the knee.
    fn two_bones(&self, side: Side, reach: Vec3, front: Vec3, airborne: f32) -> [Quat; 2] {
        let i = side.index();
        let a = self.joints[1 + i].distance(self.joints[4 + i]);
        let b = self.joints[4 + i].distance(self.joints[7 + i]);
        let limit = |ground: f32, air: f32| {
            let share = ground + (air - ground) * airborne;
            share * (a + b)
        };
        let limits = ReachLimits {
            soft: limit(REACH_ON_GROUND.soft, REACH_IN_AIR.soft),
            hard: limit(REACH_ON_GROUND.hard, REACH_IN_AIR.hard),
        };
        // Bones of different length cannot bring hip and ankle together: nearer there is no
        // triangle.
        let d = soft_reach(reach.length(), limits).max((a - b).abs() + 1e-3);
        let down = reach.normalize_or(Vec3::NEG_Y);
        let ahead = (front - down * front.dot(down)).normalize_or(Vec3::Z);
        let hinge = ahead.cross(down);
        // Law of cosines for the angle at the hip; rounding may leave −1 to 1.
        let cosine = ((a * a + d * d - b * b) / (2.0 * a * d)).clamp(-1.0, 1.0);
        let knee = (down * cosine + ahead * (1.0 - cosine * cosine).sqrt()) * a;
        let basis = |bone: Vec3| {
            let y = -bone.normalize_or(Vec3::NEG_Y);
            Quat::from_mat3(&Mat3::from_cols(hinge, y, hinge.cross(y)))
        };
        [basis(knee), basis(down * d - knee)]
    }
}

/// Same rotation with an angle of at most π, for readers that convert it to axis and angle.
fn shortest(rotation: Quat) -> Quat {
    if rotation.w < 0.0 { -rotation } else { rotation }
}

/// Rotation of the upper arm from the T-pose (along ±X) down to the side, less the abduction.
fn lowered(arm: Arm, sign: f32) -> Quat {
    Quat::from_rotation_z(-sign * (FRAC_PI_2 - arm.abduction)) * Quat::from_rotation_x(arm.rotation)
}

/// Angle by which the collar bone lifts with the upper arm, radians.
///
/// It is a twelfth of the arm's angle when the arm is level and a seventh when it points up
/// (scapulohumeral rhythm without the part of the shoulder blade).
fn collar_lift(arm: Arm, sign: f32) -> f32 {
    let bone = Quat::from_rotation_x(-arm.flexion) * lowered(arm, sign) * (Vec3::X * sign);
    0.11 * (1.0 + bone.y).powi(2)
}

/// Distance from hip to ankle of a leg that should span `wanted` metres.
///
/// It equals `wanted` up to `limits.soft` and approaches `limits.hard` beyond.
fn soft_reach(wanted: f32, limits: ReachLimits) -> f32 {
    let ReachLimits { soft, hard } = limits;
    // x / ∛(1 + x³) has slope 1 and no curvature at zero, so that the knee's acceleration is
    // continuous, and tends to 1.
    let x = ((wanted - soft) / (hard - soft)).max(0.0);
    wanted.min(soft) + (hard - soft) * x / (1.0 + x * x * x).cbrt()
}

fn check_joints(skeleton: &Skeleton) -> Result<(), PerformerError> {
    if skeleton.len() != JOINTS {
        return Err(PerformerError::Joints {
            expected: JOINTS,
            found: skeleton.len(),
        });
    }
    match (0..JOINTS).find(|&j| skeleton.parents()[j] != parent_of(j)) {
        None => Ok(()),
        Some(joint) => Err(PerformerError::Parent {
            joint,
            expected: parent_of(joint),
            found: skeleton.parents()[joint],
        }),
    }
}

/// Rotation from a limb's bone in pose zero to its axis: ±X for arms, −Y for legs.
///
/// Joints outside the limbs, and bones without length, have none: the identity.
fn limb_from_bone(joints: &[Vec3], bind: &[Quat], joint: usize) -> Quat {
    let (child, axis) = match joint {
        1 | 2 | 4 | 5 => (joint + 3, Vec3::NEG_Y),
        16 | 18 => (joint + 2, Vec3::X),
        17 | 19 => (joint + 2, Vec3::NEG_X),
        _ => return Quat::IDENTITY,
    };
    let bone = bind[joint].inverse() * (joints[child] - joints[joint]);
    bone.try_normalize()
        .map_or(Quat::IDENTITY, |b| Quat::from_rotation_arc(b, axis))
}
