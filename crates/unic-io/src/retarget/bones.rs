//! Which joint of a skeleton is which.

use super::names::{FAMILIES, Family, Name, Part, Side};
use crate::error::{Error, Result};
use serde::Deserialize;
use std::{collections::BTreeMap, path::Path};
use unic_core::skeleton::SMPL_JOINT_NAMES;

/// Joints that a motion cannot do without.
const NEEDED: [Part; 5] = [Part::Hip, Part::Knee, Part::Ankle, Part::Shoulder, Part::Elbow];

/// Longest list of joints that an error repeats, characters.
const QUOTED: usize = 200;

/// Which joint of a file stands for which of [`SMPL_JOINT_NAMES`], where their names do not tell.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoneMap {
    /// From a name of SMPL's to a joint's name in the file, as it stands there.
    bones: BTreeMap<String, String>,
}

impl BoneMap {
    /// From pairs (name of SMPL's, name in the file).
    ///
    /// # Errors
    /// The first name of a pair that is none of [`SMPL_JOINT_NAMES`].
    pub fn new<S: Into<String>>(
        pairs: impl IntoIterator<Item = (S, S)>,
    ) -> std::result::Result<Self, String> {
        let pairs = pairs.into_iter().map(|(a, b)| (a.into(), b.into()));
        let map = Self {
            bones: pairs.collect(),
        };
        match map.unknown() {
            Some(name) => Err(name.to_owned()),
            None => Ok(map),
        }
    }

    /// Reads a TOML file: a table `[bones]` with lines such as `L_knee = "Shin.L"`.
    ///
    /// # Errors
    /// The file cannot be read, is no such table, or has names that are not SMPL's.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path, "read"))?;
        let map: Self = toml::from_str(&text).map_err(|e| {
            let message = e.message().lines().collect::<Vec<_>>().join(", ");
            Error::content(path, "a table [bones] of joint names", message)
        })?;
        match map.unknown() {
            None => Ok(map),
            Some(name) => {
                let expected = format!("bones among {}", SMPL_JOINT_NAMES.join(", "));
                Err(Error::content(path, expected, format!("`{name}`")))
            }
        }
    }

    fn unknown(&self) -> Option<&str> {
        let mut names = self.bones.keys().map(String::as_str);
        names.find(|name| !SMPL_JOINT_NAMES.contains(name))
    }

    /// The joint of the file that stands for a joint of SMPL's.
    fn joint(&self, path: &Path, smpl: usize, joints: &[&str]) -> Result<Option<usize>> {
        let Some(name) = self.bones.get(SMPL_JOINT_NAMES[smpl]) else {
            return Ok(None);
        };
        let found = joints.iter().position(|j| j == name);
        match found {
            Some(joint) => Ok(Some(joint)),
            None => {
                let expected = format!("the joint `{name}` that the bone map names");
                Err(Error::content(path, expected, listed(joints)))
            }
        }
    }
}

/// The joints of a skeleton by their meaning; indices into that skeleton.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bones {
    /// How the limbs' joints are named.
    pub(super) family: &'static str,
    pub(super) pelvis: usize,
    /// From above the pelvis up to the joint that carries both arms.
    pub(super) spine: Vec<usize>,
    /// From above the spine up to the head, the head excluded.
    pub(super) neck: Vec<usize>,
    pub(super) head: Option<usize>,
    /// By [`Part`], left and right.
    limbs: [[Option<usize>; 2]; 9],
}

/// A skeleton's tree by names.
pub(super) struct Tree<'a> {
    /// For errors.
    pub(super) path: &'a Path,
    pub(super) names: Vec<&'a str>,
    pub(super) parents: Vec<Option<usize>>,
}

impl Bones {
    /// Tells the joints by their names and by the tree: limbs by one of [`FAMILIES`], the pelvis as
    /// what carries both legs, the chest as what carries both arms, and what is between as spine.
    pub(super) fn identify(tree: &Tree<'_>, map: &BoneMap) -> Result<Self> {
        let names: Vec<Name> = tree.names.iter().map(|n| Name::new(n)).collect();
        let family = best_family(&names);
        let mut limbs = [[None; 2]; 9];
        for part in Part::ALL {
            for side in Side::ALL {
                let mapped = map.joint(tree.path, part.smpl_joint(side), &tree.names)?;
                limbs[part as usize][side as usize] = mapped.or_else(|| family.find(&names, part, side));
            }
        }
        check_needed(tree, &limbs)?;
        let mut bones = Self {
            family: family.name,
            pelvis: 0,
            spine: Vec::new(),
            neck: Vec::new(),
            head: None,
            limbs,
        };
        bones.find_middle(tree, &names)?;
        bones.override_middle(tree, map)?;
        Ok(bones)
    }

