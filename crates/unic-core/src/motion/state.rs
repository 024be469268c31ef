//! Motion vectors, one frame at a time.

use super::frame::{Frame, Step, write_contacts, write_pose, write_velocities};
use super::{MotionError, MotionLayout, MotionSpec, VelocityScheme, motion_len};
use crate::{
    heading::Heading,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// What one frame brings.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// Pose of this frame.
    pub pose: &'a Pose,
    /// Pose of the next frame where it is known; only [`VelocityScheme::Forward`] looks at it.
    pub next_pose: Option<&'a Pose>,
    /// Height of the ground under the character, metres, world space.
    pub ground_height: f32,
    /// Seconds since the previous frame, and to the next one; above zero.
    pub dt: f32,
    /// Velocity of the air, m/s, world space: linear velocities are relative to it.
    pub wind: Vec3,
}

/// Are the velocities of frame 0 in its vector yet?
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Velocities {
    /// They wait for the second pose and are zero until then.
    Awaited,
    Known,
}

/// The last two motion vectors of a moving character and all that the next one depends on.
///
/// [`start`](Self::start) on the first frame and after every cut or teleport, then
/// [`advance`](Self::advance) once a frame. The first advance completes c_0, whose velocities need
/// a second pose. Serialised and read back it goes on with the same bytes.
///
/// ```
/// # use unic_core::{motion::*, skeleton::{Skeleton, SkeletonParts}};
/// # use glam::Vec3;
/// # let skeleton = Skeleton::new(SkeletonParts {
/// #     parents: vec![-1, 0],
/// #     joints: vec![Vec3::Y, Vec3::Y * 0.1],
/// #     ..SkeletonParts::default()
/// # })?;
/// let spec = MotionSpec {
///     layout: MotionLayout::Heading,
///     velocity: VelocityScheme::Backward,
///     contact_joints: [1; 4],
///     contact_rest_heights_m: [0.1; 4],
/// };
/// let mut poses = [skeleton.bind_pose(), skeleton.bind_pose()];
/// poses[1].trans.z = 0.1;
/// let input = |t: usize| MotionInput {
///     pose: &poses[t],
///     next_pose: None,
///     ground_height: 0.0,
///     dt: 1.0 / 30.0,
///     wind: Vec3::ZERO,
/// };
/// let mut motion = MotionState::start(&spec, &skeleton, &input(0));
/// motion.advance(&spec, &skeleton, &input(1));
/// let (before, now) = motion.pair();
/// assert!((now[5] - 3.0).abs() < 1e-5, "forwards at 3 m/s");
/// assert_eq!(before[5], now[5]);
/// # Ok::<(), unic_core::skeleton::SkeletonError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionState {
    heading: Heading,
    world_from_frame: Rigid,
    previous_world_from_frame: Rigid,
    world_from_joint: Vec<Rigid>,
    previous_world_from_joint: Vec<Rigid>,
    /// Of the frame ahead; means something only while a vector is written.
    next_world_from_joint: Vec<Rigid>,
    vector: Vec<f32>,
    previous_vector: Vec<f32>,
    ground_height: f32,
    first: Velocities,
}

impl MotionState {
    /// Frame 0. Until the first advance both vectors of the pair are c_0, with velocities of zero
    /// unless the scheme is forward and the next pose is given.
    ///
    /// # Panics
    /// When a pose has another number of joints than the skeleton, or `spec` does not pass
    /// [`MotionSpec::check`].
    pub fn start(spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) -> Self {
        let mut world_from_joint = Vec::new();
        skeleton.forward_kinematics(input.pose, &mut world_from_joint);
        let root = world_from_joint[skeleton.root()];
        let heading = Heading::start(root.rotation);
        let world_from_frame = match spec.layout {
            MotionLayout::Paper | MotionLayout::PaperRootRelative => root,
            MotionLayout::Heading => Rigid::new(heading.rotation(), root.translation),
        };
        let first = match (spec.velocity, input.next_pose) {
            (VelocityScheme::Forward, Some(_)) => Velocities::Known,
            _ => Velocities::Awaited,
        };
        let zeros = vec![0.0; motion_len(skeleton.len())];
        let mut state = Self {
            heading,
            world_from_frame,
            previous_world_from_frame: world_from_frame,
            previous_world_from_joint: world_from_joint.clone(),
            next_world_from_joint: world_from_joint.clone(),
            world_from_joint,
            vector: zeros.clone(),
            previous_vector: zeros,
            ground_height: input.ground_height,
            first,
        };
        state.write_vector(spec, skeleton, input);
        state.previous_vector.copy_from_slice(&state.vector);
        state
    }

    /// The next frame: afterwards the pair is (c_{t−1}, c_t). Allocates nothing.
    ///
    /// # Panics
    /// As [`start`](Self::start), and when the state is of another skeleton.
    pub fn advance(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        std::mem::swap(&mut self.previous_world_from_joint, &mut self.world_from_joint);
        std::mem::swap(&mut self.previous_vector, &mut self.vector);
        skeleton.forward_kinematics(input.pose, &mut self.world_from_joint);
        self.advance_frame(spec.layout, skeleton.root(), input.dt);
        if self.first == Velocities::Awaited {
            self.complete_first(spec, skeleton, input);
            self.first = Velocities::Known;
        }
        self.ground_height = input.ground_height;
        self.write_vector(spec, skeleton, input);
    }

