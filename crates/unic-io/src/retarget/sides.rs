//! Joints of the left and the right that belong to each other.

use super::names::{Name, Side};

/// For each joint the one of the same name on the other side of the body, and itself for a joint of the middle. None
/// where a joint that names a side has no counterpart, or no joint names a side.
pub fn counterparts(names: &[String]) -> Option<Vec<usize>> {
    let read: Vec<Name> = names.iter().map(|name| Name::new(name)).collect();
    let other = |joint: usize| match read[joint].side {
        Some(_) => read.iter().position(|name| name.is_opposite(&read[joint])),
        None => Some(read[joint].unseparated(&read).unwrap_or(joint)),
    };
    let all: Option<Vec<usize>> = (0..names.len()).map(other).collect();
    all.filter(|all| all.iter().enumerate().any(|(joint, other)| joint != *other))
}

impl Name {
    fn is_opposite(&self, other: &Self) -> bool {
        let sides = (self.side, other.side);
        matches!(
            sides,
            (Some(Side::Left), Some(Side::Right)) | (Some(Side::Right), Some(Side::Left))
        ) && self.stem == other.stem
    }

    /// The joint on the other side of one whose side is no word of its own: `rfemur` for `lfemur`.
    fn unseparated(&self, names: &[Self]) -> Option<usize> {
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
    fn sides_are_told_in_every_spelling() {
        let told = |names: &[&str]| counterparts(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>());
        for names in [
            ["pelvis", "L_knee", "R_knee"],
            ["Hips", "mixamorig:LeftFoot", "mixamorig:RightFoot"],
            ["root", "hand.L", "hand.R"],
            ["Bip01", "Bip01 L Toe0", "Bip01 R Toe0"],
            ["hip", "thigh_l", "thigh_r"],
            ["root", "lfemur", "rfemur"],
            ["Hips", "LHipJoint", "RHipJoint"],
        ] {
            assert_eq!(told(&names), Some(vec![0, 2, 1]), "{names:?}");
        }
        assert_eq!(told(&["pelvis", "spine"]), None);
        assert_eq!(told(&["pelvis", "L_leg"]), None);
        assert_eq!(
            told(&["root", "lumbar", "L_leg", "R_leg"]),
            Some(vec![0, 1, 3, 2])
        );
    }
}
