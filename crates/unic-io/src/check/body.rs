//! Checks of a body, its skeleton and its skinning weights.

use super::{mesh, meshes::bounds};
use crate::{
    finding::{
        Finding,
        units::{Diagnosis, diagnose},
    },
    joint_names::feet_by_name,
};
use glam::Vec3;
use std::collections::HashSet;
use unic_core::{
    character::Character,
    skeleton::{SMPL_JOINT_NAMES, SMPL_PARENTS, Skeleton},
};

/// Plausible heights of bodies, metres. A tenth and ten times of a usual height lie outside.
const HEIGHTS: std::ops::RangeInclusive<f32> = 0.3..=3.0;
/// Height of a usual body, metres.
const USUAL_HEIGHT: f32 = 1.7;

/// Smallest cosine between a direction and the axis that it counts as parallel to: 45 degrees.
const MIN_AXIS_COSINE: f32 = 0.7;

/// Largest plausible ratio of the extents of joints and body.
const MAX_EXTENT_RATIO: f32 = 3.0;

/// Checks the unit, axes, orientation, joint names and weights of a character.
pub fn character(character: &Character) -> Vec<Finding> {
    let mut findings = mesh("body", &character.body);
    // The check of the mesh has found a wrong unit already: one finding for one mistake.
    if !findings
        .iter()
        .any(|finding| finding.found.contains("an extent of"))
    {
        findings.extend(height(character));
    }
    findings.extend(inside_out(character));
    findings.extend(duplicate_names(&character.skeleton));
    findings.extend(assumed_names(&character.skeleton));
    findings.extend(orientation(&character.skeleton));
    findings.extend(weights(character));
    findings.extend(misplaced_skeleton(character));
    findings
}

/// Checks the height; a body that lies on its back is reported as Z up.
fn height(character: &Character) -> Option<Finding> {
    let (low, high) = bounds(&character.body.vertices)?;
    let size = high - low;
    if HEIGHTS.contains(&size.y) {
        return None;
    }
    let diagnosis = match HEIGHTS.contains(&size.z) {
        true => Diagnosis {
            probably: "Z up".to_owned(),
            remedy: "export with Y up, or turn the body by -90 degrees about X".to_owned(),
        },
        false => diagnose(size.y / USUAL_HEIGHT, "the character"),
    };
    Some(Finding::new(
        "body",
        format!("a height of {:.3} m", size.y),
        diagnosis.probably,
        diagnosis.remedy,
    ))
}

/// Checks that the triangles face outwards: counter-clockwise faces enclose a positive volume.
fn inside_out(character: &Character) -> Option<Finding> {
    let body = &character.body;
    let (low, high) = bounds(&body.vertices)?;
    let centre = 0.5 * (low + high);
    // Signed volumes of the tetrahedra between the triangles and the centre, summed in f64: most of
    // them cancel. The centre as apex keeps the rest small for a body that has holes.
    let volume = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| body.vertices[v as usize] - centre);
        f64::from(a.dot(b.cross(c))) / 6.0
    };
    let litres: f64 = 1e3 * body.faces.iter().map(volume).sum::<f64>();
    (litres < 0.0).then(|| {
        Finding::new(
            "body",
            format!("a volume of {litres:.1} litres"),
            "triangles that face inwards",
            "flip the normals",
        )
    })
}

fn duplicate_names(skeleton: &Skeleton) -> Option<Finding> {
    let mut seen = HashSet::new();
    let duplicate = skeleton.names().iter().find(|name| !seen.insert(name.as_str()))?;
    Some(Finding::new(
        "skeleton",
        format!("two joints named `{duplicate}`"),
        "two rigs in one file, or names cut short",
        "give every joint a name of its own",
    ))
}

/// Checks that a skeleton with SMPL's names has SMPL's tree.
///
/// A file of 24 joints without names is read with SMPL's names, which are wrong for another tree.
fn assumed_names(skeleton: &Skeleton) -> Option<Finding> {
    let is_smpl = skeleton.names() == SMPL_JOINT_NAMES;
    (is_smpl && skeleton.to_parts().parents != SMPL_PARENTS).then(|| {
        Finding::new(
            "skeleton",
            "24 joints with SMPL's names in another tree than SMPL's",
            "joints in another order, such as Blender's, without their names",
            "store the joints' own names as joint_names",
        )
    })
}

