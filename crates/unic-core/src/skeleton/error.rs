//! Errors of a skeleton's description.

use thiserror::Error;

/// What is wrong with a skeleton's description.
#[derive(Debug, Error, PartialEq)]
pub enum SkeletonError {
    /// Arrays that should have one entry a joint differ in length.
    #[error("skeleton: expected {expected} {what} (one a joint), found {found}")]
    Length {
        /// Which array.
        what: &'static str,
        /// Number of joints.
        expected: usize,
        /// Entries found.
        found: usize,
    },
    /// No root, or more than one.
    #[error("skeleton: expected one root joint (parent -1), found {found}")]
    Roots {
        /// Joints without a parent.
        found: usize,
    },
    /// A parent index outside the skeleton.
    #[error("skeleton: parent {parent} of joint {joint} is not among the {joints} joints")]
    Parent {
        /// Joint whose parent is wrong.
        joint: usize,
        /// The index found.
        parent: i64,
        /// Number of joints.
        joints: usize,
    },
    /// Joints that no path connects to the root.
    #[error("skeleton: joint {joint} is on a cycle of parents")]
    Cycle {
        /// One joint on it.
        joint: usize,
    },
    /// NaN or infinity.
    #[error("skeleton: {what} of joint {joint} is not finite")]
    NotFinite {
        /// Which array.
        what: &'static str,
        /// The joint.
        joint: usize,
    },
}
