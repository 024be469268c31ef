//! Joint names without the spelling differences between programs.

use super::limbs::BodySide;

/// A joint's name without case, namespace, prefix, separators and side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct JointName {
    pub(super) side: Option<BodySide>,
    pub(super) stem: String,
}

/// Leading words of joint names that name the character or the program.
const PREFIXES: [&str; 16] = [
    "mixamorig",
    "bip01",
    "bip001",
    "bip",
    "m",
    "f",
    "avg",
    "def",
    "org",
    "jnt",
    "bone",
    "cc",
    "base",
    "character1",
    // VRoid Studio: `J_Bip_C_Hips`.
    "j",
    "c",
];

impl JointName {
    pub(crate) fn new(name: &str) -> Self {
        // The last part of a path: namespaces and parents come before it.
        let local = name.rsplit([':', '|']).next().unwrap_or(name);
        let words = words(local);
        let named = words.iter().skip_while(|w| PREFIXES.contains(&w.as_str()));
        let mut side = None;
        let mut stem = String::new();
        for word in named {
            // Only the first side word counts: a second one belongs to the stem.
            match BodySide::from_word(word).filter(|_| side.is_none()) {
                Some(found) => side = Some(found),
                None => stem.push_str(word),
            }
        }
        Self { side, stem }
    }

    /// Returns whether this is the joint of a side and stem.
    ///
    /// A side that is not a word of its own (`lfemur`, `leftupleg`) is only recognised here, where
    /// the stem is known: `l` also begins `leg`.
    pub(super) fn is(&self, side: BodySide, stem: &str) -> bool {
        if let Some(own) = self.side {
            return own == side && self.stem == stem;
        }
        let (letter, word) = match side {
            BodySide::Left => ("l", "left"),
            BodySide::Right => ("r", "right"),
        };
        let rest = self.stem.strip_suffix(stem);
        rest.is_some_and(|rest| rest == letter || rest == word)
    }

    /// Returns whether this is a joint without a side and with this stem, up to a number at its
    /// end.
    pub(crate) fn is_middle(&self, stem: &str) -> bool {
        self.side.is_none() && self.stem.trim_end_matches(|c: char| c.is_ascii_digit()) == stem
    }
}

/// Returns whether two names differ in case, prefix and separators only.
pub(crate) fn is_same_joint(a: &str, b: &str) -> bool {
    JointName::new(a) == JointName::new(b)
}

/// Splits a name into lower-case words: `LeftUpLeg`, `LHipJoint`, `upper_arm.L`, `Bip01 L Toe0`.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (i, &c) in letters.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| letters[i]);
        let after_is_lower = letters.get(i + 1).is_some_and(|c| c.is_lowercase());
        // A word begins at an upper-case letter behind a lower-case one, and at the last letter of
        // a run of upper-case ones if a lower-case letter follows: `LHip` is `l`, `hip`.
        let begins = c.is_uppercase()
            && before.is_some_and(|b| !b.is_uppercase() || after_is_lower && b.is_uppercase());
        if begins || !c.is_alphanumeric() {
            words.push(String::new());
        }
        if c.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(c.to_lowercase());
        }
    }
    words.retain(|w| !w.is_empty());
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_case_prefix_and_side() {
        for (name, side, stem) in [
            ("mixamorig:LeftUpLeg", Some(BodySide::Left), "upleg"),
            ("mixamorig_RightToeBase", Some(BodySide::Right), "toebase"),
            ("Bip01 L Toe0", Some(BodySide::Left), "toe0"),
            ("m_avg_R_Knee", Some(BodySide::Right), "knee"),
            ("DEF-upper_arm.L", Some(BodySide::Left), "upperarm"),
            ("LHipJoint", Some(BodySide::Left), "hipjoint"),
            ("J_Bip_L_UpperLeg", Some(BodySide::Left), "upperleg"),
            ("J_Bip_C_Head", None, "head"),
            ("left_hip", Some(BodySide::Left), "hip"),
            ("thigh_r", Some(BodySide::Right), "thigh"),
            ("Spine1", None, "spine1"),
            ("LEFTFOOT", None, "leftfoot"),
        ] {
            let expected = JointName {
                side,
                stem: stem.into(),
            };
            assert_eq!(JointName::new(name), expected, "{name}");
        }
        assert!(JointName::new("LEFTFOOT").is(BodySide::Left, "foot"));
        assert!(JointName::new("lfemur").is(BodySide::Left, "femur"));
        assert!(!JointName::new("lfemur").is(BodySide::Right, "femur"));
        assert!(!JointName::new("LeftForeArm").is(BodySide::Left, "arm"));
    }
}
