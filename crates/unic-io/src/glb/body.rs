//! The body: a mesh in its bind pose and the influences of the joints.

use super::{
    binary::{Binary, Usage},
    json::{Attributes, Index},
    seams::Seams,
    shapes::Shape,
};
use crate::error::Result;
use glam::Mat4;
use unic_core::{character::Character, skeleton::Skeleton, skinning::SkinningWeights, transform::Rigid};

/// A body in the file.
#[derive(Debug)]
pub(super) struct SkinnedMesh {
    pub(super) attributes: Attributes,
    pub(super) indices: Index,
    /// One matrix a joint.
    pub(super) inverse_bind_matrices: Index,
}

/// Influences that one set of attributes holds.
const SET: usize = 4;

pub(super) fn write(character: &Character, seams: &Seams, binary: &mut Binary) -> Result<SkinnedMesh> {
    let mut shape = Shape::default();
    shape.compute(&character.body.vertices, &character.body.faces, seams);
    let (mut attributes, indices) = shape.write(seams, binary)?;
    write_influences(&character.weights, seams, &mut attributes, binary)?;
    let matrices = joint_from_bind(&character.skeleton);
    Ok(SkinnedMesh {
        attributes,
        indices,
        inverse_bind_matrices: binary.write(Usage::Data, &matrices)?,
    })
}

fn joint_from_bind(skeleton: &Skeleton) -> Vec<Mat4> {
    let mut bind_from_joint = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind_from_joint);
    let matrix = |t: &Rigid| {
        let inverse = t.inverse();
        Mat4::from_rotation_translation(inverse.rotation, inverse.translation)
    };
    bind_from_joint.iter().map(matrix).collect()
}

/// As many sets as the vertex with the most influences needs, heaviest first.
fn write_influences(
    weights: &SkinningWeights,
    seams: &Seams,
    attributes: &mut Attributes,
    binary: &mut Binary,
) -> Result<()> {
    let rows: Vec<_> = (0..weights.len()).map(|v| influences(weights, v)).collect();
    let most = rows.iter().map(Vec::len).max().unwrap_or(0);
    for set in 0..most.div_ceil(SET) {
        let of = |&v: &u32| entries(&rows[v as usize], set);
        let (joints, weights): (Vec<_>, Vec<_>) = seams.sources.iter().map(of).unzip();
        let joints = write_joints(&joints, binary)?;
        attributes.insert(format!("JOINTS_{set}"), joints);
        let weights = binary.write(Usage::Vertices, &weights)?;
        attributes.insert(format!("WEIGHTS_{set}"), weights);
    }
    Ok(())
}

/// Joint and weight, each joint once: glTF forbids what adds up all the same.
fn influences(weights: &SkinningWeights, vertex: usize) -> Vec<(u16, f32)> {
    let mut row: Vec<(u16, f32)> = Vec::new();
    for (joint, weight) in weights.row(vertex) {
        let joint = joint as u16;
        match row.iter_mut().find(|(other, _)| *other == joint) {
            Some((_, sum)) => *sum += weight,
            None => row.push((joint, weight)),
        }
    }
    row
}

/// One set of a row; joint 0 without weight fills it up.
fn entries(row: &[(u16, f32)], set: usize) -> ([u16; SET], [f32; SET]) {
    let mut entries = ([0; SET], [0.0; SET]);
    for (slot, &(joint, weight)) in row.iter().skip(set * SET).take(SET).enumerate() {
        entries.0[slot] = joint;
        entries.1[slot] = weight;
    }
    entries
}

/// In bytes where they suffice.
fn write_joints(joints: &[[u16; SET]], binary: &mut Binary) -> Result<Index> {
    let small: Option<Vec<[u8; SET]>> = (joints.iter())
        .map(|set| set.iter().all(|&j| j < 256).then(|| set.map(|j| j as u8)))
        .collect();
    match small {
        Some(small) => binary.write(Usage::Vertices, &small),
        None => binary.write(Usage::Vertices, joints),
    }
}
