//! Options of a motion import.

use super::repeat::Repeat;
use crate::{retarget::BoneMap, up_axis::UpAxis};

/// Vertical placement of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GroundPlacement {
    /// [`OnGround`](Self::OnGround) for files of another skeleton or joint layout, or with Z up;
    /// [`Keep`](Self::Keep) for all others.
    #[default]
    Auto,
    /// Keeps the recorded height.
    Keep,
    /// Moves the motion vertically until the body stands on the ground, y = 0. The recorded person
    /// has another leg length than the character.
    OnGround,
}

/// Low-pass filter against the noise of motion capture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum LowPass {
    /// Filters raw motion capture (BVH) at 10 Hz, and no other files.
    #[default]
    Auto,
    /// No filter.
    Off,
    /// Replaces single outlying frames, then removes frequencies above this many Hz.
    Hertz(f32),
}

/// Correction of standing feet that slide or sink (foot locking).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FootLock {
    /// [`Hold`](Self::Hold) for motion of another skeleton (BVH), [`Keep`](Self::Keep) for all
    /// other files.
    #[default]
    Auto,
    /// Keeps the feet as recorded.
    Keep,
    /// Holds feet in place on the ground while they are slow and low.
    Hold,
}

/// Options of [`import_motion`](super::import_motion).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MotionOptions {
    /// Frames per second of the result; `None` keeps the file's.
    pub fps: Option<f32>,
    /// Frames per second of files that do not state them. `None` refuses such npz files.
    pub fps_of_file: Option<f32>,
    /// Metres in a unit of USD files that do not state it; `None` takes the format's own default.
    pub metres_per_unit: Option<f32>,
    /// Up axis of the file.
    pub up: UpAxis,
    /// Vertical placement of the motion.
    pub ground: GroundPlacement,
    /// Body parts of BVH joints whose names are not recognised.
    pub bones: BoneMap,
    /// Filter against the noise of motion capture.
    pub low_pass: LowPass,
    /// Correction of standing feet.
    pub feet: FootLock,
    /// Repetition of a cycle of a short motion, after all other steps.
    pub repeat: Option<Repeat>,
}
