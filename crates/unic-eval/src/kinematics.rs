//! Skeleton poses and motion vectors of a clip, computed once and shared by all predictors.

use glam::Vec3;
use unic_core::{
    character::Character,
    clip::Clip,
    motion::{MotionInput, MotionSpec, MotionState},
    skeleton::Skeleton,
    transform::Rigid,
};
use unic_io::CapturedClip;

/// Joint transforms, heading frames and motion vectors of every frame of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct ClipKinematics {
    /// Number of joints J.
    joints: usize,
    /// Length of a motion vector.
    motion_len: usize,
    /// `world_from_rest` of every joint in every frame, T × J.
    world_from_rest: Vec<Rigid>,
    /// Coordinate frame of each motion vector.
    world_from_frame: Vec<Rigid>,
    /// Coordinate frame of garment positions in each frame.
    world_from_state: Vec<Rigid>,
    /// Motion vectors of all frames, one after another.
    motion: Vec<f32>,
}

impl ClipKinematics {
    /// Computes the kinematics of a clip of this skeleton.
    ///
    /// Baselines read the heading layout. A model's training reads the layout of the model.
    pub fn new(spec: &MotionSpec, skeleton: &Skeleton, clip: &Clip) -> Self {
        let mut all = Self {
            joints: skeleton.len(),
            motion_len: spec.len(skeleton.len()),
            world_from_rest: Vec::new(),
            world_from_frame: Vec::new(),
            world_from_state: Vec::new(),
            motion: Vec::new(),
        };
        let mut state: Option<MotionState> = None;
        for (frame, pose) in clip.poses.iter().enumerate() {
            let input = MotionInput {
                pose,
                next_pose: clip.poses.get(frame + 1),
                ground_height: clip.ground_height,
                dt: 1.0 / clip.fps,
                wind: clip.wind_at(frame),
            };
            match &mut state {
                None => all.push(skeleton, state.insert(MotionState::start(spec, skeleton, &input))),
                Some(state) => {
                    state.advance(spec, skeleton, &input);
                    // The state completes the velocities of frame 0 when frame 1 arrives, so that
                    // the previous motion vector is written again.
                    all.motion.truncate((frame - 1) * all.motion_len);
                    all.motion.extend(state.pair().0);
                    all.push(skeleton, state);
                }
            }
        }
        all
    }

    /// Appends the current frame of the state.
    fn push(&mut self, skeleton: &Skeleton, state: &MotionState) {
        let mut world_from_rest = Vec::new();
        skeleton.world_from_rest(state.world_from_joint(), &mut world_from_rest);
        self.world_from_rest.append(&mut world_from_rest);
        self.world_from_frame.push(state.world_from_frame());
        self.world_from_state.push(state.world_from_state(skeleton));
        self.motion.extend(state.pair().1);
    }

    /// Returns the number of joints J.
    pub fn joints(&self) -> usize {
        self.joints
    }

    /// Returns the number of frames T.
    pub fn len(&self) -> usize {
        self.world_from_frame.len()
    }

    /// Returns whether there are no frames.
    pub fn is_empty(&self) -> bool {
        self.world_from_frame.is_empty()
    }

    /// Returns `world_from_rest` of every joint in one frame.
    pub fn world_from_rest(&self, frame: usize) -> &[Rigid] {
        &self.world_from_rest[frame * self.joints..(frame + 1) * self.joints]
    }

    /// Returns the coordinate frame of the motion vector, which depends on its layout; see
    /// `MotionState::world_from_frame`.
    pub fn world_from_frame(&self, frame: usize) -> Rigid {
        self.world_from_frame[frame]
    }

    /// Returns the coordinate frame of garment positions that are a state. Its origin is the root
    /// joint, its orientation that of the motion vector's frame; see
    /// `MotionState::world_from_state`.
    pub fn world_from_state(&self, frame: usize) -> Rigid {
        self.world_from_state[frame]
    }

    /// Returns the length of a motion vector.
    pub fn motion_len(&self) -> usize {
        self.motion_len
    }

    /// Returns the motion vector c_t of one frame, not normalised.
    pub fn motion(&self, frame: usize) -> &[f32] {
        let len = self.motion_len;
        &self.motion[frame * len..(frame + 1) * len]
    }
}

/// Clip of a capture with its kinematics.
#[derive(Clone, Debug)]
pub struct PreparedClip {
    /// Motion and true garment.
    pub captured: CapturedClip,
    /// Kinematics of every frame.
    pub kinematics: ClipKinematics,
}

impl PreparedClip {
    /// Computes the kinematics of a clip; see [`ClipKinematics::new`].
    pub fn new(spec: &MotionSpec, skeleton: &Skeleton, captured: CapturedClip) -> Self {
        Self {
            kinematics: ClipKinematics::new(spec, skeleton, &captured.clip),
            captured,
        }
    }

    /// Returns the name of the clip, without folder and extension.
    pub fn name(&self) -> &str {
        &self.captured.clip.name
    }

    /// Returns the number of frames that have both a pose and a garment.
    pub fn len(&self) -> usize {
        self.kinematics.len().min(self.captured.garment.len())
    }

    /// Returns whether there are no frames.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Writes the positions of the body's vertices in a frame, world space, metres: the captured ones,
    /// or else those of linear blend skinning.
    pub fn pose_body(&self, character: &Character, frame: usize, out: &mut Vec<Vec3>) {
        match &self.captured.body {
            Some(body) => {
                out.clear();
                out.extend_from_slice(body.frame(frame));
            }
            None => {
                let world_from_rest = self.kinematics.world_from_rest(frame);
                (character.weights).skin(&character.body.vertices, world_from_rest, out);
            }
        }
    }
}
