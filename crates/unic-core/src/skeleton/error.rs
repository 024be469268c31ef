//! Errors of a skeleton's description.

use thiserror::Error;

/// Error of a skeleton's description that is not valid.
#[derive(Debug, Error, PartialEq)]
pub enum SkeletonError {
    /// Array that does not have one entry for each joint.
    #[error("skeleton: expected {expected} {what} (one a joint), found {found}")]
    Length {
        /// Name of the array.
        what: &'static str,
        /// Number of joints.
        expected: usize,
        /// Number of entries of the array.
        found: usize,
    },
    /// Number of roots that is not one.
    #[error("skeleton: expected one root joint (parent -1), found {found}")]
    Roots {
        /// Number of joints without a parent.
        found: usize,
    },
    /// Parent index beyond the joints.
    #[error("skeleton: parent {parent} of joint {joint} is not among the {joints} joints")]
    Parent {
        /// Index of the joint.
        joint: usize,
        /// Index of its parent.
        parent: i64,
        /// Number of joints.
        joints: usize,
    },
    /// Cycle of parents: joints that no path connects to the root.
    #[error("skeleton: joint {joint} is on a cycle of parents")]
    Cycle {
        /// Index of one joint without a path to the root.
        joint: usize,
    },
    /// Number that is NaN or infinite.
    #[error("skeleton: {what} of joint {joint} is not finite")]
    NotFinite {
        /// Name of the value.
        what: &'static str,
        /// Index of the joint.
        joint: usize,
    },
}