    fn find_middle(&mut self, tree: &Tree<'_>, names: &[Name]) -> Result<()> {
        self.pelvis = tree.common(self.pair(Part::Hip)?)?;
        let chest = tree.common(self.pair(Part::Shoulder)?)?;
        let Some(spine) = tree.between(self.pelvis, chest).filter(|_| chest != self.pelvis) else {
            let expected = "a chest that carries the arms above a pelvis that carries the legs";
            let found = format!("`{}` and `{}`", tree.names[chest], tree.names[self.pelvis]);
            return Err(Error::content(tree.path, expected, found));
        };
        self.spine = spine;
        self.head =
            (0..names.len()).find(|&j| names[j].is_middle("head") && tree.between(chest, j).is_some());
        let necks = |&j: &usize| names[j].is_middle("neck") && tree.between(chest, j).is_some();
        self.neck = match self.head {
            Some(head) => {
                let mut neck = tree.between(chest, head).unwrap_or_default();
                neck.pop();
                neck
            }
            None => (0..names.len()).filter(necks).collect(),
        };
        Ok(())
    }

    /// What the user says about pelvis, spine, neck and head.
    fn override_middle(&mut self, tree: &Tree<'_>, map: &BoneMap) -> Result<()> {
        let joint = |smpl: usize| map.joint(tree.path, smpl, &tree.names);
        self.pelvis = joint(0)?.unwrap_or(self.pelvis);
        let spine = [joint(3)?, joint(6)?, joint(9)?];
        if spine.iter().any(Option::is_some) {
            self.spine = spine.into_iter().flatten().collect();
        }
        if let Some(neck) = joint(12)? {
            self.neck = vec![neck];
        }
        self.head = joint(15)?.or(self.head);
        Ok(())
    }

    pub(super) fn limb(&self, part: Part, side: Side) -> Option<usize> {
        self.limbs[part as usize][side as usize]
    }

    /// Left and right joint of a part that every skeleton has; see [`NEEDED`].
    pub(super) fn pair(&self, part: Part) -> Result<[usize; 2]> {
        match self.limbs[part as usize] {
            [Some(left), Some(right)] => Ok([left, right]),
            _ => Err(Error::content(
                Path::new("skeleton"),
                format!("joints for both sides of {part:?}"),
                "fewer",
            )),
        }
    }
}

fn best_family(names: &[Name]) -> &'static Family {
    // Of equals the first: SMPL's.
    let mut best = &FAMILIES[0];
    for family in &FAMILIES[1..] {
        if family.matches(names) > best.matches(names) {
            best = family;
        }
    }
    best
}

/// L ankle, L foot, R ankle, R foot among joints by their names, in whichever way they are named; a leg that
/// ends at its ankle stands on that.
pub(crate) fn feet_by_name(names: &[String]) -> Option<[usize; 4]> {
    let names: Vec<Name> = names.iter().map(|n| Name::new(n)).collect();
    let family = best_family(&names);
    let foot = |side: Side| {
        let ankle = family.find(&names, Part::Ankle, side)?;
        Some([ankle, family.find(&names, Part::Toe, side).unwrap_or(ankle)])
    };
    let ([a, b], [c, d]) = (foot(Side::Left)?, foot(Side::Right)?);
    Some([a, b, c, d])
}

fn check_needed(tree: &Tree<'_>, limbs: &[[Option<usize>; 2]; 9]) -> Result<()> {
    let pairs = NEEDED.iter().flat_map(|&p| Side::ALL.map(|s| (p, s)));
    let missing: Vec<&str> = pairs
        .filter(|&(p, s)| limbs[p as usize][s as usize].is_none())
        .map(|(p, s)| SMPL_JOINT_NAMES[p.smpl_joint(s)])
        .collect();
    if missing.is_empty() {
        return Ok(());
    }
    let expected = format!("joints for {} by name or in a bone map", missing.join(", "));
    Err(Error::content(tree.path, expected, listed(&tree.names)))
}

fn listed(joints: &[&str]) -> String {
    let text = joints.join(", ");
    match text.char_indices().nth(QUOTED) {
        None => text,
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

impl Tree<'_> {
    /// The joint and its ancestors, upwards; ends in damaged trees too.
    fn ancestors(&self, joint: usize) -> impl Iterator<Item = usize> {
        std::iter::successors(Some(joint), |&j| self.parents[j]).take(self.parents.len())
    }

    /// The lowest joint that carries both.
    fn common(&self, [a, b]: [usize; 2]) -> Result<usize> {
        let above_b: Vec<usize> = self.ancestors(b).collect();
        let common = self.ancestors(a).find(|j| above_b.contains(j));
        common.ok_or_else(|| {
            let found = format!("`{}` and `{}`", self.names[a], self.names[b]);
            Error::content(self.path, "a joint that carries both sides", found)
        })
    }

    /// The joints from `above` (excluded) down to `below` (included), if one carries the other.
    fn between(&self, above: usize, below: usize) -> Option<Vec<usize>> {
        let mut chain: Vec<usize> = self.ancestors(below).collect();
        let end = chain.iter().position(|&j| j == above)?;
        chain.truncate(end);
        chain.reverse();
        Some(chain)
    }
}
