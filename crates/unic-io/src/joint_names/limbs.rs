//! Joints of arms and legs, by limb joint and side.

/// Side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BodySide {
    Left,
    Right,
}

impl BodySide {
    /// Both sides, in the order of their discriminants.
    pub(crate) const ALL: [BodySide; 2] = [BodySide::Left, BodySide::Right];

    /// Parses a lower-case word for a side.
    pub(super) fn from_word(word: &str) -> Option<Self> {
        match word {
            "l" | "left" => Some(BodySide::Left),
            "r" | "right" => Some(BodySide::Right),
            _ => None,
        }
    }
}

/// Joint of an arm or a leg, with SMPL's terms.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LimbJoint {
    Hip,
    Knee,
    Ankle,
    Toe,
    Collar,
    Shoulder,
    Elbow,
    Wrist,
    Hand,
}

impl LimbJoint {
    /// All limb joints, in the order of their discriminants.
    pub(crate) const ALL: [LimbJoint; 9] = [
        LimbJoint::Hip,
        LimbJoint::Knee,
        LimbJoint::Ankle,
        LimbJoint::Toe,
        LimbJoint::Collar,
        LimbJoint::Shoulder,
        LimbJoint::Elbow,
        LimbJoint::Wrist,
        LimbJoint::Hand,
    ];

    /// Index among [`SMPL_JOINT_NAMES`](unic_core::skeleton::SMPL_JOINT_NAMES).
    pub(crate) fn smpl_joint(self, side: BodySide) -> usize {
        // SMPL lists the right joint behind the left one.
        let left = [1, 4, 7, 10, 13, 16, 18, 20, 22][self as usize];
        match side {
            BodySide::Left => left,
            BodySide::Right => left + 1,
        }
    }
}
