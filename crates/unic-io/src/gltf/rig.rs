//! Rigs: joints in the bind pose, and their motion relative to it.

use super::{
    animation::{NodeAnimation, Timeline},
    container::Container,
    joint_nodes::JointNodes,
    scene::{Local, Scene},
    skin::SkinnedMesh,
};
use crate::error::{Error, Result};
use glam::{Mat3, Mat4, Quat, Vec3};
use std::collections::{HashMap, HashSet};
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    transform::Rigid,
};

/// Distance from the bind pose up to which the nodes of a file stand in it, metres.
const SAME_PLACE_M: f32 = 1e-3;
/// Angle from the bind pose up to which the nodes of a file stand in it, radians. The arc cosine of
/// f32 quaternions is rounded to about 1e-3.
const SAME_ANGLE: f32 = 4e-3;
/// Largest relative difference of the scales along two axes.
const UNIFORM_SCALE: f32 = 1e-2;

/// Joints of a file in its bind pose, in world space: metres, Y up.
pub(super) struct Rig {
    scene: Scene,
    pub(super) joints: Vec<RigJoint>,
    /// Descriptions of what was converted, one sentence each.
    pub(super) notes: Vec<String>,
}

/// A joint of a [`Rig`].
pub(super) struct RigJoint {
    node: usize,
    pub(super) name: String,
    /// Index of the parent among the joints; none for the root.
    pub(super) parent: Option<usize>,
    /// Position in the bind pose, metres, world space.
    pub(super) position: Vec3,
    /// `joint_from_rest`: the inverse of the joint's transform in the bind pose.
    joint_from_rest: Mat4,
}

/// A character with the vertices of its file.
pub(super) struct RiggedBody {
    pub(super) character: Character,
    pub(super) rig: Rig,
    /// Name of the mesh.
    pub(super) name: String,
    /// Vertex of the body for each vertex of the file.
    pub(super) vertex_of_file: Vec<u32>,
}

/// Nodes that are joints, with `joint_from_space` at bind time in a space that all share.
struct Binds {
    nodes: Vec<usize>,
    inverse: Vec<Mat4>,
}

impl RiggedBody {
    /// Reads the skinned mesh of a file with its skeleton.
    ///
    /// # Errors
    /// The errors of [`SkinnedMesh::read`]; several roots without a node above them; scales that
    /// differ by axis, mirrored meshes; vertices without weight.
    pub(super) fn read(container: &Container) -> Result<Self> {
        let mesh = SkinnedMesh::read(container)?;
        let weighted: HashSet<usize> = (mesh.weights.iter().flatten())
            .filter_map(|(joint, _)| mesh.joints.get(usize::from(*joint)).copied())
            .collect();
        let binds = Binds {
            nodes: mesh.joints.clone(),
            inverse: mesh.inverse_binds.clone(),
        };
        let (mut rig, rest_from_mesh) = Rig::new(container, binds, &weighted)?;
        if mesh.vertices.len() < mesh.vertex_of_file.len() {
            rig.notes.push(format!(
                "{} of {} vertices remain where copies along seams are welded",
                mesh.vertices.len(),
                mesh.vertex_of_file.len()
            ));
        }
        let vertices: Vec<Vec3> = (mesh.vertices.iter())
            .map(|v| rest_from_mesh.transform_point3(*v))
            .collect();
        let body = TriMesh::new(vertices, mesh.faces).map_err(|source| Error::Mesh {
            path: container.path.clone(),
            source,
        })?;
        let places = rig.places();
        // A joint that was left out has no weights.
        let joint = |joint: u16| {
            mesh.joints
                .get(usize::from(joint))
                .and_then(|node| places.get(node))
        };
        let rows = mesh.weights.iter().map(|row| {
            let entries = row.iter().filter_map(|(j, weight)| Some((*joint(*j)?, *weight)));
            entries.collect::<Vec<_>>().into_iter()
        });
        let weights =
            SkinningWeights::from_rows(rig.joints.len(), rows).map_err(|source| Error::Weights {
                path: container.path.clone(),
                source,
            })?;
        Ok(Self {
            character: Character {
                body,
                skeleton: rig.skeleton(container)?,
                weights,
            },
            rig,
            name: mesh.name,
            vertex_of_file: mesh.vertex_of_file,
        })
    }
}

