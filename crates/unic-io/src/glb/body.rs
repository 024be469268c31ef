//! Writing the body: its mesh in the bind pose and the influences of the joints.

use super::{
    binary::{BinaryWriter, BufferUsage},
    file_mesh::FileMesh,
    json::{Attributes, Index},
    surface::{SurfaceBuffers, WrittenSurface},
};
use crate::error::Result;
use glam::Mat4;
use unic_core::{
    character::Character, mesh::SeamSplit, skeleton::Skeleton, skinning::SkinningWeights, transform::Rigid,
};

/// Accessors of a written body.
#[derive(Debug)]
pub(super) struct SkinnedMesh {
    pub(super) attributes: Attributes,
    pub(super) indices: Index,
    /// One matrix for each joint.
    pub(super) inverse_bind_matrices: Index,
}

/// Number of influences in one set of attributes, fixed by the specification.
const SET: usize = 4;

/// Influence of a joint on a vertex.
struct Influence {
    joint: u16,
    weight: f32,
}

pub(super) fn write(
    character: &Character,
    mesh: &FileMesh,
    binary: &mut BinaryWriter,
) -> Result<SkinnedMesh> {
    let mut surface = SurfaceBuffers::default();
    surface.compute(&character.body.vertices, mesh);
    let WrittenSurface {
        mut attributes,
        indices,
    } = surface.write(mesh, binary)?;
    write_influences(&character.weights, &mesh.split, &mut attributes, binary)?;
    let matrices = joint_from_bind(&character.skeleton);
    Ok(SkinnedMesh {
        attributes,
        indices,
        inverse_bind_matrices: binary.write(BufferUsage::Data, &matrices)?,
    })
}

/// Returns the inverse bind matrices: `joint_from_world` in the bind pose.
fn joint_from_bind(skeleton: &Skeleton) -> Vec<Mat4> {
    let mut bind_from_joint = Vec::new();
    skeleton.forward_kinematics(&skeleton.bind_pose(), &mut bind_from_joint);
    let matrix = |t: &Rigid| {
        let inverse = t.inverse();
        Mat4::from_rotation_translation(inverse.rotation, inverse.translation)
    };
    bind_from_joint.iter().map(matrix).collect()
}

/// Writes as many sets of influences as the vertex with the most needs, heaviest first.
fn write_influences(
    weights: &SkinningWeights,
    seams: &SeamSplit,
    attributes: &mut Attributes,
    binary: &mut BinaryWriter,
) -> Result<()> {
    let rows: Vec<_> = (0..weights.len()).map(|v| influences(weights, v)).collect();
    let most = rows.iter().map(Vec::len).max().unwrap_or(0);
    for set in 0..most.div_ceil(SET) {
        let padded = |&v: &u32| padded_set(&rows[v as usize], set);
        let (joints, weights): (Vec<_>, Vec<_>) = seams.sources.iter().map(padded).unzip();
        let joints = write_joints(&joints, binary)?;
        attributes.insert(format!("JOINTS_{set}"), joints);
        let weights = binary.write(BufferUsage::Vertices, &weights)?;
        attributes.insert(format!("WEIGHTS_{set}"), weights);
    }
    Ok(())
}

/// Returns the influences on a vertex, each joint once.
///
/// A row of weights may name a joint twice, which glTF forbids: such weights are summed.
fn influences(weights: &SkinningWeights, vertex: usize) -> Vec<Influence> {
    let mut row: Vec<Influence> = Vec::new();
    for (joint, weight) in weights.row(vertex) {
        // glTF has no wider joint indices.
        let joint = joint as u16;
        match row.iter_mut().find(|other| other.joint == joint) {
            Some(other) => other.weight += weight,
            None => row.push(Influence { joint, weight }),
        }
    }
    row
}

/// Returns the joints and the weights of one set of a row, padded with joint 0 of weight zero.
fn padded_set(row: &[Influence], set: usize) -> ([u16; SET], [f32; SET]) {
    let (mut joints, mut weights) = ([0; SET], [0.0; SET]);
    for (slot, influence) in row.iter().skip(set * SET).take(SET).enumerate() {
        joints[slot] = influence.joint;
        weights[slot] = influence.weight;
    }
    (joints, weights)
}

/// Writes joint indices as bytes if all of them fit, else as 16-bit numbers.
fn write_joints(joints: &[[u16; SET]], binary: &mut BinaryWriter) -> Result<Index> {
    // Half the size for the common skeletons of up to 256 joints.
    let small: Option<Vec<[u8; SET]>> = (joints.iter())
        .map(|set| set.iter().all(|&j| j < 256).then(|| set.map(|j| j as u8)))
        .collect();
    match small {
        Some(small) => binary.write(BufferUsage::Vertices, &small),
        None => binary.write(BufferUsage::Vertices, joints),
    }
}
