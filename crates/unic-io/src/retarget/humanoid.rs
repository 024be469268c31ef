//! Bone maps of humanoid avatars: VRM files, and the files in which Unity keeps an avatar's bones.

use super::BoneMap;
use crate::error::{Error, Result};
use std::path::Path;
use unic_core::skeleton::SMPL_JOINT_NAMES;

/// Names of humanoid bones in lower case, with the names of SMPL. VRM and Unity have the same bones
/// in another spelling. Fingers, eyes and jaw have no counterpart.
const BONES: [(&str, &str); 22] = [
    ("hips", "pelvis"),
    ("spine", "spine1"),
    ("chest", "spine2"),
    ("upperchest", "spine3"),
    ("neck", "neck"),
    ("head", "head"),
    ("leftupperleg", "L_hip"),
    ("leftlowerleg", "L_knee"),
    ("leftfoot", "L_ankle"),
    ("lefttoes", "L_foot"),
    ("leftshoulder", "L_collar"),
    ("leftupperarm", "L_shoulder"),
    ("leftlowerarm", "L_elbow"),
    ("lefthand", "L_wrist"),
    ("rightupperleg", "R_hip"),
    ("rightlowerleg", "R_knee"),
    ("rightfoot", "R_ankle"),
    ("righttoes", "R_foot"),
    ("rightshoulder", "R_collar"),
    ("rightupperarm", "R_shoulder"),
    ("rightlowerarm", "R_elbow"),
    ("righthand", "R_wrist"),
];

/// File of Unity that holds an avatar's bones, by its extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AvatarFile {
    /// `.fbx.meta` beside a model: pairs of `boneName` and `humanName`.
    Meta,
    /// `.ht`, a human template: lines `LeftUpperLeg: thigh_l` below `m_BoneTemplate`.
    Template,
}

impl AvatarFile {
    pub(super) fn of(path: &Path) -> Option<Self> {
        let extension = path.extension()?.to_string_lossy().to_lowercase();
        match extension.as_str() {
            "meta" => Some(Self::Meta),
            "ht" => Some(Self::Template),
            _ => None,
        }
    }

    /// Parses the text of a file.
    ///
    /// # Errors
    /// A text without any humanoid bone.
    pub(super) fn parse(self, path: &Path, text: &str) -> Result<BoneMap> {
        let map = bone_map(match self {
            Self::Meta => pairs_of_meta(text),
            Self::Template => pairs_of_template(text),
        });
        match map.is_empty() {
            false => Ok(map),
            true => Err(Error::content(path, "bones of a Unity avatar", "none")),
        }
    }
}

/// Makes a map from pairs (name of the humanoid bone, name of the joint). Bones without a
/// counterpart in SMPL are left out.
pub(crate) fn bone_map<'a>(pairs: impl IntoIterator<Item = (&'a str, &'a str)>) -> BoneMap {
    let smpl_name = |human: &str| {
        let human: String = human.split_whitespace().collect::<String>().to_lowercase();
        BONES
            .iter()
            .find(|(name, _)| *name == human)
            .map(|&(_, smpl)| smpl)
    };
    let known = pairs
        .into_iter()
        .filter_map(|(human, joint)| Some((smpl_name(human)?, joint)));
    let known = known.filter(|(smpl, joint)| SMPL_JOINT_NAMES.contains(smpl) && !joint.is_empty());
    // Names of the table are SMPL's, so that none is refused.
    BoneMap::new(known).unwrap_or_default()
}

/// Pairs of a `.meta` file: each `boneName` is followed by its `humanName`.
fn pairs_of_meta(text: &str) -> Vec<(&str, &str)> {
    let mut bone = None;
    let mut pairs = Vec::new();
    for line in text.lines() {
        let line = line.trim_start_matches([' ', '-']);
        if let Some(name) = line.strip_prefix("boneName:") {
            bone = Some(unquoted(name));
        } else if let (Some(name), Some(bone)) = (line.strip_prefix("humanName:"), bone) {
            pairs.push((unquoted(name), bone));
        }
    }
    pairs
}

fn pairs_of_template(text: &str) -> Vec<(&str, &str)> {
    let lines = text.lines().skip_while(|line| line.trim() != "m_BoneTemplate:");
    let pairs = lines.skip(1).map_while(|line| line.split_once(':'));
    pairs
        .map(|(human, bone)| (unquoted(human), unquoted(bone)))
        .collect()
}

fn unquoted(text: &str) -> &str {
    text.trim().trim_matches(['\'', '"'])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bones_of_unity_are_those_of_smpl() {
        let meta = "ModelImporter:\n  humanDescription:\n    human:\n    - boneName: Bone_07\n      humanName: \
                    LeftUpperLeg\n      limit:\n        min: {x: 0}\n    - boneName: 'Bone 9'\n      humanName: Left \
                    Index Proximal\n    - boneName: Bone 10\n      humanName: Hips\n";
        let template = "HumanTemplate:\n  m_Name: my\n  m_BoneTemplate:\n    Hips: Bone 10\n    LeftUpperLeg: Bone_07\n    \
                        Jaw: Kiefer\n";
        let expected = BoneMap::new([("L_hip", "Bone_07"), ("pelvis", "Bone 10")]).unwrap();
        for (name, text) in [("rig.fbx.meta", meta), ("my.HT", template)] {
            let path = Path::new(name);
            let file = AvatarFile::of(path).unwrap();
            assert_eq!(file.parse(path, text).unwrap(), expected);
            let error = file.parse(path, "fileFormatVersion: 2").unwrap_err().to_string();
            assert_eq!(
                error,
                format!("{name}: expected bones of a Unity avatar, found none")
            );
        }
        assert_eq!(AvatarFile::of(Path::new("bones.toml")), None);
    }

    #[test]
    fn every_bone_of_the_table_is_a_joint_of_smpl() {
        for (name, smpl) in BONES {
            assert!(!bone_map([(name, "joint")]).is_empty(), "{smpl}");
        }
    }
}