impl Rig {
    /// Reads the joints of a file for its motion: those of the first skin, else all animated nodes
    /// in the pose outside the animation.
    ///
    /// # Errors
    /// Those of [`RiggedBody::read`] about joints.
    pub(super) fn of_motion(container: &Container, animation: &NodeAnimation) -> Result<Self> {
        let scene = Scene::read(container)?;
        let skin = container
            .document
            .skins()
            .find(|skin| skin.inverse_bind_matrices().is_some());
        let binds = match &skin {
            Some(skin) => Binds::of_skin(container, skin)?,
            None => Binds::of_pose(&scene, animation),
        };
        // No joint is left out: the character may have each of them.
        let moving = binds.nodes.iter().copied().collect();
        Ok(Self::new(container, binds, &moving)?.0)
    }

    /// Makes the rig, and the transform from the space of the binds to the rest space.
    fn new(container: &Container, binds: Binds, moving: &HashSet<usize>) -> Result<(Self, Mat4)> {
        let scene = Scene::read(container)?;
        let mut world = Vec::new();
        scene.world(&scene.locals, &mut world);
        let joints = JointNodes::new(container, &scene, &binds.nodes, moving)?;
        let inverse: HashMap<usize, Mat4> = binds.nodes.iter().copied().zip(binds.inverse).collect();
        let rest_from_space = rest_from_space(&scene, &world, &joints, &inverse);
        check_scale(container, rest_from_space)?;
        let space_from_rest = rest_from_space.inverse();
        let mut rig = Self {
            scene,
            joints: Vec::new(),
            notes: joints.notes,
        };
        let mut farthest = (0.0, String::new());
        for (node, parent) in joints.nodes.iter().zip(joints.parents) {
            let joint_from_rest = match inverse.get(node) {
                Some(inverse) => *inverse * space_from_rest,
                // A node above the joints stands where the file has it.
                None => world[*node].inverse(),
            };
            let rest_from_joint = joint_from_rest.inverse();
            if !(rest_from_joint.is_finite() && joint_from_rest.is_finite()) {
                let found = format!("another at {}", rig.scene.names[*node]);
                return Err(container.error("bind matrices that can be inverted", found));
            }
            let position = rest_from_joint.w_axis.truncate();
            let off = position.distance(world[*node].w_axis.truncate());
            if off > farthest.0 {
                farthest = (off, rig.scene.names[*node].clone());
            }
            rig.joints.push(RigJoint {
                node: *node,
                name: rig.scene.names[*node].clone(),
                parent,
                position,
                joint_from_rest,
            });
        }
        if farthest.0 > SAME_PLACE_M {
            rig.notes.push(format!(
                "the nodes do not stand in the bind pose, {} by {:.0} mm: the bind pose is the rest pose",
                farthest.1,
                1e3 * farthest.0
            ));
        }
        Ok((rig, rest_from_space))
    }

    /// Index among the joints for each node that is one.
    fn places(&self) -> HashMap<usize, usize> {
        let nodes = self.joints.iter().enumerate();
        nodes.map(|(index, joint)| (joint.node, index)).collect()
    }

    /// Makes the skeleton, whose joints have the axes of the world in the bind pose: its zero pose.
    fn skeleton(&self, container: &Container) -> Result<Skeleton> {
        let parent = |joint: &RigJoint| joint.parent.map_or(-1, |parent| parent as i64);
        let parts = SkeletonParts {
            names: self.joints.iter().map(|joint| joint.name.clone()).collect(),
            parents: self.joints.iter().map(parent).collect(),
            joints: self.joints.iter().map(|joint| joint.position).collect(),
            rest_pose: Vec::new(),
        };
        Skeleton::new(parts).map_err(|source| Error::Skeleton {
            path: container.path.clone(),
            source,
        })
    }

    /// Returns the poses of a timeline, one at a time, into `out`: for each joint the rotation from
    /// the bind pose, and the position in metres, world space.
    pub(super) fn frame(
        &self,
        animation: &NodeAnimation,
        timeline: Timeline,
        frame: usize,
        scratch: &mut RigScratch,
        out: &mut Vec<Rigid>,
    ) {
        scratch.locals.clone_from(&self.scene.locals);
        animation.apply(timeline.time(frame), &mut scratch.locals);
        self.scene.world(&scratch.locals, &mut scratch.world);
        out.clear();
        out.extend(self.joints.iter().map(|joint| {
            let world_from_rest = scratch.world[joint.node] * joint.joint_from_rest;
            let linear = Mat3::from_mat4(world_from_rest);
            Rigid::new(
                rotation_of(linear),
                world_from_rest.transform_point3(joint.position),
            )
        }));
    }
}

