//! Motion of files with a rig on a character.

use super::{
    RiggedFormat,
    file::SceneFile,
    request,
    rig::{Rig, RigJoint, RigScratch},
};
use crate::{
    bvh::{Bvh, RestJoint},
    error::Result,
    gltf::humanoid_bones,
    motion::MotionOptions,
    retarget::{BoneMap, FileUnit, ReferenceJoint, RetargetSource, Retargeted, SameSkeleton},
    up_axis::UpAxis,
};
use std::path::Path;
use unic_core::{character::Character, clip::Clip, skeleton::Skeleton, transform::Rigid};
use unic_scene::{Assumed, Content, Motion};

/// Distance of a joint from its place on a character of rigid bones that is worth a note, metres.
const NOTED_STRETCH_M: f32 = 5e-3;
/// Motion of a file on a character.
pub(crate) struct RiggedMotion {
    pub(crate) clip: Clip,
    /// Descriptions of the conversions, one sentence each.
    pub(crate) notes: Vec<String>,
    pub(crate) transfer: RiggedTransfer,
}

/// How a motion came to the character.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RiggedTransfer {
    /// The file has the character's own joints.
    SameRig,
    /// The file has another skeleton.
    Retargeted,
}

/// Animation and rig of a file.
pub(super) struct AnimatedRig<'a> {
    file: &'a SceneFile,
    rig: Rig,
    pub(super) motion: &'a Motion,
    pub(super) notes: Vec<String>,
}

impl<'a> AnimatedRig<'a> {
    /// Makes the rig of the first animation of a file.
    ///
    /// # Errors
    /// No animation; those of [`Rig::of_motion`].
    pub(super) fn new(file: &'a SceneFile) -> Result<Self> {
        let Some(motion) = &file.scene.motion else {
            return Err(file.error("an animation", "none"));
        };
        let rig = Rig::of_motion(file, motion)?;
        let mut notes: Vec<String> = file.scene.notes.iter().chain(&rig.notes).cloned().collect();
        let count = file.scene.animations.len();
        let name = motion.name.as_deref().unwrap_or("without a name");
        if count > 1 {
            notes.push(format!("the first of {count} animations is taken: {name}"));
        }
        notes.push(format!(
            "{} frames at {} fps {}",
            motion.frames, motion.fps, motion.rate
        ));
        Ok(Self {
            file,
            rig,
            motion,
            notes,
        })
    }

    /// Calls `use_frame` with the joints of each frame: rotation from the bind pose, and position.
    fn for_each_frame(&self, mut use_frame: impl FnMut(&[Rigid])) {
        let (mut scratch, mut joints) = (RigScratch::default(), Vec::new());
        for frame in 0..self.motion.frames {
            self.rig
                .frame(self.file, self.motion, frame, &mut scratch, &mut joints);
            use_frame(&joints);
        }
    }
}

/// Reads the motion of a file for a character.
///
/// # Errors
/// No animation, damaged data, joints that cannot be identified.
pub(crate) fn read_motion(
    path: &Path,
    format: RiggedFormat,
    character: &Character,
    options: &MotionOptions,
) -> Result<RiggedMotion> {
    let file = read_file(path, format, options)?;
    let animated = AnimatedRig::new(&file)?;
    let skeleton = &character.skeleton;
    let joints = references(&animated.rig);
    match SameSkeleton::find(&joints, FileUnit::Metres, skeleton, &skeleton.bind_pose()) {
        Some(same) => on_same_rig(&animated, &same, skeleton),
        None => {
            let bones = match (options.bones.is_empty(), format) {
                (true, RiggedFormat::Gltf) => humanoid_bones(path),
                _ => options.bones.clone(),
            };
            retargeted(&animated, character, &bones)
        }
    }
}

/// Reads all joints of a file and their motion, in metres, Y up: the bind pose is the zero pose.
///
/// # Errors
/// No animation, damaged data.
pub(crate) fn read_joints_of_motion(
    path: &Path,
    format: RiggedFormat,
    options: &MotionOptions,
) -> Result<Bvh> {
    Ok(as_bvh(&AnimatedRig::new(&read_file(path, format, options)?)?))
}

