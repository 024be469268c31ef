//! Pairs of left and right joints.

use super::{limbs::BodySide, name::JointName};

/// Returns for each joint the index of its counterpart on the other side of the body.
///
/// A joint without a side is its own counterpart. Returns `None` if a joint with a side has no
/// counterpart, or if no joint has one.
pub fn counterparts(names: &[String]) -> Option<Vec<usize>> {
    let parsed: Vec<JointName> = names.iter().map(|name| JointName::new(name)).collect();
    let other = |joint: usize| match parsed[joint].side {
        Some(_) => parsed.iter().position(|name| name.is_opposite(&parsed[joint])),
        None => Some(parsed[joint].fused_opposite(&parsed).unwrap_or(joint)),
    };
    // One joint without a counterpart makes the skeleton asymmetric as a whole.
    let all: Option<Vec<usize>> = (0..names.len()).map(other).collect();
    all.filter(|all| all.iter().enumerate().any(|(joint, other)| joint != *other))
}

impl JointName {
    /// Returns whether `other` is the same joint on the other side.
    fn is_opposite(&self, other: &Self) -> bool {
        let sides = (self.side, other.side);
        matches!(
            sides,
            (Some(BodySide::Left), Some(BodySide::Right)) | (Some(BodySide::Right), Some(BodySide::Left))
        ) && self.stem == other.stem
    }

    /// Finds the counterpart of a joint whose side is not a word of its own: `rfemur` for `lfemur`.
    fn fused_opposite(&self, names: &[Self]) -> Option<usize> {
        // Words before letters: `leftarm` also begins with `l`.
        let pairs = [("left", "right"), ("right", "left"), ("l", "r"), ("r", "l")];
        pairs.into_iter().find_map(|(from, to)| {
            let rest = self.stem.strip_prefix(from)?;
            names
                .iter()
                .position(|name| name.side.is_none() && name.stem.strip_prefix(to) == Some(rest))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counterparts_are_found_in_every_spelling() {
        let found = |names: &[&str]| counterparts(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
        for names in [
            ["pelvis", "L_knee", "R_knee"],
            ["Hips", "mixamorig:LeftFoot", "mixamorig:RightFoot"],
            ["root", "hand.L", "hand.R"],
            ["Bip01", "Bip01 L Toe0", "Bip01 R Toe0"],
            ["hip", "thigh_l", "thigh_r"],
            ["root", "lfemur", "rfemur"],
            ["Hips", "LHipJoint", "RHipJoint"],
        ] {
            assert_eq!(found(&names), Some(vec![0, 2, 1]), "{names:?}");
        }
        assert_eq!(found(&["pelvis", "spine"]), None);
        assert_eq!(found(&["pelvis", "L_leg"]), None);
        assert_eq!(
            found(&["root", "lumbar", "L_leg", "R_leg"]),
            Some(vec![0, 1, 3, 2])
        );
    }
}
