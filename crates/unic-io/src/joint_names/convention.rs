//! Naming conventions of programs and motion libraries.

use super::{
    limbs::{BodySide, LimbJoint},
    name::JointName,
};

/// Names of the limb joints in some programs, in lower case without side words.
pub(crate) struct NamingConvention {
    /// Programs and motion libraries that use the convention, for messages.
    pub(crate) name: &'static str,
    /// Stems of each [`LimbJoint`]. Several stems of one joint are tried in turn.
    stems: [&'static [&'static str]; 9],
}

/// Known naming conventions.
///
/// One word means different joints in different conventions: `Shoulder` is the collar bone in some
/// and the upper arm in others. All joints of a skeleton are therefore read by one convention.
const CONVENTIONS: [NamingConvention; 7] = [
    NamingConvention {
        // The hand is SMPL's last joint of an arm; its last joint of a leg is the ball of the foot.
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
    NamingConvention {
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
    NamingConvention {
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
            // The base of a finger stands for SMPL's hand, which is in the palm.
            &["handmiddle1", "fingerbase", "handindex1"],
        ],
    },
    NamingConvention {
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
    NamingConvention {
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
    NamingConvention {
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
    NamingConvention {
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

impl NamingConvention {
    /// Finds a limb joint among `names` and returns its index.
    pub(crate) fn find(&self, names: &[JointName], joint: LimbJoint, side: BodySide) -> Option<usize> {
        // The discriminants of `LimbJoint` are the indices of the table.
        let stems = self.stems[joint as usize].iter();
        stems
            // Stem by stem and not name by name: the order of the stems is their precedence.
            .filter_map(|stem| names.iter().position(|name| name.is(side, stem)))
            .next()
    }

    /// Number of limb joints found among `names`.
    pub(crate) fn matches(&self, names: &[JointName]) -> usize {
        let pairs = LimbJoint::ALL.iter().flat_map(|&p| BodySide::ALL.map(|s| (p, s)));
        pairs.filter(|&(p, s)| self.find(names, p, s).is_some()).count()
    }
}

/// Returns the convention that finds the most limb joints among `names`.
pub(crate) fn best_convention(names: &[JointName]) -> &'static NamingConvention {
    // Not `max_by_key`, which takes the last of equals: the first one, SMPL's, has precedence.
    let mut best = &CONVENTIONS[0];
    for convention in &CONVENTIONS[1..] {
        if convention.matches(names) > best.matches(names) {
            best = convention;
        }
    }
    best
}

/// Finds L ankle, L foot, R ankle and R foot among joint names of any convention.
///
/// For a leg without a foot joint the ankle stands for the foot.
pub(crate) fn feet_by_name(names: &[String]) -> Option<[usize; 4]> {
    let names: Vec<JointName> = names.iter().map(|n| JointName::new(n)).collect();
    let convention = best_convention(&names);
    let foot = |side: BodySide| {
        let ankle = convention.find(&names, LimbJoint::Ankle, side)?;
        let foot = convention.find(&names, LimbJoint::Toe, side);
        Some([ankle, foot.unwrap_or(ankle)])
    };
    let ([a, b], [c, d]) = (foot(BodySide::Left)?, foot(BodySide::Right)?);
    Some([a, b, c, d])
}
