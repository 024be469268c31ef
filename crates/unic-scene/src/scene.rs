//! Plain scenes: nodes, meshes, skins and one sampled animation.

use glam::{Mat4, Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Content of a file, in metres, +Y up, right-handed.
///
/// A [`Request`](crate::Request) decides which parts are filled. All indices are in range, all
/// numbers are finite and nodes form a tree: [`Scene::check`] proves it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Program that wrote the file, if it says so.
    pub generator: Option<String>,
    /// Unit and up axis of the file, as `centimetres, Z up`.
    pub units: String,
    /// Nodes: those of meshes and joints, and all above them.
    pub nodes: Vec<Node>,
    /// Skins, of which several meshes may share one.
    pub skins: Vec<Skin>,
    /// Meshes in the order of the file.
    pub meshes: Vec<Mesh>,
    /// Names of the animations of nodes. The first is the one that is sampled.
    pub animations: Vec<String>,
    /// Animation of the nodes, if it is asked for and there is one.
    pub motion: Option<Motion>,
    /// Conversions and assumptions, one sentence each.
    pub notes: Vec<String>,
}

/// Node of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Node {
    /// Name; `node_3` where the file has none.
    pub name: String,
    /// Index of the parent.
    pub parent: Option<usize>,
    /// `parent_from_node` outside any animation.
    pub local: Local,
}

/// Transform in parts, as animations change it. Scale acts first, translation last.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Local {
    /// Translation in the unit of the parent.
    pub translation: Vec3,
    /// Rotation, of length 1.
    pub rotation: Quat,
    /// Scale along each axis.
    pub scale: Vec3,
}

impl Local {
    /// Transform that changes nothing.
    pub const IDENTITY: Self = Self {
        translation: Vec3::ZERO,
        rotation: Quat::IDENTITY,
        scale: Vec3::ONE,
    };

    /// Takes a matrix apart. Shear is lost.
    pub fn from_matrix(matrix: Mat4) -> Self {
        let (scale, rotation, translation) = matrix.to_scale_rotation_translation();
        Self {
            translation,
            rotation,
            scale,
        }
    }

    /// Returns the transform as a matrix.
    pub fn matrix(self) -> Mat4 {
        Mat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// Joints that move the vertices of meshes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Skin {
    /// Nodes of the joints.
    pub joints: Vec<usize>,
    /// `joint_from_mesh` of each joint at bind time.
    pub inverse_binds: Vec<Mat4>,
    /// `world_from_mesh` at bind time, where the file states it.
    pub world_from_mesh: Option<Mat4>,
}

/// Mesh of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mesh {
    /// Name; unique where the file's own names are.
    pub name: String,
    /// Number of vertices.
    pub vertices: usize,
    /// Number of triangles.
    pub triangles: usize,
    /// Number of samples of its points over time; 0 where they do not change.
    pub samples: usize,
    /// Index of the skin.
    pub skin: Option<usize>,
    /// Points and faces, if they are asked for.
    pub shape: Option<Shape>,
    /// Points over time, if they are asked for.
    pub points: Option<PointSamples>,
}

/// Points and faces of a mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Shape {
    /// Points in the space of the mesh, or of its skin if it has one.
    pub points: Vec<Vec3>,
    /// Triangles.
    pub faces: Vec<[u32; 3]>,
    /// Entries of (index among the skin's joints, weight) for each point; empty without a skin.
    pub weights: Vec<Vec<(u16, f32)>>,
}

/// Points of a mesh over time, in world space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointSamples {
    /// Frames per second, where the times of the samples show it.
    pub fps: Option<f32>,
    /// Points of each frame.
    pub frames: Vec<Vec<Vec3>>,
}

/// Animation of nodes, sampled at a constant rate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Name, if the file has one.
    pub name: Option<String>,
    /// Frames per second.
    pub fps: f32,
    /// Origin of the rate, to follow "30 frames at 24 fps".
    pub rate: String,
    /// Number of frames.
    pub frames: usize,
    /// Transforms of the nodes that move. The others stay.
    pub tracks: Vec<Track>,
}

/// Transforms of a node over time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Track {
    /// Index of the node.
    pub node: usize,
    /// `parent_from_node` in each frame.
    pub locals: Vec<Local>,
}