fn read_file(path: &Path, format: RiggedFormat, options: &MotionOptions) -> Result<SceneFile> {
    let assumed = Assumed {
        metres_per_unit: options.metres_per_unit,
        up: options.up.stated(),
        fps: options.fps_of_file,
    };
    SceneFile::read(path, format, &request(Content::Motion, &assumed))
}

fn on_same_rig(animated: &AnimatedRig, same: &SameSkeleton<'_>, skeleton: &Skeleton) -> Result<RiggedMotion> {
    let (mut poses, mut joints) = (Vec::new(), Vec::new());
    let mut farthest = (0.0, skeleton.root());
    let references = references(&animated.rig);
    animated.for_each_frame(|frame| {
        let pose = same.pose(frame);
        skeleton.forward_kinematics(&pose, &mut joints);
        for (joint, place) in same.places(&references, frame) {
            let off = joints[joint].translation.distance(place);
            if off > farthest.0 {
                farthest = (off, joint);
            }
        }
        poses.push(pose);
    });
    if let Some(frame) = poses.iter().position(|pose| !pose.is_valid()) {
        let found = format!("others in frame {frame}");
        return Err(animated.file.error("positions that a body can take", found));
    }
    let mut notes = animated.notes.clone();
    notes.push("the joints are the character's: the motion is taken as it is".into());
    if farthest.0 > NOTED_STRETCH_M {
        notes.push(format!(
            "bones of the file change their lengths, those of the character do not: {} is off by up to {:.0} mm",
            skeleton.names()[farthest.1],
            1e3 * farthest.0
        ));
    }
    Ok(RiggedMotion {
        clip: Clip {
            name: stem(&animated.file.path),
            fps: animated.motion.fps,
            poses,
            ground_height: 0.0,
            wind: Vec::new(),
        },
        notes,
        transfer: RiggedTransfer::SameRig,
    })
}

/// Joints of a rig in its bind pose.
fn references(rig: &Rig) -> Vec<ReferenceJoint<'_>> {
    fn joint(joint: &RigJoint) -> ReferenceJoint<'_> {
        ReferenceJoint {
            name: &joint.name,
            place: joint.position,
        }
    }
    rig.joints.iter().map(joint).collect()
}

fn retargeted(animated: &AnimatedRig, character: &Character, bones: &BoneMap) -> Result<RiggedMotion> {
    let bvh = as_bvh(animated);
    // Readers convert to Y up, whatever is asked for files that do not state their axis.
    let path = &animated.file.path;
    let source = RetargetSource::new(path, &bvh, bones, UpAxis::Y)?;
    let Retargeted { clip, notes } = source.on(path, &bvh, character)?;
    Ok(RiggedMotion {
        clip,
        notes: animated.notes.iter().cloned().chain(notes).collect(),
        transfer: RiggedTransfer::Retargeted,
    })
}

/// Converts a rig to the form that retargeting takes: the bind pose is the zero pose.
fn as_bvh(animated: &AnimatedRig) -> Bvh {
    let order = parents_first(&animated.rig);
    let mut place = vec![0; order.len()];
    order
        .iter()
        .enumerate()
        .for_each(|(index, joint)| place[*joint] = index);
    let joint = |index: &usize| {
        let joint = &animated.rig.joints[*index];
        RestJoint {
            name: joint.name.clone(),
            parent: joint.parent.map(|parent| place[parent]),
            position: joint.position,
        }
    };
    let joints: Vec<RestJoint> = order.iter().map(joint).collect();
    let mut frames = Vec::new();
    animated.for_each_frame(|frame| {
        let world: Vec<Rigid> = order.iter().map(|joint| frame[*joint]).collect();
        Bvh::push_frame(&joints, &world, &mut frames);
    });
    Bvh::from_rest(joints, animated.motion.fps, frames)
}

/// Joints in an order in which parents precede their children.
fn parents_first(rig: &Rig) -> Vec<usize> {
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); rig.joints.len()];
    let mut order = Vec::new();
    for (joint, parent) in rig.joints.iter().map(|joint| joint.parent).enumerate() {
        match parent {
            Some(parent) => children[parent].push(joint),
            None => order.push(joint),
        }
    }
    let mut next = 0;
    while let Some(&joint) = order.get(next) {
        order.extend_from_slice(&children[joint]);
        next += 1;
    }
    order
}

fn stem(path: &Path) -> String {
    path.file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}
