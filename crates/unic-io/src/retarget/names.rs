//! What joints are called, program by program.

/// Side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

impl Side {
    pub(super) const ALL: [Side; 2] = [Side::Left, Side::Right];

    fn word(word: &str) -> Option<Self> {
        match word {
            "l" | "left" => Some(Side::Left),
            "r" | "right" => Some(Side::Right),
            _ => None,
        }
    }
}

/// Joint of an arm or a leg, named by the bone that it turns or, after SMPL, by its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
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

impl Part {
    pub(super) const ALL: [Part; 9] = [
        Part::Hip,
        Part::Knee,
        Part::Ankle,
        Part::Toe,
        Part::Collar,
        Part::Shoulder,
        Part::Elbow,
        Part::Wrist,
        Part::Hand,
    ];

    /// Index among [`SMPL_JOINT_NAMES`](unic_core::skeleton::SMPL_JOINT_NAMES).
    pub(super) fn smpl_joint(self, side: Side) -> usize {
        let left = [1, 4, 7, 10, 13, 16, 18, 20, 22][self as usize];
        match side {
            Side::Left => left,
            Side::Right => left + 1,
        }
    }
}

/// One way to name the joints of the limbs, in lower case without side words.
pub(super) struct Family {
    pub(super) name: &'static str,
    /// By [`Part`]; several names of one joint are tried in turn.
    stems: [&'static [&'static str]; 9],
}

/// The same word means different joints in different families (a `Shoulder` is the collar bone
/// to some and the upper arm to others), so that a skeleton is read by one family throughout.
pub(super) const FAMILIES: [Family; 7] = [
    Family {
        name: "SMPL",
        stems: [
            &["hip"],
            &["knee"],
            &["ankle"],
            &["foot"],
            &["collar"],
            &["shoulder"],
            &["elbow"],
            &["wrist"],
            &["hand"],
        ],
    },
    Family {
        name: "CMU or 100STYLE",
        stems: [
            &["hip"],
            &["knee"],
            &["ankle"],
            &["toe", "toes"],
            &["collar"],
            &["shoulder"],
            &["elbow"],
            &["wrist"],
            &["hand", "fingers"],
        ],
    },
    Family {
        name: "Mixamo, LAFAN1 or MotionBuilder",
        stems: [
            &["upleg"],
            &["leg"],
            &["foot"],
            &["toebase", "toe"],
            &["shoulder"],
            &["arm"],
            &["forearm"],
            &["hand"],
            &["handmiddle1", "fingerbase", "handindex1"],
        ],
    },
    Family {
        name: "Unity or VRM",
        stems: [
            &["upperleg"],
            &["lowerleg"],
            &["foot"],
            &["toes", "toe", "toebase"],
            &["shoulder"],
            &["upperarm"],
            &["lowerarm"],
            &["hand"],
            &["middleproximal", "handmiddle1"],
        ],
    },
    Family {
        name: "Unreal or Biped",
        stems: [
            &["thigh"],
            &["calf"],
            &["foot"],
            &["ball", "toe0", "toe"],
            &["clavicle"],
            &["upperarm"],
            &["lowerarm", "forearm"],
            &["hand"],
            &["middle01", "finger2"],
        ],
    },
    Family {
        name: "Rigify",
        stems: [
            &["thigh"],
            &["shin"],
            &["foot"],
            &["toe"],
            &["shoulder"],
            &["upperarm"],
            &["forearm"],
            &["hand"],
            &["palm02"],
        ],
    },
    Family {
        name: "Acclaim",
        stems: [
            &["femur"],
            &["tibia"],
            &["foot"],
            &["toes"],
            &["clavicle"],
            &["humerus"],
            &["radius"],
            &["wrist"],
            &["hand"],
        ],
    },
];

impl Family {
    /// Index of a limb's joint among `names`.
    pub(super) fn find(&self, names: &[Name], part: Part, side: Side) -> Option<usize> {
        let stems = self.stems[part as usize].iter();
        stems
            .filter_map(|stem| names.iter().position(|name| name.is(side, stem)))
            .next()
    }

    /// How many joints of the limbs it finds.
    pub(super) fn matches(&self, names: &[Name]) -> usize {
        let pairs = Part::ALL.iter().flat_map(|&p| Side::ALL.map(|s| (p, s)));
        pairs.filter(|&(p, s)| self.find(names, p, s).is_some()).count()
    }
}

/// A joint's name without case, namespace, prefix, separators and side.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Name {
    pub(super) side: Option<Side>,
    pub(super) stem: String,
}

/// Words before a joint's name that name the character or the program.
const PREFIXES: [&str; 14] = [
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
];

impl Name {
    pub(super) fn new(name: &str) -> Self {
        let local = name.rsplit([':', '|']).next().unwrap_or(name);
        let words = words(local);
        let named = words.iter().skip_while(|w| PREFIXES.contains(&w.as_str()));
        let mut side = None;
        let mut stem = String::new();
        for word in named {
            match Side::word(word).filter(|_| side.is_none()) {
                Some(found) => side = Some(found),
                None => stem.push_str(word),
            }
        }
        Self { side, stem }
    }

    /// Whether it is the joint of this side and stem. A side that is no word of its own (`lfemur`,
    /// `leftupleg`) is found here, where it is known what must remain.
    fn is(&self, side: Side, stem: &str) -> bool {
        if let Some(own) = self.side {
            return own == side && self.stem == stem;
        }
        let (letter, word) = match side {
            Side::Left => ("l", "left"),
            Side::Right => ("r", "right"),
        };
        let rest = self.stem.strip_suffix(stem);
        rest.is_some_and(|rest| rest == letter || rest == word)
    }

    /// Whether it is a joint of the middle, up to a number at its end.
    pub(super) fn is_middle(&self, stem: &str) -> bool {
        self.side.is_none() && self.stem.trim_end_matches(|c: char| c.is_ascii_digit()) == stem
    }
}

/// Whether two names differ by case, prefix and separators alone.
pub(crate) fn is_same_joint(a: &str, b: &str) -> bool {
    Name::new(a) == Name::new(b)
}

/// Lower-case words of `LeftUpLeg`, `LHipJoint`, `upper_arm.L`, `Bip01 L Toe0`.
fn words(name: &str) -> Vec<String> {
    let letters: Vec<char> = name.chars().collect();
    let mut words = vec![String::new()];
    for (i, &c) in letters.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| letters[i]);
        let after_is_lower = letters.get(i + 1).is_some_and(|c| c.is_lowercase());
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
            ("mixamorig:LeftUpLeg", Some(Side::Left), "upleg"),
            ("mixamorig_RightToeBase", Some(Side::Right), "toebase"),
            ("Bip01 L Toe0", Some(Side::Left), "toe0"),
            ("m_avg_R_Knee", Some(Side::Right), "knee"),
            ("DEF-upper_arm.L", Some(Side::Left), "upperarm"),
            ("LHipJoint", Some(Side::Left), "hipjoint"),
            ("left_hip", Some(Side::Left), "hip"),
            ("thigh_r", Some(Side::Right), "thigh"),
            ("Spine1", None, "spine1"),
            ("LEFTFOOT", None, "leftfoot"),
        ] {
            let expected = Name {
                side,
                stem: stem.into(),
            };
            assert_eq!(Name::new(name), expected, "{name}");
        }
        assert!(Name::new("LEFTFOOT").is(Side::Left, "foot"));
        assert!(Name::new("lfemur").is(Side::Left, "femur"));
        assert!(!Name::new("lfemur").is(Side::Right, "femur"));
        assert!(!Name::new("LeftForeArm").is(Side::Left, "arm"));
    }
}
