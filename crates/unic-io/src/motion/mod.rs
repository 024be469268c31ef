//! Reading motion of AMASS-like npz files and of BVH files, and writing npz.
//!
//! The npz layout follows Mahmood et al. 2019, "AMASS: Archive of Motion Capture as Surface
//! Shapes". Joint layouts are those of SMPL (Loper et al. 2015), SMPL-H (Romero et al. 2017) and
//! SMPL-X (Pavlakos et al. 2019).

mod arrays;
mod ground;
mod import;
mod joints;
mod layout;
mod options;
mod plausibility;
mod repeat;
mod smpl;
mod up;
mod write;

pub(crate) use arrays::{MotionArrays, POSE_NAMES};
pub use import::{FootSlide, MotionImport, import_motion};
pub(crate) use joints::JointTarget;
pub use layout::PoseLayout;
pub use options::{FootLock, GroundPlacement, LowPass, MotionOptions};
pub use plausibility::check_motion;
pub(crate) use plausibility::{RootSpeed, max_root_speed};
pub use repeat::{Cycle, Repeat, RepeatedMotion, repeat_cycle};
pub(crate) use smpl::smpl_motion;
pub(crate) use write::write_arrays;
pub use write::write_motion;
