//! Errors of a database.

use crate::skeleton::SkeletonError;
use thiserror::Error;

/// Error: clips or settings that do not make a database.
#[derive(Debug, Error, PartialEq)]
pub enum DatabaseError {
    /// No clip has enough frames.
    #[error("motion database: expected a clip longer than the margin at its end, found none")]
    NoFrames,
    /// More frames than an index counts.
    #[error("motion database: expected at most {expected} frames, found {found}")]
    TooManyFrames {
        /// Largest number.
        expected: usize,
        /// Number of frames, mirrored ones included.
        found: usize,
    },
    /// A clip with another frame rate than the first one.
    #[error("motion database: expected {expected} frames a second in clip `{clip}`, found {found}")]
    FrameRate {
        /// Name of the clip.
        clip: String,
        /// Rate of the first clip.
        expected: f32,
        /// Rate of the clip.
        found: f32,
    },
    /// A pose with another number of joints than the skeleton, or numbers that are not finite.
    #[error("motion database: frame {frame} of clip `{clip}` is no pose of the skeleton's {joints} joints")]
    Pose {
        /// Name of the clip.
        clip: String,
        /// Index of the frame in the clip.
        frame: usize,
        /// Number of joints of the skeleton.
        joints: usize,
    },
    /// An array of another length.
    #[error("motion database: expected {expected} {what}, found {found}")]
    Count {
        /// Content of the array.
        what: &'static str,
        /// Length that is needed.
        expected: usize,
        /// Length of the array.
        found: usize,
    },
    /// A joint that the skeleton does not have.
    #[error("motion database: joint {joint} is not among the {joints} joints")]
    Joint {
        /// Index of the joint.
        joint: usize,
        /// Number of joints.
        joints: usize,
    },
    /// A setting that is not usable.
    #[error("motion database: expected a usable {what}, found one that is not")]
    Number {
        /// Name of the setting.
        what: &'static str,
    },
    /// Numbers that are not finite or too far from the origin.
    #[error("motion database: expected usable {what}, found some that are not")]
    Content {
        /// Name of the numbers.
        what: &'static str,
    },
    /// Joints that do not make a skeleton.
    #[error(transparent)]
    Skeleton(#[from] SkeletonError),
}

pub(super) fn check_count(what: &'static str, expected: usize, found: usize) -> Result<(), DatabaseError> {
    match expected == found {
        true => Ok(()),
        false => Err(DatabaseError::Count {
            what,
            expected,
            found,
        }),
    }
}
