//! Identifying the body parts of a skeleton's joints.

use super::humanoid::AvatarFile;
use crate::{
    error::{Error, Result},
    joint_names::{BodySide, JointName, LimbJoint, best_convention},
};
use serde::Deserialize;
use std::{collections::BTreeMap, path::Path};
use unic_core::skeleton::SMPL_JOINT_NAMES;

/// Joints that every skeleton must have.
const REQUIRED: [LimbJoint; 5] = [
    LimbJoint::Hip,
    LimbJoint::Knee,
    LimbJoint::Ankle,
    LimbJoint::Shoulder,
    LimbJoint::Elbow,
];

/// Length of a list of joints in an error, characters.
const QUOTED_CHARACTERS: usize = 200;

/// Assignment of a file's joints to [`SMPL_JOINT_NAMES`], for names that are not recognised.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoneMap {
    /// Name of a joint in the file, by the name in [`SMPL_JOINT_NAMES`].
    bones: BTreeMap<String, String>,
}

impl BoneMap {
    /// Makes a map from pairs (name in [`SMPL_JOINT_NAMES`], name in the file).
    ///
    /// # Errors
    /// The first name that is not one of [`SMPL_JOINT_NAMES`].
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

    /// Returns whether no joint is mapped.
    pub fn is_empty(&self) -> bool {
        self.bones.is_empty()
    }

