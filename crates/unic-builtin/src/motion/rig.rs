//! From a posture (where pelvis, chest, head, arms and feet are) to a pose of a skeleton.

use super::{
    MotionError,
    channel::Side,
    foot::FootPose,
    gait::Stature,
    sole::{Sole, soles},
};
use glam::{Mat3, Quat, Vec3};
use std::f32::consts::FRAC_PI_2;
use unic_core::{
    character::Character,
    skeleton::{Pose, SMPL_JOINT_NAMES, SMPL_PARENTS, Skeleton},
};

const JOINTS: usize = SMPL_JOINT_NAMES.len();

/// Parent of a joint in SMPL's order; none for the root.
fn parent_of(joint: usize) -> Option<usize> {
    usize::try_from(SMPL_PARENTS[joint]).ok()
}

/// Shares of its full length from which on a leg yields, and beyond which it never stretches, while it
/// carries weight: the pelvis stays where the first is enough.
const REACH_ON_GROUND: [f32; 2] = [0.9935, 0.9995];

/// The same for a leg that swings, which brakes its knee long before it locks.
const REACH_IN_AIR: [f32; 2] = [0.92, 0.988];

/// Angles of one arm, radians: see the channels of the same names.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Arm {
    pub(super) flexion: f32,
    pub(super) abduction: f32,
    pub(super) rotation: f32,
    pub(super) elbow: f32,
}

/// A whole body at one time. Rotations are from the bind pose (upright, facing +Z) to the world.
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

/// A skeleton with what posing it needs.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    joints: Vec<Vec3>,
    /// World rotations of the bind pose.
    bind: Vec<Quat>,
    /// Rotation from the bone of pose zero to the axis of its limb: ±X for arms, −Y for legs.
    limb_from_bone: [Quat; JOINTS],
    pub(super) soles: [Sole; 2],
    pub(super) stature: Stature,
}

impl Rig {
    pub(super) fn new(character: &Character) -> Result<Self, MotionError> {
        let skeleton = &character.skeleton;
        check_joints(skeleton)?;
        let (soles, ground) = soles(character)?;
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
        if !(stature.height > 0.1 && stature.leg > 0.05) {
            return Err(MotionError::NoLegs);
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

    /// Hip joint as seen from the pelvis joint, axes of the bind pose.
    pub(super) fn hip(&self, side: Side) -> Vec3 {
        self.joints[1 + side.index()] - self.joints[0]
    }

    /// The pose. Its `trans` puts the ground at world height zero.
    pub(super) fn pose(&self, posture: &Posture) -> Pose {
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
        let [thigh, shank] = self.two_bones(side, foot.ankle - hip, facing + toes, foot.airborne);
        world[1 + i] = thigh * self.limb_from_bone[1 + i];
        world[4 + i] = shank * self.limb_from_bone[4 + i];
        world[7 + i] = foot.foot * self.bind[7 + i];
        world[10 + i] = foot.toes * self.bind[10 + i];
    }

    /// Rotations of thigh and shank (−Y along the bone, +Z to the front of the knee) that bring the
    /// ankle to `reach` from the hip, the knee bending towards `front`.
    fn two_bones(&self, side: Side, reach: Vec3, front: Vec3, airborne: f32) -> [Quat; 2] {
        let i = side.index();
        let a = self.joints[1 + i].distance(self.joints[4 + i]);
        let b = self.joints[4 + i].distance(self.joints[7 + i]);
        let limit = |k: usize| {
            let share = REACH_ON_GROUND[k] + (REACH_IN_AIR[k] - REACH_ON_GROUND[k]) * airborne;
            share * (a + b)
        };
        let d = soft_reach(reach.length(), [limit(0), limit(1)]).max((a - b).abs() + 1e-3);
        let down = reach.normalize_or(Vec3::NEG_Y);
        let ahead = (front - down * front.dot(down)).normalize_or(Vec3::Z);
        let hinge = ahead.cross(down);
        let cosine = ((a * a + d * d - b * b) / (2.0 * a * d)).clamp(-1.0, 1.0);
        let knee = (down * cosine + ahead * (1.0 - cosine * cosine).sqrt()) * a;
        let basis = |bone: Vec3| {
            let y = -bone.normalize_or(Vec3::NEG_Y);
            Quat::from_mat3(&Mat3::from_cols(hinge, y, hinge.cross(y)))
        };
        [basis(knee), basis(down * d - knee)]
    }
}

/// The same rotation with an angle of at most π, for whoever reads it as an axis and an angle.
fn shortest(rotation: Quat) -> Quat {
    if rotation.w < 0.0 { -rotation } else { rotation }
}

/// The arm's axis (±X) turned from the T-pose to hang at the side, lifted sideways by the abduction.
fn lowered(arm: Arm, sign: f32) -> Quat {
    Quat::from_rotation_z(-sign * (FRAC_PI_2 - arm.abduction)) * Quat::from_rotation_x(arm.rotation)
}

/// How far the collar bone lifts with the upper arm: a twelfth of the angle when the arm is level, a
/// seventh when it points up (scapulohumeral rhythm, the shoulder blade's part left out).
fn collar_lift(arm: Arm, sign: f32) -> f32 {
    let bone = Quat::from_rotation_x(-arm.flexion) * lowered(arm, sign) * (Vec3::X * sign);
    0.11 * (1.0 + bone.y).powi(2)
}

/// Length of a leg that should span `wanted`: the same up to `start`, then ever more slowly towards
/// `end`; slope and curvature continue.
fn soft_reach(wanted: f32, [start, end]: [f32; 2]) -> f32 {
    let x = ((wanted - start) / (end - start)).max(0.0);
    wanted.min(start) + (end - start) * x / (1.0 + x * x * x).cbrt()
}

fn check_joints(skeleton: &Skeleton) -> Result<(), MotionError> {
    if skeleton.len() != JOINTS {
        return Err(MotionError::Joints {
            expected: JOINTS,
            found: skeleton.len(),
        });
    }
    match (0..JOINTS).find(|&j| skeleton.parents()[j] != parent_of(j)) {
        None => Ok(()),
        Some(joint) => Err(MotionError::Parent {
            joint,
            expected: parent_of(joint),
            found: skeleton.parents()[joint],
        }),
    }
}

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
