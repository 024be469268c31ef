//! Procedural motion for any character with SMPL's joints.
//!
//! A [`Timeline`] of [`Action`]s is performed by a [`Performer`] into a [`Performance`]: a motion as a
//! function of time, to be sampled at any frame rate.
//!
//! How it is made: actions write smooth gestures into [`Channel`]s. Speed and turning rate integrate
//! to a path over the ground. A planner puts footprints beside the path where the body will be, at
//! the rhythm that its [`Stature`] has at that speed, so that a planted foot stays where it is while
//! it rolls over heel and ball. The pelvis rides as high as the legs reach, ballistic while both feet
//! are off the ground; two-bone inverse kinematics joins it to the feet; arms and chest swing against
//! the legs; the head stays level.
//!
//! ```
//! use unic_builtin::human::{HumanParameters, human};
//! use unic_builtin::motion::{Action, Performer, Timeline};
//!
//! let performer = Performer::new(&human(&HumanParameters::default())?)?;
//! let walk = Action::Travel { speed: 1.4, turn_rate: 0.2, seconds: 5.0 };
//! let performance = Timeline::new(7).then(walk).then(Action::Jump { height: 0.2 }).perform(&performer);
//! let clip = performance.clip("walk_and_jump", 30.0);
//! assert_eq!(clip.fps, 30.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! [`standard_set`] gives several minutes of all kinds, to train on and to test on.

mod action;
mod channel;
mod composer;
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

pub use action::{Action, ArmRaise};
pub use channel::{Channel, Side};
pub use gait::{Gait, Stature};
pub use performance::Performance;
pub use standard::{StandardSet, standard_set};
pub use timeline::{Performer, Timeline};

use thiserror::Error;

/// Why a character cannot perform.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum MotionError {
    /// Not SMPL's number of joints.
    #[error("motion: expected the {expected} joints of SMPL, found {found}")]
    Joints {
        /// SMPL's.
        expected: usize,
        /// The character's.
        found: usize,
    },
    /// Another joint tree than SMPL's.
    #[error("motion: expected {expected:?} as the parent of joint {joint}, found {found:?}")]
    Parent {
        /// The joint.
        joint: usize,
        /// Its parent in SMPL's order.
        expected: Option<usize>,
        /// Its parent in the skeleton.
        found: Option<usize>,
    },
    /// No vertex follows the joints of a foot.
    #[error("motion: the body has no vertices on the ankle and foot joints of each side")]
    NoFeet,
    /// Legs without length.
    #[error("motion: the body or its legs have no length")]
    NoLegs,
}
