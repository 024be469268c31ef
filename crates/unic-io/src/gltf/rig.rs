//! Rigs: joints in the bind pose, and their motion relative to it.

use super::{
    animation::{NodeAnimation, Timeline},
    container::Container,
    joint_nodes::JointNodes,
    rest_space::{check_scale, rest_from_space, rotation_of},
    scene::{Local, Scene},
    skin::SkinnedMesh,
};
use crate::error::{Error, Result};
use glam::{Mat3, Mat4, Vec3};
use std::collections::{HashMap, HashSet};
use unic_core::{
    character::Character,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    transform::Rigid,
};

/// Distance from the bind pose up to which the nodes of a file stand in it, metres.
pub(super) const SAME_PLACE_M: f32 = 1e-3;

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

impl RigJoint {
    /// Makes a joint; None if its matrix has no inverse.
    fn new(node: usize, name: String, parent: Option<usize>, joint_from_rest: Mat4) -> Option<Self> {
        let rest_from_joint = joint_from_rest.inverse();
        (rest_from_joint.is_finite() && joint_from_rest.is_finite()).then(|| Self {
            node,
            name,
            parent,
            position: rest_from_joint.w_axis.truncate(),
            joint_from_rest,
        })
    }
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
            let name = rig.scene.names[*node].clone();
            let Some(joint) = RigJoint::new(*node, name, parent, joint_from_rest) else {
                let found = format!("another at {}", rig.scene.names[*node]);
                return Err(container.error("bind matrices that can be inverted", found));
            };
            let off = joint.position.distance(world[*node].w_axis.truncate());
            if off > farthest.0 {
                farthest = (off, joint.name.clone());
            }
            rig.joints.push(joint);
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

/// Transforms of all nodes at one time, kept between frames.
#[derive(Default)]
pub(super) struct RigScratch {
    locals: Vec<Local>,
    world: Vec<Mat4>,
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