/// Checks that the body stands along +Y, faces +Z and has its left side at +X.
///
/// Skeletons whose joint names do not identify the feet are not checked.
fn orientation(skeleton: &Skeleton) -> Option<Finding> {
    let [left_ankle, left_foot, right_ankle, right_foot] = feet_by_name(skeleton.names())?;
    let joints = skeleton.joints();
    let ankles = 0.5 * (joints[left_ankle] + joints[right_ankle]);
    let up = (joints[skeleton.root()] - ankles).normalize_or_zero();
    if up.y < MIN_AXIS_COSINE {
        let (axis, remedy) = match axis_of(up) {
            "+Z" => (
                "Z up",
                "export with Y up, or turn the character by -90 degrees about X",
            ),
            "-Y" => ("upside down", "turn the character by 180 degrees about Z"),
            _ => ("another axis up", "export with Y up"),
        };
        return Some(Finding::new(
            "skeleton",
            format!("a trunk that points along {}", axis_of(up)),
            axis,
            remedy,
        ));
    }
    // The sum of both feet: feet that point outwards cancel sideways.
    let toes = (joints[left_foot] - joints[left_ankle]) + (joints[right_foot] - joints[right_ankle]);
    let forward = Vec3::new(toes.x, 0.0, toes.z).normalize_or_zero();
    if forward.z < MIN_AXIS_COSINE && forward != Vec3::ZERO {
        return Some(Finding::new(
            "skeleton",
            format!("feet that point along {}", axis_of(forward)),
            "a character that does not face +Z",
            "turn the character about Y until it faces +Z",
        ));
    }
    let is_swapped = joints[left_ankle].x < joints[right_ankle].x;
    is_swapped.then(|| {
        Finding::new(
            "skeleton",
            "left joints on the right side (-X)",
            "a mirrored character, or the viewer's left",
            "mirror it, or exchange the names of left and right",
        )
    })
}

/// Returns the name of the signed coordinate axis nearest to a direction.
fn axis_of(direction: Vec3) -> &'static str {
    let axes = [
        ("+X", Vec3::X),
        ("-X", Vec3::NEG_X),
        ("+Y", Vec3::Y),
        ("-Y", Vec3::NEG_Y),
        ("+Z", Vec3::Z),
        ("-Z", Vec3::NEG_Z),
    ];
    let most = axes
        .iter()
        .max_by(|a, b| direction.dot(a.1).total_cmp(&direction.dot(b.1)));
    most.map_or("none", |(name, _)| name)
}

/// Checks that at least two joints move the body.
fn weights(character: &Character) -> Option<Finding> {
    let weights = &character.weights;
    let mut moving = HashSet::new();
    for vertex in 0..weights.len() {
        moving.extend(
            weights
                .row(vertex)
                .filter(|(_, weight)| *weight > 0.0)
                .map(|(joint, _)| joint),
        );
        // Most bodies return here after a few vertices.
        if moving.len() > 1 {
            return None;
        }
    }
    (character.skeleton.len() > 1).then(|| {
        Finding::new(
            "skinning weights",
            "a body that follows one joint alone",
            "a mesh exported without its skin",
            "bind the mesh to the skeleton and export its weights",
        )
    })
}

/// Checks that body and skeleton have one unit and one place.
fn misplaced_skeleton(character: &Character) -> Option<Finding> {
    let (low, high) = bounds(&character.body.vertices)?;
    let (joint_low, joint_high) = bounds(character.skeleton.joints())?;
    let [body, joints] = [(high - low).length(), (joint_high - joint_low).length()];
    let centre = 0.5 * (joint_low + joint_high);
    // The centre of the joints may lie a quarter of the body's extent outside: skeletons carry
    // control joints on the ground or above the head.
    let room = 0.25 * (high - low).max_element();
    let is_inside = centre.cmpge(low - room).all() && centre.cmple(high + room).all();
    let ratio = joints / body.max(f32::MIN_POSITIVE);
    if ratio > MAX_EXTENT_RATIO {
        let Diagnosis { probably, remedy } = diagnose(ratio, "the joints");
        let found = format!("joints {ratio:.0} times as far apart as the body is large");
        return Some(Finding::new("skeleton", found, probably, remedy));
    }
    (!is_inside).then(|| {
        let away = centre.distance(0.5 * (low + high));
        Finding::new(
            "skeleton",
            format!("joints {away:.2} m away from the body"),
            "a transform of the mesh or of the rig that was not applied",
            "apply all transforms and export again",
        )
    })
}
