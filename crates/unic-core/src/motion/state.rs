//! State that motion vectors are made from, one frame at a time.

use super::frame::{Frame, Step, write_contacts, write_pose, write_velocities};
use super::springs::Masses;
use super::{MotionError, MotionLayout, MotionSpec, VelocityScheme, motion_len};
use crate::{
    heading::Heading,
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Input of one frame.
#[derive(Clone, Copy, Debug)]
pub struct MotionInput<'a> {
    /// Pose of this frame.
    pub pose: &'a Pose,
    /// Pose of the next frame, where it is known; only [`VelocityScheme::Forward`] reads it.
    pub next_pose: Option<&'a Pose>,
    /// Height of the ground under the character, metres, world space.
    pub ground_height: f32,
    /// Seconds since the previous frame, and to the next one; above zero.
    pub dt: f32,
    /// Velocity of the air, m/s, world space; linear velocities are relative to it.
    pub wind: Vec3,
}

/// Velocities in the vector of frame 0, which need a second pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum FirstVelocities {
    /// Zero until the second pose is known.
    Awaited,
    /// Computed from the first two poses.
    Known,
}

/// The last two motion vectors of a moving character, and everything that the next one depends on.
///
/// Call [`start`](Self::start) on the first frame and after every cut or teleport, then
/// [`advance`](Self::advance) once a frame. The first advance completes c_0, whose velocities need
/// a second pose. A state that is serialised and read back continues with the same bytes.
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
///     springs: JointSprings::default(),
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
    /// Joint transforms of the next frame; scratch memory of `write_vector`, kept to save
    /// allocations.
    next_world_from_joint: Vec<Rigid>,
    vector: Vec<f32>,
    previous_vector: Vec<f32>,
    ground_height: f32,
    first: FirstVelocities,
    /// Masses on the springs, at their joints while the first velocities are awaited.
    masses: Masses,
}

