//! The joints of a motion file, for which a character is to be made.

use super::joints::Unknown;
use crate::{
    bvh::{Bvh, is_bvh},
    error::{Error, Result},
    motion::{MotionOptions, smpl_motion},
    retarget::RetargetSource,
    rigged::{RiggedFormat, read_joints_of_motion},
};
use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::transform::Rigid;

/// Height of a body as a multiple of the distance between its highest and lowest joint: crown and soles
/// lie beyond the joints.
const HEIGHT_OF_JOINTS: f32 = 1.12;

/// Joints of a motion file in its rest pose, and their movement; Y up.
#[derive(Clone, Debug)]
pub struct MotionSkeleton {
    pub(super) path: PathBuf,
    pub(super) names: Vec<String>,
    pub(super) parents: Vec<Option<usize>>,
    pub(super) root: usize,
    /// Joints with their parents, in an order in which parents precede their children.
    pub(super) parents_first: Vec<(usize, usize)>,
    /// Places in the rest pose, in the unit of the motion.
    pub(super) joints: Vec<Vec3>,
    pub(super) unknown: Unknown,
    fps: f32,
    /// Rotation from the rest pose and position of each joint in each frame.
    frames: Vec<Vec<Rigid>>,
}

impl MotionSkeleton {
    /// Reads the joints of a motion file: glTF, FBX, USD, BVH, or npz in SMPL's order.
    ///
    /// # Errors
    /// A file that is none of these or is damaged; joints of a BVH file that cannot be identified; a rest
    /// pose in which no body stands.
    pub fn read(path: &Path, options: &MotionOptions) -> Result<Self> {
        if let Some(format) = RiggedFormat::of(path) {
            let bvh = read_joints_of_motion(path, format, options)?;
            return Self::new(path, &bvh, Unknown::Nothing, |joint| joint);
        }
        if !is_bvh(path)? {
            let bvh = smpl_motion(path, options)?;
            return Self::new(path, &bvh, Unknown::Joints, |joint| joint);
        }
        let bvh = Bvh::read(path)?;
        let source = RetargetSource::new(path, &bvh, &options.bones, options.up)?;
        if !source.stands_in_zero_pose() {
            let expected = "a BVH file in whose zero pose the body stands, for a body without a rig";
            return Err(Error::content(path, expected, "another zero pose"));
        }
        let turn = source.world_from_source();
        Self::new(path, &bvh, Unknown::Unit, |joint| {
            Rigid::new(turn * joint.rotation * turn.inverse(), turn * joint.translation)
        })
    }

    fn new(path: &Path, bvh: &Bvh, unknown: Unknown, y_up: impl Fn(Rigid) -> Rigid) -> Result<Self> {
        if bvh.is_empty() {
            return Err(Error::content(path, "at least one frame of motion", "none"));
        }
        let turned = |joints: &[Rigid]| -> Vec<Rigid> { joints.iter().map(|joint| y_up(*joint)).collect() };
        let mut world = Vec::new();
        bvh.world_from_joint_at_zero(&mut world);
        let joints = turned(&world).iter().map(|joint| joint.translation).collect();
        let frame = |frame: usize| {
            bvh.world_from_joint(frame, &mut world);
            turned(&world)
        };
        let frames = (0..bvh.len()).map(frame).collect();
        let names = bvh.joints().iter().map(|joint| joint.name.clone()).collect();
        let parents = bvh.joints().iter().map(|joint| joint.parent).collect();
        Ok(Self {
            path: path.to_path_buf(),
            ..Self::of_joints(names, parents, joints, unknown, bvh.fps(), frames)
        })
    }

    /// Makes the skeleton of joints whose parents precede them; the first is the root.
    pub(super) fn of_joints(
        names: Vec<String>,
        parents: Vec<Option<usize>>,
        joints: Vec<Vec3>,
        unknown: Unknown,
        fps: f32,
        frames: Vec<Vec<Rigid>>,
    ) -> Self {
        let with_parents = parents.iter().enumerate();
        Self {
            path: PathBuf::new(),
            root: 0,
            parents_first: with_parents
                .filter_map(|(joint, parent)| Some((joint, (*parent)?)))
                .collect(),
            names,
            parents,
            joints,
            unknown,
            fps,
            frames,
        }
    }

    /// Frames per second.
    pub fn fps(&self) -> f32 {
        self.fps
    }

    /// Time of the last frame, seconds.
    pub fn seconds(&self) -> f64 {
        (self.frames.len() - 1) as f64 / f64::from(self.fps)
    }

    /// Rotation from the rest pose and position of each joint at a time, between two frames if need be.
    pub(super) fn at(&self, seconds: f64) -> Vec<Rigid> {
        let last = self.frames.len() - 1;
        let frame = (seconds * f64::from(self.fps)).clamp(0.0, last as f64);
        let before = frame.floor() as usize;
        let share = (frame - frame.floor()) as f32;
        let (a, b) = (&self.frames[before], &self.frames[(before + 1).min(last)]);
        let between = |(a, b): (&Rigid, &Rigid)| {
            Rigid::new(
                a.rotation.slerp(b.rotation, share),
                a.translation.lerp(b.translation, share),
            )
        };
        a.iter().zip(b).map(between).collect()
    }

    /// Factor by which the joints are to grow for a body, estimated from the heights of both in one frame.
    pub(super) fn size_for(&self, body: &[Vec3], joints: &[Rigid]) -> f32 {
        let height = |places: &mut dyn Iterator<Item = f32>| {
            let (low, high) = places.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), y| {
                (low.min(y), high.max(y))
            });
            high - low
        };
        let of_joints = height(&mut joints.iter().map(|joint| joint.translation.y));
        let of_body = height(&mut body.iter().map(|place| place.y));
        of_body / (HEIGHT_OF_JOINTS * of_joints).max(f32::MIN_POSITIVE)
    }
}
