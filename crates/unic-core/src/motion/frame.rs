//! Writes the slices of one motion vector.

use super::{MotionLayout, MotionSlices, MotionSpec};
use crate::{
    heading::rotation_vector,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::{Mat3, Quat, Vec3};

/// Squared step below which the paper's layout calls a joint in contact, m².
const PAPER_CONTACT_STEP_SQUARED: f32 = 0.002;
/// Speed below which a foot stands, m/s: planted feet in motion capture drift by less, swinging
/// ones pass 1 m/s.
const CONTACT_SPEED: f32 = 0.25;
/// How far above its rest height a standing foot's joint may be, metres: ankles of planted feet
/// rise by 2 cm, and motion carried over from another body floats by as much again.
const CONTACT_HEIGHT: f32 = 0.05;
/// Time steps below this have no velocity, seconds.
const LEAST_STEP: f32 = 1e-6;

/// The frame that a motion vector is expressed in, and the height of the ground then.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub(super) world_from_frame: Rigid,
    pub(super) ground_height: f32,
}

/// Two successive frames' `world_from_joint`, whose difference is a velocity.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    pub(super) from: &'a [Rigid],
    pub(super) to: &'a [Rigid],
    pub(super) dt: f32,
    /// Velocity of the air, m/s, world space.
    pub(super) wind: Vec3,
}

impl Step<'_> {
    /// Factor from differences to the layout's unit of velocity.
    fn rate(&self, layout: MotionLayout) -> f32 {
        match layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => 1.0,
            MotionLayout::Heading if self.dt >= LEAST_STEP => self.dt.recip(),
            MotionLayout::Heading => 0.0,
        }
    }

    /// Over the ground.
    fn difference(&self, joint: usize) -> Vec3 {
        self.to[joint].translation - self.from[joint].translation
    }

    /// Through the air.
    fn difference_in_air(&self, joint: usize) -> Vec3 {
        self.difference(joint) - self.wind * self.dt
    }
}

/// Position, orientation, joint rotations and joint positions.
pub(super) fn write_pose(
    c: &mut [f32],
    layout: MotionLayout,
    skeleton: &Skeleton,
    pose: &Pose,
    world_from_joint: &[Rigid],
    frame: &Frame,
) {
    let slices = MotionSlices::new(skeleton.len());
    let root = world_from_joint[skeleton.root()];
    let frame_from_world = frame.world_from_frame.inverse();
    let root_position = match layout {
        MotionLayout::Paper => frame_from_world.point(root.translation),
        MotionLayout::PaperRootRelative => Vec3::ZERO,
        MotionLayout::Heading => Vec3::Y * (root.translation.y - frame.ground_height),
    };
    put(&mut c[slices.root_position], root_position);
    let orientation = frame_from_world.rotation * root.rotation;
    c[slices.root_orientation].copy_from_slice(&rotation_6d(orientation));
    let rotations = c[slices.joint_rotations].chunks_exact_mut(6);
    for (out, joint) in rotations.zip(local_joints(skeleton)) {
        out.copy_from_slice(&rotation_6d(pose.local[joint]));
    }
    let positions = c[slices.joint_positions].chunks_exact_mut(3);
    for (out, joint) in positions.zip(local_joints(skeleton)) {
        // Subtracting before rotating keeps the digits of a character far from the origin.
        let offset = world_from_joint[joint].translation - frame.world_from_frame.translation;
        put(out, frame_from_world.vector(offset));
    }
}

/// Linear velocities of the root and the joints, angular velocity of the root.
///
/// What cloth feels of a steady motion is the air: to run at 3 m/s is to stand in a wind of 3 m/s
/// (Galileo). So linear velocities are relative to the air, and wind needs no input of its own.
pub(super) fn write_velocities(
    c: &mut [f32],
    layout: MotionLayout,
    skeleton: &Skeleton,
    step: Step,
    world_from_frame: Quat,
) {
    let slices = MotionSlices::new(skeleton.len());
    let root = skeleton.root();
    let frame_from_world = world_from_frame.conjugate();
    let velocity = |world: Vec3| frame_from_world * world * step.rate(layout);
    put(
        &mut c[slices.root_velocity],
        velocity(step.difference_in_air(root)),
    );
    let turn = step.to[root].rotation * step.from[root].rotation.conjugate();
    let angular = velocity(rotation_vector(turn));
    put(&mut c[slices.root_angular_velocity], angular);
    let velocities = c[slices.joint_velocities].chunks_exact_mut(3);
    for (out, joint) in velocities.zip(local_joints(skeleton)) {
        put(out, velocity(step.difference_in_air(joint)));
    }
}

/// Contacts of the frame whose joints are `world_from_joint`, moving as `step` says.
pub(super) fn write_contacts(
    c: &mut [f32],
    spec: &MotionSpec,
    world_from_joint: &[Rigid],
    step: Step,
    ground_height: f32,
) {
    let slices = MotionSlices::new(world_from_joint.len());
    let joints = spec.contact_joints.into_iter();
    let contacts = joints.zip(spec.contact_rest_heights_m).map(|(joint, rest)| {
        let difference = step.difference(joint);
        let height = world_from_joint[joint].translation.y - ground_height;
        match spec.layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => {
                difference.length_squared() < PAPER_CONTACT_STEP_SQUARED
            }
            MotionLayout::Heading => {
                difference.length() * step.rate(spec.layout) < CONTACT_SPEED && height < rest + CONTACT_HEIGHT
            }
        }
    });
    for (out, contact) in c[slices.contacts].iter_mut().zip(contacts) {
        *out = if contact { 1.0 } else { 0.0 };
    }
}

/// All joints but the root, in the skeleton's order.
fn local_joints(skeleton: &Skeleton) -> impl Iterator<Item = usize> + use<> {
    let root = skeleton.root();
    (0..skeleton.len()).filter(move |&joint| joint != root)
}

/// First two rows of the rotation matrix. (Zhou et al. 2019 take columns, pytorch3d takes rows.)
fn rotation_6d(rotation: Quat) -> [f32; 6] {
    let matrix = Mat3::from_quat(rotation);
    let (first, second) = (matrix.row(0), matrix.row(1));
    [first.x, first.y, first.z, second.x, second.y, second.z]
}

fn put(out: &mut [f32], value: Vec3) {
    out.copy_from_slice(&value.to_array());
}