    /// Reads a TOML file: a table `[bones]` with lines such as `L_knee = "Shin.L"`. Files of Unity
    /// that hold an avatar's bones are read too: `.meta` and `.ht`.
    ///
    /// # Errors
    /// The file cannot be read, is no such table, or has names outside [`SMPL_JOINT_NAMES`].
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(Error::io(path, "read"))?;
        if let Some(file) = AvatarFile::of(path) {
            return file.parse(path, &text);
        }
        let map: Self = toml::from_str(&text).map_err(|e| {
            // TOML messages have several lines; errors of this crate are one.
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

    /// First name that is not one of [`SMPL_JOINT_NAMES`].
    fn unknown(&self) -> Option<&str> {
        let mut names = self.bones.keys().map(String::as_str);
        names.find(|name| !SMPL_JOINT_NAMES.contains(name))
    }

    /// Returns the joint of the file that is mapped to a joint of SMPL, if the map has it.
    ///
    /// # Errors
    /// A mapped joint that the file does not have.
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

/// Joints of a skeleton by body part, as indices into that skeleton.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BodyJoints {
    /// Name of the convention of the limb joints.
    pub(super) convention: &'static str,
    /// Joint that carries both legs.
    pub(super) pelvis: usize,
    /// Joints above the pelvis up to the one that carries both arms, upwards.
    pub(super) spine: Vec<usize>,
    /// Joints between spine and head, both excluded, upwards.
    pub(super) neck: Vec<usize>,
    pub(super) head: Option<usize>,
    /// Left and right joint of each [`LimbJoint`].
    limbs: [[Option<usize>; 2]; 9],
}

/// Names and parents of a skeleton's joints.
pub(super) struct JointTree<'a> {
    /// File of the skeleton, for errors.
    pub(super) path: &'a Path,
    pub(super) names: Vec<&'a str>,
    pub(super) parents: Vec<Option<usize>>,
}

impl BodyJoints {
    /// Identifies joints by their names and by the tree.
    ///
    /// Limbs are found by one naming convention. The pelvis is the lowest joint that carries both
    /// legs, the chest the lowest one that carries both arms, and the joints between are the spine.
    ///
    /// # Errors
    /// Missing limb joints; a chest that is not above the pelvis; a bone map with unknown joints.
    pub(super) fn identify(tree: &JointTree<'_>, map: &BoneMap) -> Result<Self> {
        let names: Vec<JointName> = tree.names.iter().map(|n| JointName::new(n)).collect();
        let convention = best_convention(&names);
        let mut limbs = [[None; 2]; 9];
        for part in LimbJoint::ALL {
            for side in BodySide::ALL {
                let mapped = map.joint(tree.path, part.smpl_joint(side), &tree.names)?;
                // The bone map has precedence over recognised names.
                limbs[part as usize][side as usize] = mapped.or_else(|| convention.find(&names, part, side));
            }
        }
        check_required(tree, &limbs)?;
        let mut bones = Self {
            convention: convention.name,
            // Set by `find_middle`.
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

    /// Finds pelvis, spine, neck and head.
    fn find_middle(&mut self, tree: &JointTree<'_>, names: &[JointName]) -> Result<()> {
        self.pelvis = tree.common(self.pair(LimbJoint::Hip)?)?;
        let chest = tree.common(self.pair(LimbJoint::Shoulder)?)?;
        // A skeleton whose arms and legs meet in one joint has no trunk to rotate.
        let Some(spine) = tree.between(self.pelvis, chest).filter(|_| chest != self.pelvis) else {
            let expected = "a chest that carries the arms above a pelvis that carries the legs";
            let found = format!("`{}` and `{}`", tree.names[chest], tree.names[self.pelvis]);
            return Err(Error::content(tree.path, expected, found));
        };
        self.spine = spine;
        // A joint called `head` elsewhere in the tree is a control and not the head.
        self.head =
            (0..names.len()).find(|&j| names[j].is_middle("head") && tree.between(chest, j).is_some());
        let necks = |&j: &usize| names[j].is_middle("neck") && tree.between(chest, j).is_some();
        self.neck = match self.head {
            Some(head) => {
                let mut neck = tree.between(chest, head).unwrap_or_default();
                // `between` includes the head itself.
                neck.pop();
                neck
            }
            // Without a head the end of the neck is unknown: its joints are found by name.
            None => (0..names.len()).filter(necks).collect(),
        };
        Ok(())
    }

    /// Replaces pelvis, spine, neck and head by those of the bone map.
    fn override_middle(&mut self, tree: &JointTree<'_>, map: &BoneMap) -> Result<()> {
        // Indices of SMPL: 0 pelvis, 3, 6 and 9 spine, 12 neck, 15 head.
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

    /// Returns a limb joint, if the skeleton has it.
    pub(super) fn limb(&self, part: LimbJoint, side: BodySide) -> Option<usize> {
        self.limbs[part as usize][side as usize]
    }

    /// Returns the left and right joint of one of the [`REQUIRED`] limb joints.
    ///
    /// # Errors
    /// A limb joint that is not required and missing.
    pub(super) fn pair(&self, part: LimbJoint) -> Result<[usize; 2]> {
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

/// Checks that all [`REQUIRED`] joints are found.
fn check_required(tree: &JointTree<'_>, limbs: &[[Option<usize>; 2]; 9]) -> Result<()> {
    let pairs = REQUIRED.iter().flat_map(|&p| BodySide::ALL.map(|s| (p, s)));
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
    match text.char_indices().nth(QUOTED_CHARACTERS) {
        None => text,
        Some((end, _)) => format!("{}...", &text[..end]),
    }
}

impl JointTree<'_> {
    /// Iterates over the joint and its ancestors, upwards.
    fn ancestors(&self, joint: usize) -> impl Iterator<Item = usize> {
        // Limited to the number of joints: the parents of a damaged tree may form a cycle.
        std::iter::successors(Some(joint), |&j| self.parents[j]).take(self.parents.len())
    }

    /// Returns the lowest common ancestor of two joints.
    ///
    /// # Errors
    /// Joints of different trees.
    fn common(&self, [a, b]: [usize; 2]) -> Result<usize> {
        let above_b: Vec<usize> = self.ancestors(b).collect();
        let common = self.ancestors(a).find(|j| above_b.contains(j));
        common.ok_or_else(|| {
            let found = format!("`{}` and `{}`", self.names[a], self.names[b]);
            Error::content(self.path, "a joint that carries both sides", found)
        })
    }

    /// Returns the joints from `above` (excluded) down to `below` (included); `None` if `above` is
    /// no ancestor of `below`.
    fn between(&self, above: usize, below: usize) -> Option<Vec<usize>> {
        let mut chain: Vec<usize> = self.ancestors(below).collect();
        let end = chain.iter().position(|&j| j == above)?;
        chain.truncate(end);
        chain.reverse();
        Some(chain)
    }
}
