//! Poses of the caller.

use crate::{
    axes::Axes,
    error::Error,
    memory::{Growing, Plain, Rows, check_count, read, read_sized},
};
use glam::Quat;
use std::mem::{offset_of, size_of};
use unic_core::{Model, Pose, StepInput};

/// Meaning of the root's position in a pose.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicRoot {
    /// World position of the root joint.
    Position = 0,
    /// World position of the root joint minus its rest position, as motion files of SMPL have it.
    Translation = 1,
}

/// Meaning of the rotations in a pose.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnicRotations {
    /// Relative to the parent joint; that of the root relative to the world. Of joints whose own
    /// axes are those of the model, mirrored as the world is.
    Local = 0,
    /// In the world, of the same joints.
    World = 1,
    /// In the world, from the rest pose: those of skinning matrices, such as bone-to-world times
    /// bind pose. They do not depend on the axes of the joints, so that this is the one for rigs
    /// which a tool has exported.
    FromRest = 2,
}

/// Pose of the character. Joints are in the model's order, without scale.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicPose {
    /// Position of the root, in the instance's axes and unit.
    pub root: [f32; 3],
    /// A UnicRoot.
    pub root_kind: u32,
    /// A UnicRotations.
    pub rotation_kind: u32,
    /// Number of rotations, which is the number of joints.
    pub joint_count: u32,
    /// First of the unit quaternions x, y, z, w.
    pub rotations: *const f32,
    /// Bytes from the start of a quaternion to the next; 0 for 16.
    pub rotation_stride: usize,
}

// SAFETY: six numbers of 4 bytes, a pointer and a size, without padding.
unsafe impl Plain for UnicPose {}
const _: () = assert!(size_of::<UnicPose>() == 6 * 4 + 2 * size_of::<usize>(), "padding");

/// Input of a step. Fields that are zero are off.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct UnicStepInput {
    /// Size of the struct in bytes, set by the caller.
    pub size: u32,
    /// Height of the ground under the character, upwards, in the instance's unit.
    pub ground_height: f32,
    /// Velocity of the air, in the instance's axes, units a second.
    pub wind: [f32; 3],
    /// Zero.
    pub reserved: u32,
    /// Pose of this step.
    pub pose: *const UnicPose,
    /// Pose of the next step where it is known, or null. Only models of preset `paper` read it.
    pub next_pose: *const UnicPose,
}

// SAFETY: six numbers of 4 bytes and two pointers, without padding.
unsafe impl Plain for UnicStepInput {}
const _: () = assert!(
    size_of::<UnicStepInput>() == 6 * 4 + 2 * size_of::<usize>(),
    "padding"
);

impl Growing for UnicStepInput {
    const FIRST_SIZE: usize = offset_of!(Self, next_pose) + size_of::<usize>();
}

/// Reads poses of the caller into poses of the animator, without allocation.
#[derive(Debug)]
pub(crate) struct PoseReader {
    axes: Axes,
    /// Global rotations of the bind pose.
    rest_from_joint: Vec<Quat>,
    pose: Pose,
    next_pose: Pose,
}

impl PoseReader {
    pub(crate) fn new(model: &Model, axes: Axes) -> Self {
        let skeleton = &model.character().skeleton;
        let bind_pose = skeleton.bind_pose();
        let mut bind = Vec::new();
        skeleton.forward_kinematics(&bind_pose, &mut bind);
        Self {
            axes,
            rest_from_joint: bind.iter().map(|joint| joint.rotation).collect(),
            next_pose: bind_pose.clone(),
            pose: bind_pose,
        }
    }

    /// Global rotations of the bind pose.
    pub(crate) fn rest_from_joint(&self) -> &[Quat] {
        &self.rest_from_joint
    }