/// Returns the transform from the space of the binds to the world, which a skin does not state.
///
/// Where the nodes stand in the bind pose, it is the same for all of them. Where they stand in
/// another pose, as in the first frame of an animation, the root is turned and moved by that pose:
/// the axes of the world or of the node above are taken then, whichever are nearer.
fn rest_from_space(
    scene: &Scene,
    world: &[Mat4],
    joints: &JointNodes,
    inverse: &HashMap<usize, Mat4>,
) -> Mat4 {
    let own = |node: &usize| Some(world[*node] * *inverse.get(node)?);
    let mut all = joints.nodes.iter().filter_map(own);
    let Some(first) = all.next() else {
        return Mat4::IDENTITY;
    };
    let scale = first.x_axis.truncate().length();
    let is_same = |other: Mat4| {
        let turned = rotation_of(Mat3::from_mat4(other)).angle_between(rotation_of(Mat3::from_mat4(first)));
        let moved = other.w_axis.distance(first.w_axis);
        turned < SAME_ANGLE && moved < SAME_PLACE_M
    };
    if all.all(is_same) {
        return first;
    }
    let above = scene.parents[joints.nodes[0]].map_or(Mat4::IDENTITY, |parent| world[parent]);
    let turn = rotation_of(Mat3::from_mat4(first));
    let candidates = [Mat4::IDENTITY, above].map(|matrix| {
        let rotation = rotation_of(Mat3::from_mat4(matrix));
        (rotation, matrix.w_axis.truncate())
    });
    let off = |(rotation, _): &(Quat, Vec3)| rotation.angle_between(turn);
    let [world_axes, above] = candidates;
    let (rotation, translation) = match off(&world_axes) <= off(&above) {
        true => world_axes,
        false => above,
    };
    Mat4::from_scale_rotation_translation(Vec3::splat(scale), rotation, translation)
}

/// Transforms of all nodes at one time, kept between frames.
#[derive(Default)]
pub(super) struct RigScratch {
    locals: Vec<Local>,
    world: Vec<Mat4>,
}

/// Rotation of a matrix that may scale.
fn rotation_of(linear: Mat3) -> Quat {
    let x = linear.x_axis.normalize_or(Vec3::X);
    let y = linear
        .y_axis
        .reject_from_normalized(x)
        .normalize_or(x.any_orthonormal_vector());
    Quat::from_mat3(&Mat3::from_cols(x, y, x.cross(y))).normalize()
}

fn check_scale(container: &Container, matrix: Mat4) -> Result<()> {
    let linear = Mat3::from_mat4(matrix);
    let lengths = [linear.x_axis, linear.y_axis, linear.z_axis].map(Vec3::length);
    let [low, high] = [f32::min, f32::max].map(|pick| lengths.into_iter().fold(lengths[0], pick));
    if !(low > 0.0 && high.is_finite()) || high - low > UNIFORM_SCALE * high {
        let found = format!("{lengths:?}");
        return Err(container.error("a body of the same scale along all axes", found));
    }
    match linear.determinant() > 0.0 {
        true => Ok(()),
        false => Err(container.error("a body that is not mirrored", "a mirrored one")),
    }
}

impl Binds {
    fn of_skin(container: &Container, skin: &gltf::Skin) -> Result<Self> {
        let nodes: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
        let Some(binds) = skin.inverse_bind_matrices() else {
            return Err(container.error("inverse bind matrices of the skin", "none"));
        };
        let binds = container.floats(&binds, gltf::accessor::Dimensions::Mat4)?;
        if nodes.is_empty() || binds.count < nodes.len() {
            let expected = format!("an inverse bind matrix for each of {} joints", nodes.len());
            return Err(container.error(expected, binds.count.to_string()));
        }
        let inverse = binds
            .values
            .chunks_exact(16)
            .map(Mat4::from_cols_slice)
            .take(nodes.len());
        Ok(Self {
            inverse: inverse.collect(),
            nodes,
        })
    }

    /// Animated nodes in the pose outside the animation.
    fn of_pose(scene: &Scene, animation: &NodeAnimation) -> Self {
        let mut nodes: Vec<usize> = animation.nodes().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut world = Vec::new();
        scene.world(&scene.locals, &mut world);
        Self {
            inverse: nodes.iter().map(|node| world[*node].inverse()).collect(),
            nodes,
        }
    }
}
