//! Slices of one motion vector: poses, velocities and contacts.

use super::{MotionLayout, MotionSlices, MotionSpec};
use crate::{
    heading::rotation_vector,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::{Mat3, Quat, Vec3};

/// Squared movement a frame below which the paper's layouts call a joint in contact, m².
pub const PAPER_CONTACT_STEP_SQUARED_M2: f32 = 0.002;
/// Speed below which a foot is in contact, m/s. Planted feet in motion capture drift by less,
/// swinging feet exceed 1 m/s.
pub const CONTACT_SPEED_M_S: f32 = 0.25;
/// Height above its rest height below which a foot's joint is in contact, metres. Ankles of planted
/// feet rise by 2 cm, and retargeted motion floats by as much again.
pub const CONTACT_HEIGHT_M: f32 = 0.05;
/// Shortest time step that velocities are computed for, seconds; below it they are zero.
const MIN_STEP: f32 = 1e-6;

/// Coordinate frame of a motion vector, and the height of the ground.
#[derive(Clone, Copy)]
pub(super) struct Frame {
    pub(super) world_from_frame: Rigid,
    /// Height of the ground in world space, metres.
    pub(super) ground_height: f32,
}

/// Joint transforms of two successive frames, whose differences are velocities.
#[derive(Clone, Copy)]
pub(super) struct Step<'a> {
    /// `world_from_joint` of the earlier frame.
    pub(super) from: &'a [Rigid],
    /// `world_from_joint` of the later frame.
    pub(super) to: &'a [Rigid],
    /// Seconds between the frames.
    pub(super) dt: f32,
    /// Velocity of the air, m/s, world space.
    pub(super) wind: Vec3,
}

impl Step<'_> {
    /// Returns the factor from differences to the layout's unit of velocity.
    fn rate(&self, layout: MotionLayout) -> f32 {
        match layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => 1.0,
            // The quotient of a zero time step would be infinite.
            MotionLayout::Heading if self.dt >= MIN_STEP => self.dt.recip(),
            MotionLayout::Heading => 0.0,
        }
    }

    /// Returns the movement of a joint in the world, metres.
    fn difference(&self, joint: usize) -> Vec3 {
        self.to[joint].translation - self.from[joint].translation
    }

    /// Returns the velocity of a joint in the world, m/s; zero for a step without duration.
    pub(super) fn velocity(&self, joint: usize) -> Vec3 {
        match self.dt >= MIN_STEP {
            true => self.difference(joint) / self.dt,
            false => Vec3::ZERO,
        }
    }

    /// Returns the movement of a joint relative to the air, metres.
    fn difference_in_air(&self, joint: usize) -> Vec3 {
        self.difference(joint) - self.wind * self.dt
    }
}

/// Writes positions and rotations of the root and the joints.
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
        // Without the horizontal position, on which no garment depends.
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

/// Writes velocities of the root and the joints, and the angular velocity of the root.
///
/// Linear velocities are relative to the air, so that wind needs no input of its own: for the
/// cloth, running at 3 m/s is the same as standing in a wind of 3 m/s.
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
    // In world axes; `velocity` turns it into the frame of the vector.
    let turn = step.to[root].rotation * step.from[root].rotation.conjugate();
    let angular = velocity(rotation_vector(turn));
    put(&mut c[slices.root_angular_velocity], angular);
    let velocities = c[slices.joint_velocities].chunks_exact_mut(3);
    for (out, joint) in velocities.zip(local_joints(skeleton)) {
        put(out, velocity(step.difference_in_air(joint)));
    }
}

/// Writes the contacts of the frame with joints at `world_from_joint`, which move by `step`.
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
        // Over the ground: wind does not lift a foot.
        let difference = step.difference(joint);
        let height = world_from_joint[joint].translation.y - ground_height;
        match spec.layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => {
                difference.length_squared() < PAPER_CONTACT_STEP_SQUARED_M2
            }
            MotionLayout::Heading => {
                difference.length() * step.rate(spec.layout) < CONTACT_SPEED_M_S
                    && height < rest + CONTACT_HEIGHT_M
            }
        }
    });
    for (out, contact) in c[slices.contacts].iter_mut().zip(contacts) {
        *out = if contact { 1.0 } else { 0.0 };
    }
}

/// Lists all joints but the root, in the skeleton's order.
fn local_joints(skeleton: &Skeleton) -> impl Iterator<Item = usize> + use<> {
    let root = skeleton.root();
    (0..skeleton.len()).filter(move |&joint| joint != root)
}

/// Returns the first two rows of the rotation matrix, as pytorch3d does; Zhou et al. 2019 take
/// columns.
fn rotation_6d(rotation: Quat) -> [f32; 6] {
    let matrix = Mat3::from_quat(rotation);
    let (first, second) = (matrix.row(0), matrix.row(1));
    [first.x, first.y, first.z, second.x, second.y, second.z]
}

fn put(out: &mut [f32], value: Vec3) {
    out.copy_from_slice(&value.to_array());
}