    /// Reads the input of a step.
    ///
    /// # Safety
    /// Pointers are null, misaligned or point to what their types say.
    pub(crate) unsafe fn step_input(
        &mut self,
        model: &Model,
        input: *const UnicStepInput,
    ) -> Result<StepInput<'_>, Error> {
        // SAFETY: passed on.
        let input = unsafe { read_sized("input", input) }?;
        if input.reserved != 0 {
            return Err(Error::value("reserved", "0", input.reserved));
        }
        // SAFETY: passed on.
        unsafe { self.read(model, "pose", input.pose, Which::Now) }?;
        let next_pose = match input.next_pose.is_null() {
            true => None,
            false => {
                // SAFETY: passed on.
                unsafe { self.read(model, "next_pose", input.next_pose, Which::Next) }?;
                Some(&self.next_pose)
            }
        };
        Ok(StepInput {
            pose: &self.pose,
            next_pose,
            ground_height: self.axes.length_in(input.ground_height),
            wind: self.axes.point_in(input.wind),
        })
    }

    /// Reads one pose.
    ///
    /// # Safety
    /// Pointers are null, misaligned or point to what their types say.
    pub(crate) unsafe fn pose(&mut self, model: &Model, pose: *const UnicPose) -> Result<&Pose, Error> {
        // SAFETY: passed on.
        unsafe { self.read(model, "pose", pose, Which::Now) }?;
        Ok(&self.pose)
    }

    /// Reads a pose into one of the two.
    unsafe fn read(
        &mut self,
        model: &Model,
        what: &'static str,
        pose: *const UnicPose,
        which: Which,
    ) -> Result<(), Error> {
        // SAFETY: passed on.
        let given = unsafe { read(what, pose) }?;
        let skeleton = &model.character().skeleton;
        let joints = skeleton.len();
        check_count("number of joints of the pose", joints, given.joint_count as usize)?;
        // SAFETY: passed on.
        let rows =
            unsafe { Rows::<4>::new("rotations", given.rotations.cast(), given.rotation_stride, joints) }?;
        let rotations = GivenRotations {
            rows,
            axes: self.axes,
            kind: given.rotation_kind,
            rest_from_joint: &self.rest_from_joint,
        };
        let out = match which {
            Which::Now => &mut self.pose,
            Which::Next => &mut self.next_pose,
        };
        let root = self.axes.point_in(given.root);
        out.trans = match given.root_kind {
            kind if kind == UnicRoot::Translation as u32 => root,
            kind if kind == UnicRoot::Position as u32 => root - skeleton.joints()[skeleton.root()],
            kind => return Err(Error::value("root_kind", "a value of UnicRoot", kind)),
        };
        for (joint, local) in out.local.iter_mut().enumerate() {
            *local = rotations.local(joint, skeleton.parents()[joint])?;
        }
        Ok(())
    }
}

/// Pose that is read.
#[derive(Clone, Copy, Debug)]
enum Which {
    Now,
    Next,
}

/// Rotations in the caller's memory.
struct GivenRotations<'a> {
    rows: Rows<4>,
    axes: Axes,
    /// Value of a [`UnicRotations`].
    kind: u32,
    rest_from_joint: &'a [Quat],
}

impl GivenRotations<'_> {
    /// Rotation of a joint relative to its parent; relative to the world for the root.
    fn local(&self, joint: usize, parent: Option<usize>) -> Result<Quat, Error> {
        let given = self.given(joint)?;
        if self.kind == UnicRotations::Local as u32 {
            return Ok(given);
        }
        let world_from_joint = self.world_from_joint(given, joint)?;
        let local = match parent {
            None => world_from_joint,
            Some(parent) => self.world_from_joint(self.given(parent)?, parent)?.inverse() * world_from_joint,
        };
        // A product of two rotations is as long as both, and each may be a little off.
        Ok(local.normalize())
    }

    /// Converts a rotation of one of the kinds in the world.
    fn world_from_joint(&self, given: Quat, joint: usize) -> Result<Quat, Error> {
        match self.kind {
            kind if kind == UnicRotations::World as u32 => Ok(given),
            kind if kind == UnicRotations::FromRest as u32 => Ok(given * self.rest_from_joint[joint]),
            kind => Err(Error::value("rotation_kind", "a value of UnicRotations", kind)),
        }
    }

    /// Rotation of a joint as the caller gives it, in the model's axes.
    fn given(&self, joint: usize) -> Result<Quat, Error> {
        let rotation = self.axes.rotation_in(self.rows.get(joint));
        match rotation.is_normalized() {
            true => Ok(rotation),
            false => Err(Error::Rotation {
                joint,
                length: rotation.length(),
            }),
        }
    }
}
