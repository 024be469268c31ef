//! The joints of a motion file, for which a character is to be made.

use super::joints::Unknown;
use crate::{
    bvh::{Bvh, is_bvh},
    error::{Error, Result},
    foreign_formats::refuse_foreign,
    motion::{MotionOptions, smpl_motion},
    retarget::RetargetSource,
    rigged::{RiggedFormat, read_joints_of_motion},
};
use glam::{Quat, Vec3};
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
    /// Rotation of the rest pose before the root's movement is added, where Z up was converted: the root
    /// of the rest pose is at this rotation of its place.
    pub(super) root_turn: Quat,
    /// Rotation from the file's axes to Y up.
    world_from_source: Quat,
    /// Frames are computed when they are asked for: a file may hold millions.
    bvh: Bvh,
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
            return Self::new(path, bvh, Unknown::Nothing, Quat::IDENTITY);
        }
        refuse_foreign(path, "a motion (npz, BVH, glTF, FBX or USD)")?;
        if !is_bvh(path)? {
            let motion = smpl_motion(path, options)?;
            let skeleton = Self::new(path, motion.bvh, Unknown::Joints, Quat::IDENTITY)?;
            return Ok(Self {
                root_turn: motion.y_up_from_source,
                ..skeleton
            });
        }
        let bvh = Bvh::read(path)?;
        let source = RetargetSource::new(path, &bvh, &options.bones, options.up)?;
        if !source.stands_in_zero_pose() {
            let expected = "a BVH file whose zero pose is a standing body's, for a body without a rig";
            let found = "another zero pose; export FBX or glTF, or the BVH from the T-pose";
            return Err(Error::content(path, expected, found));
        }
        let turn = source.world_from_source();
        Self::new(path, bvh, Unknown::Unit, turn)
    }

    pub(super) fn new(path: &Path, bvh: Bvh, unknown: Unknown, world_from_source: Quat) -> Result<Self> {
        if bvh.is_empty() {
            return Err(Error::content(path, "at least one frame of motion", "none"));
        }
        let parents: Vec<Option<usize>> = bvh.joints().iter().map(|joint| joint.parent).collect();
        let roots = parents.iter().filter(|parent| parent.is_none()).count();
        if roots != 1 || parents[0].is_some() {
            let found = format!("{roots} roots");
            return Err(Error::content(path, "joints with one root", found));
        }
        let mut world = Vec::new();
        bvh.world_from_joint_at_zero(&mut world);
        let with_parents = parents.iter().enumerate();
        Ok(Self {
            path: path.to_path_buf(),
            names: bvh.joints().iter().map(|joint| joint.name.clone()).collect(),
            root: 0,
            parents_first: with_parents
                .filter_map(|(joint, parent)| Some((joint, (*parent)?)))
                .collect(),
            parents,
            joints: (world.iter().map(|joint| world_from_source * joint.translation)).collect(),
            unknown,
            root_turn: Quat::IDENTITY,
            world_from_source,
            bvh,
        })
    }

    /// Frames per second.
    pub fn fps(&self) -> f32 {
        self.bvh.fps()
    }

    /// Time of the last frame, seconds.
    pub fn seconds(&self) -> f64 {
        (self.bvh.len() - 1) as f64 / f64::from(self.fps())
    }

    /// Rotation from the rest pose and position of each joint at a time, between two frames if need be.
    pub(super) fn at(&self, seconds: f64) -> Vec<Rigid> {
        let last = self.bvh.len() - 1;
        let frame = (seconds * f64::from(self.fps())).clamp(0.0, last as f64);
        let before = frame.floor() as usize;
        let share = (frame - frame.floor()) as f32;
        let (mut a, mut b) = (Vec::new(), Vec::new());
        self.bvh.world_from_joint(before, &mut a);
        self.bvh.world_from_joint((before + 1).min(last), &mut b);
        let turn = self.world_from_source;
        let between = |(a, b): (&Rigid, &Rigid)| {
            let rotation = a.rotation.slerp(b.rotation, share);
            let place = a.translation.lerp(b.translation, share);
            Rigid::new(turn * rotation * turn.inverse(), turn * place)
        };
        a.iter().zip(&b).map(between).collect()
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
