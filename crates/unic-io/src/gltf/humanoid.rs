//! Humanoid bones that a VRM file names, by the extensions `VRM` (0.x), `VRMC_vrm` (1.0) and
//! `VRMC_vrm_animation` (motion).

use super::container::document_bytes;
use crate::retarget::{BoneMap, bone_map};
use serde::Deserialize;
use std::{collections::BTreeMap, path::Path};

#[derive(Deserialize)]
struct Document {
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    extensions: Extensions,
}

#[derive(Deserialize)]
struct Node {
    #[serde(default)]
    name: String,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Extensions {
    #[serde(rename = "VRM")]
    vrm_0: Option<Vrm0>,
    #[serde(rename = "VRMC_vrm")]
    vrm_1: Option<Vrm1>,
    #[serde(rename = "VRMC_vrm_animation")]
    animation: Option<Vrm1>,
}

#[derive(Deserialize)]
struct Vrm0 {
    humanoid: Humanoid0,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Humanoid0 {
    human_bones: Vec<Bone0>,
}

#[derive(Deserialize)]
struct Bone0 {
    bone: String,
    node: usize,
}

#[derive(Deserialize)]
struct Vrm1 {
    humanoid: Humanoid1,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Humanoid1 {
    human_bones: BTreeMap<String, Bone1>,
}

#[derive(Deserialize)]
struct Bone1 {
    node: usize,
}

/// Returns the bones that a file names. Files that name none, or in a form that is not known, have
/// an empty map: their joints are found by their names.
pub(crate) fn humanoid_bones(path: &Path) -> BoneMap {
    let document = document_bytes(path).ok();
    let parsed = document.and_then(|bytes| serde_json::from_slice::<Document>(&bytes).ok());
    parsed.map_or_else(BoneMap::default, |document| bones(&document))
}

fn bones(document: &Document) -> BoneMap {
    let name = |node: usize| document.nodes.get(node).map_or("", |node| node.name.as_str());
    let extensions = &document.extensions;
    if let Some(vrm) = extensions.vrm_1.as_ref().or(extensions.animation.as_ref()) {
        let bones = vrm.humanoid.human_bones.iter();
        return bone_map(bones.map(|(bone, at)| (bone.as_str(), name(at.node))));
    }
    let bones = extensions.vrm_0.iter().flat_map(|vrm| &vrm.humanoid.human_bones);
    bone_map(bones.map(|at| (at.bone.as_str(), name(at.node))))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_versions_name_the_same_bones() {
        let nodes = r#""nodes": [{"name": "a"}, {"name": "Beine"}, {}]"#;
        let expected = BoneMap::new([("pelvis", "a"), ("R_hip", "Beine")]).unwrap();
        for extensions in [
            r#""VRM": {"humanoid": {"humanBones": [{"bone": "hips", "node": 0}, {"bone": "rightUpperLeg", "node": 1},
               {"bone": "head", "node": 2}, {"bone": "neck", "node": 77}]}}"#,
            r#""VRMC_vrm": {"humanoid": {"humanBones": {"hips": {"node": 0}, "rightUpperLeg": {"node": 1}}}}"#,
            r#""VRMC_vrm_animation": {"humanoid": {"humanBones": {"hips": {"node": 0}, "rightUpperLeg": {"node": 1}}}}"#,
        ] {
            let text = format!("{{{nodes}, \"extensions\": {{{extensions}}}}}");
            assert_eq!(bones(&serde_json::from_str(&text).unwrap()), expected, "{text}");
        }
        let other = serde_json::from_str::<Document>("{\"extensions\": {\"KHR_lights\": {}}}").unwrap();
        assert!(bones(&other).is_empty());
    }
}