    fn advance_frame(&mut self, layout: MotionLayout, root: usize, dt: f32) {
        let previous = self.previous_world_from_joint[root].rotation;
        let root = self.world_from_joint[root];
        self.heading.advance(previous, root.rotation, dt);
        self.previous_world_from_frame = self.world_from_frame;
        match layout {
            MotionLayout::Paper => {}
            MotionLayout::PaperRootRelative => self.world_from_frame.translation = root.translation,
            MotionLayout::Heading => {
                self.world_from_frame = Rigid::new(self.heading.rotation(), root.translation);
            }
        }
    }

    /// v_0 := v_1, once x_1 is known: c_1's own velocities in the backward scheme, x_1 − x_0 in the
    /// frame of c_0 in the forward scheme.
    fn complete_first(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        let (from, to) = (&self.previous_world_from_joint, &self.world_from_joint);
        let MotionInput { dt, wind, .. } = *input;
        let step = Step { from, to, dt, wind };
        let frame = match spec.velocity {
            VelocityScheme::Forward => self.previous_world_from_frame,
            VelocityScheme::Backward => self.world_from_frame,
        };
        let c = &mut self.previous_vector;
        write_velocities(c, spec.layout, skeleton, step, frame.rotation);
        write_contacts(c, spec, from, step, self.ground_height);
    }

    fn write_vector(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        let joints = &self.world_from_joint;
        let (from, to) = match (spec.velocity, input.next_pose) {
            (VelocityScheme::Forward, Some(next)) => {
                skeleton.forward_kinematics(next, &mut self.next_world_from_joint);
                (joints, &self.next_world_from_joint)
            }
            _ => (&self.previous_world_from_joint, joints),
        };
        let MotionInput { dt, wind, .. } = *input;
        let step = Step { from, to, dt, wind };
        let frame = Frame {
            world_from_frame: self.world_from_frame,
            ground_height: input.ground_height,
        };
        let c = &mut self.vector;
        write_pose(c, spec.layout, skeleton, input.pose, joints, &frame);
        write_velocities(c, spec.layout, skeleton, step, frame.world_from_frame.rotation);
        write_contacts(c, spec, joints, step, frame.ground_height);
    }

    /// (c_{t−1}, c_t), each of [`motion_len`] numbers, not normalised.
    pub fn pair(&self) -> (&[f32], &[f32]) {
        (&self.previous_vector, &self.vector)
    }

    /// `world_from_joint` of every joint at t.
    pub fn world_from_joint(&self) -> &[Rigid] {
        &self.world_from_joint
    }

    /// `world_from_joint` of every joint at t − 1; at frame 0 those of frame 0.
    pub fn previous_world_from_joint(&self) -> &[Rigid] {
        &self.previous_world_from_joint
    }

    /// The frame of c_t: heading about the vertical with its origin at the root joint; in the
    /// paper's layout the sequence's first root frame, and that turned but with its origin at the
    /// root joint where positions are relative to it.
    pub fn world_from_frame(&self) -> Rigid {
        self.world_from_frame
    }

    /// The frame of c_{t−1}; at frame 0 that of c_0.
    pub fn previous_world_from_frame(&self) -> Rigid {
        self.previous_world_from_frame
    }

    /// The frame of garment positions that are a state: its origin is the root joint at t, its
    /// orientation that of the frame of c_t. Such positions hold no distance travelled, as in the
    /// authors' release, which subtracts the root's position in every frame and turns by the
    /// inverse of the first root rotation.
    ///
    /// # Panics
    /// When the state is of another skeleton.
    pub fn world_from_state(&self, skeleton: &Skeleton) -> Rigid {
        let root = self.world_from_joint[skeleton.root()];
        Rigid::new(self.world_from_frame.rotation, root.translation)
    }

    /// Does a state that comes from a file belong to this skeleton, and is it made of numbers?
    ///
    /// # Errors
    /// Arrays of another length; a yaw, a height, transforms or vectors that are not finite.
    pub fn check(&self, skeleton: &Skeleton) -> Result<(), MotionError> {
        let (joints, numbers) = (skeleton.len(), motion_len(skeleton.len()));
        let lengths = [
            ("joints of a motion state", joints, self.world_from_joint.len()),
            ("previous joints", joints, self.previous_world_from_joint.len()),
            ("a motion vector", numbers, self.vector.len()),
            ("the previous motion vector", numbers, self.previous_vector.len()),
        ];
        match lengths.into_iter().find(|(_, expected, found)| expected != found) {
            None => self.check_numbers(),
            Some((what, expected, found)) => Err(MotionError::Length {
                what,
                expected,
                found,
            }),
        }
    }

    fn check_numbers(&self) -> Result<(), MotionError> {
        let finite = |t: &Rigid| t.rotation.is_finite() && t.translation.is_finite();
        let frames = [self.world_from_frame, self.previous_world_from_frame];
        let first_lost = [
            ("heading", (!self.heading.is_finite()).then_some(0)),
            ("ground height", (!self.ground_height.is_finite()).then_some(0)),
            ("frame", frames.iter().position(|t| !finite(t))),
            ("joint", self.world_from_joint.iter().position(|t| !finite(t))),
            (
                "previous joint",
                self.previous_world_from_joint.iter().position(|t| !finite(t)),
            ),
            (
                "motion vector element",
                self.vector.iter().position(|x| !x.is_finite()),
            ),
            (
                "previous motion vector element",
                self.previous_vector.iter().position(|x| !x.is_finite()),
            ),
        ]
        .into_iter()
        .find_map(|(what, element)| Some((what, element?)));
        match first_lost {
            None => Ok(()),
            Some((what, element)) => Err(MotionError::NotFinite { what, element }),
        }
    }
}
