//! What the skeleton does in a clip, computed once and shared by everything that is evaluated on it.

use glam::Vec3;
use unic_core::{
    clip::Clip,
    motion::{MotionInput, MotionSpec, MotionState},
    skeleton::Skeleton,
    transform::Rigid,
};
use unic_io::CapturedClip;

/// Joint transforms, heading frames and motion vectors of every frame of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipKinematics {
    joints: usize,
    /// Numbers in a motion vector.
    motion_len: usize,
    /// T × J.
    world_from_rest: Vec<Rigid>,
    world_from_frame: Vec<Rigid>,
    /// T × `motion_len`.
    motion: Vec<f32>,
}

impl ClipKinematics {
    /// Of a clip of this skeleton in still air: the heading layout for baselines, a model's own for its
    /// training.
    pub fn new(spec: &MotionSpec, skeleton: &Skeleton, clip: &Clip) -> Self {
        Self::in_wind(spec, skeleton, clip, &[])
    }

    /// As [`new`](Self::new), in a wind a frame, m/s, world space; frames without one have none.
    pub fn in_wind(spec: &MotionSpec, skeleton: &Skeleton, clip: &Clip, wind: &[Vec3]) -> Self {
        let mut all = Self {
            joints: skeleton.len(),
            motion_len: spec.vector_len(skeleton.len()),
            world_from_rest: Vec::new(),
            world_from_frame: Vec::new(),
            motion: Vec::new(),
        };
        let mut state: Option<MotionState> = None;
        for (frame, pose) in clip.poses.iter().enumerate() {
            let input = MotionInput {
                pose,
                next_pose: clip.poses.get(frame + 1),
                ground_height: clip.ground_height,
                wind: wind.get(frame).copied().unwrap_or_default(),
                dt: 1.0 / clip.fps,
            };
            match &mut state {
                None => all.push(skeleton, state.insert(MotionState::start(spec, skeleton, &input))),
                Some(state) => {
                    state.advance(spec, skeleton, &input);
                    // Frame 0's velocities are known from frame 1 on.
                    all.motion.truncate((frame - 1) * all.motion_len);
                    all.motion.extend(state.pair().0);
                    all.push(skeleton, state);
                }
            }
        }
        all
    }

    fn push(&mut self, skeleton: &Skeleton, state: &MotionState) {
        let mut world_from_rest = Vec::new();
        skeleton.world_from_rest(state.world_from_joint(), &mut world_from_rest);
        self.world_from_rest.append(&mut world_from_rest);
        self.world_from_frame.push(state.world_from_frame());
        self.motion.extend(state.pair().1);
    }

    /// Number of joints J.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Number of frames T.
    pub fn len(&self) -> usize {
        self.world_from_frame.len()
    }

    /// No frames at all.
    pub fn is_empty(&self) -> bool {
        self.world_from_frame.is_empty()
    }

    /// `world_from_rest` of every joint in one frame.
    pub fn world_from_rest(&self, frame: usize) -> &[Rigid] {
        &self.world_from_rest[frame * self.joints..(frame + 1) * self.joints]
    }

    /// Frame of the motion vector: in the heading layout yaw about +Y with its origin at the root
    /// joint, in the paper's the sequence's first root frame; see `MotionState::world_from_frame`.
    pub fn world_from_frame(&self, frame: usize) -> Rigid {
        self.world_from_frame[frame]
    }

    /// Motion vector c_t of one frame, not normalised.
    pub fn motion(&self, frame: usize) -> &[f32] {
        let len = self.motion_len;
        &self.motion[frame * len..(frame + 1) * len]
    }
}

/// A clip of a capture with its kinematics.
#[derive(Clone, Debug)]
pub struct PreparedClip {
    /// Motion and garment.
    pub captured: CapturedClip,
    /// One entry a frame.
    pub kinematics: ClipKinematics,
}

impl PreparedClip {
    /// See [`ClipKinematics::new`].
    pub fn new(spec: &MotionSpec, skeleton: &Skeleton, captured: CapturedClip) -> Self {
        Self {
            kinematics: ClipKinematics::in_wind(
                spec,
                skeleton,
                &captured.clip,
                captured.wind.as_deref().unwrap_or_default(),
            ),
            captured,
        }
    }

    /// Name, without folder or extension.
    pub fn name(&self) -> &str {
        &self.captured.clip.name
    }

    /// Number of frames with both a pose and a garment.
    pub fn len(&self) -> usize {
        self.kinematics.len().min(self.captured.garment.len())
    }

    /// No frames at all.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