impl MotionState {
    /// Makes the state of frame 0.
    ///
    /// Until the first advance both vectors of the pair are c_0. Its velocities and springs are zero
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
            (VelocityScheme::Forward, Some(_)) => FirstVelocities::Known,
            _ => FirstVelocities::Awaited,
        };
        let zeros = vec![0.0; spec.len(skeleton.len())];
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
            masses: Masses::at_joints(&spec.springs),
        };
        if first == FirstVelocities::Known {
            state.start_masses(spec, skeleton, input);
        }
        state.write_vector(spec, skeleton, input);
        state.previous_vector.copy_from_slice(&state.vector);
        state
    }

    /// Advances by one frame, after which the pair is (c_{t−1}, c_t). Allocates nothing.
    ///
    /// # Panics
    /// When a pose or the state has another number of joints than the skeleton, or `spec` does not
    /// pass [`MotionSpec::check`].
    pub fn advance(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        // The older buffers are overwritten below.
        std::mem::swap(&mut self.previous_world_from_joint, &mut self.world_from_joint);
        std::mem::swap(&mut self.previous_vector, &mut self.vector);
        skeleton.forward_kinematics(input.pose, &mut self.world_from_joint);
        self.advance_frame(spec.layout, skeleton.root(), input.dt);
        if self.first == FirstVelocities::Awaited {
            self.complete_first(spec, skeleton, input);
            self.first = FirstVelocities::Known;
        }
        self.advance_masses(spec, skeleton, input);
        // Only now: the contacts of c_0 are over the ground of frame 0.
        self.ground_height = input.ground_height;
        self.write_vector(spec, skeleton, input);
    }

    /// Advances the heading and the coordinate frame of the vector.
    fn advance_frame(&mut self, layout: MotionLayout, root: usize, dt: f32) {
        let previous = self.previous_world_from_joint[root].rotation;
        let root = self.world_from_joint[root];
        self.heading.advance(previous, root.rotation, dt);
        self.previous_world_from_frame = self.world_from_frame;
        match layout {
            // The sequence frame stays the same.
            MotionLayout::Paper => {}
            MotionLayout::PaperRootRelative => self.world_from_frame.translation = root.translation,
            MotionLayout::Heading => {
                self.world_from_frame = Rigid::new(self.heading.rotation(), root.translation);
            }
        }
    }

    /// Writes the velocities of c_0 when the second pose x_1 is known, as v_0 = v_1, and starts the
    /// masses on springs.
    ///
    /// With backward differences these are the velocities of c_1, in its frame. With forward
    /// differences they are x_1 − x_0 in the frame of c_0.
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
        // Contacts depend on velocities, so that they are completed too.
        write_contacts(c, spec, from, step, self.ground_height);
        self.masses.start(&spec.springs, step);
        self.masses
            .write(&spec.springs, from, &mut c[motion_len(skeleton.len())..]);
    }

    /// Starts the masses of frame 0 where the next pose is known.
    fn start_masses(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        let Some(next) = input.next_pose else { return };
        skeleton.forward_kinematics(next, &mut self.next_world_from_joint);
        let (from, to) = (&self.world_from_joint, &self.next_world_from_joint);
        let MotionInput { dt, wind, .. } = *input;
        let springs = &mut self.vector[motion_len(skeleton.len())..];
        self.masses.start(&spec.springs, Step { from, to, dt, wind });
        self.masses.write(&spec.springs, from, springs);
    }

    /// Advances the masses on springs.
    fn advance_masses(&mut self, spec: &MotionSpec, skeleton: &Skeleton, input: &MotionInput) {
        let (from, to) = (&self.previous_world_from_joint, &self.world_from_joint);
        let MotionInput { dt, wind, .. } = *input;
        let springs = &mut self.vector[motion_len(skeleton.len())..];
        self.masses.advance(&spec.springs, Step { from, to, dt, wind });
        self.masses.write(&spec.springs, to, springs);
    }

    /// Writes the vector of the current frame, but for its springs.
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

    /// Motion vectors (c_{t−1}, c_t) of [`MotionSpec::len`] numbers each, not normalised.
    pub fn pair(&self) -> (&[f32], &[f32]) {
        (&self.previous_vector, &self.vector)
    }

    /// Transforms `world_from_joint` of all joints at t.
    pub fn world_from_joint(&self) -> &[Rigid] {
        &self.world_from_joint
    }

    /// Transforms `world_from_joint` of all joints at t − 1; at frame 0 those of frame 0.
    pub fn previous_world_from_joint(&self) -> &[Rigid] {
        &self.previous_world_from_joint
    }

    /// Coordinate frame of c_t.
    ///
    /// In layout [`Heading`](MotionLayout::Heading) it is the heading frame at the root joint. In
    /// layout [`Paper`](MotionLayout::Paper) it is the sequence frame. In layout
    /// [`PaperRootRelative`](MotionLayout::PaperRootRelative) it has the orientation of the
    /// sequence frame and its origin at the root joint.
    pub fn world_from_frame(&self) -> Rigid {
        self.world_from_frame
    }

    /// Coordinate frame of c_{t−1}; at frame 0 that of c_0.
    pub fn previous_world_from_frame(&self) -> Rigid {
        self.previous_world_from_frame
    }

    /// Coordinate frame of root-relative states: origin at the root joint at t, orientation of the
    /// frame of c_t.
    ///
    /// Positions in it do not contain the distance travelled. The authors' release does the same:
    /// it subtracts the root's position in every frame and turns by the inverse of the first root
    /// rotation.
    ///
    /// # Panics
    /// When the state is of another skeleton.
    pub fn world_from_state(&self, skeleton: &Skeleton) -> Rigid {
        let root = self.world_from_joint[skeleton.root()];
        Rigid::new(self.world_from_frame.rotation, root.translation)
    }

    /// Checks that a state from a file is of this definition and skeleton, and that its numbers are
    /// finite.
    ///
    /// # Errors
    /// Arrays of another length; a yaw, a height, transforms or vectors that are not finite.
    pub fn check(&self, spec: &MotionSpec, skeleton: &Skeleton) -> Result<(), MotionError> {
        let (joints, numbers) = (skeleton.len(), spec.len(skeleton.len()));
        let masses = spec.springs.masses();
        let lengths = [
            ("joints of a motion state", joints, self.world_from_joint.len()),
            ("previous joints", joints, self.previous_world_from_joint.len()),
            ("a motion vector", numbers, self.vector.len()),
            ("the previous motion vector", numbers, self.previous_vector.len()),
            ("masses on springs", masses, self.masses.len()),
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
        let first_unusable = [
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
            ("mass on a spring", self.masses.first_unusable()),
        ]
        .into_iter()
        .find_map(|(what, element)| Some((what, element?)));
        match first_unusable {
            None => Ok(()),
            Some((what, element)) => Err(MotionError::NotFinite { what, element }),
        }
    }
}
