//! Procedural motion for any character with SMPL's joints.
//!
//! A [`Performer`] turns a [`Timeline`] of [`Action`]s into a [`Performance`]: a motion as a
//! function of time, which can be sampled at any frame rate. It is made in these steps:
//!
//! 1. Actions write smooth gestures into [`Channel`]s.
//! 2. Speed and turning rate integrate to a path over the ground.
//! 3. A planner puts footprints beside the path, at the rhythm that a body of this [`Stature`] has
//!    at this speed. A planted foot stays in place while it rolls over heel and ball.
//! 4. The pelvis is as high as the legs reach, and in free fall while both feet are off the ground.
//! 5. Two-bone inverse kinematics joins the pelvis to the feet. Arms and chest swing against the
//!    legs, and the head stays level.
//!
//! ```
//! use unic_builtin::human::{HumanParameters, human};
//! use unic_builtin::motion::{Action, Performer, Timeline};
//!
//! let performer = Performer::new(&human(&HumanParameters::default())?)?;
//! let walk = Action::Travel { speed: 1.4, turn_rate: 0.2, seconds: 5.0 };
//! let timeline = Timeline::new(7).then(walk).then(Action::Jump { height: 0.2 });
//! let performance = timeline.perform(&performer);
//! let clip = performance.clip("walk_and_jump", 30.0);
//! assert_eq!(clip.fps, 30.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`standard_set`] makes several minutes of training clips and test clips, [`standard_clip`] one of
//! them. [`control_set`] makes clips for interactive control.

mod action;
mod channel;
mod composer;
mod control;
mod curve;
mod dance;
mod foot;
mod footsteps;
mod gait;
mod path;
mod performance;
mod random;
mod rig;
mod script;
mod sole;
mod standard;
mod timeline;
mod tracks;

#[cfg(test)]
mod tests;

pub use crate::side::Side;
pub use action::{Action, ArmRaise};
pub use channel::Channel;
pub use control::control_set;
pub use gait::{Gait, Stature};
pub use performance::Performance;
pub use standard::{STANDARD_CLIPS, STANDARD_SEED, StandardSet, standard_clip, standard_set};
pub use timeline::{Performer, Timeline};

use thiserror::Error;

/// Reason why a character cannot perform built-in motion.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum PerformerError {
    /// The skeleton does not have SMPL's number of joints.
    #[error("motion: expected the {expected} joints of SMPL, found {found}")]
    Joints {
        /// Number of SMPL's joints.
        expected: usize,
        /// Number of the character's joints.
        found: usize,
    },
    /// The skeleton's joint tree is not SMPL's.
    #[error("motion: expected {expected:?} as the parent of joint {joint}, found {found:?}")]
    Parent {
        /// Index of the joint with another parent.
        joint: usize,
        /// Parent of the joint in SMPL's tree; none for the root.
        expected: Option<usize>,
        /// Parent of the joint in the skeleton.
        found: Option<usize>,
    },
    /// No vertex follows the joints of a foot.
    #[error("motion: the body has no vertices on the ankle and foot joints of each side")]
    NoFeet,
    /// The body or its legs have almost no length.
    #[error("motion: the body or its legs have no length")]
    NoLegs,
}
