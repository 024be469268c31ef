//! Joint names of programs and motion libraries, and the body parts that they stand for.

mod convention;
mod counterparts;
mod limbs;
mod name;

pub(crate) use convention::{best_convention, feet_by_name};
pub use counterparts::counterparts;
pub(crate) use limbs::{BodySide, LimbJoint};
pub(crate) use name::{JointName, is_same_joint};

/// Name of the array of joint names in motion and character files: one text for each joint.
pub(crate) const ARRAY_NAME: &str = "joint_names";
