//! Test scene: a figure whose bind pose is not the zero pose, with up to six influences on a
//! vertex, in a garment with texture seams.

use crate::file::Glb;
use glam::{Quat, Vec2, Vec3};
use unic_core::{
    Pose,
    character::Character,
    mesh::{TriMesh, Uvs},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{
    Result,
    glb::{GlbScene, GlbWriter},
};

pub(crate) const FRAMES: usize = 12;
pub(crate) const FPS: f32 = 24.0;
const JOINTS: usize = 6;

#[derive(Clone)]
pub(crate) struct Scene {
    pub(crate) character: Character,
    pub(crate) garment: TriMesh,
    pub(crate) poses: Vec<Pose>,
    pub(crate) frames: Vec<Vec<Vec3>>,
    pub(crate) fps: f32,
    /// Number of frames announced to the writer.
    pub(crate) announced: usize,
}

/// Number of columns and of rows of quads in each sheet.
const GRID: u32 = 6;

/// A curved sheet.
fn sheet(depth: f32) -> TriMesh {
    let side = GRID + 1;
    let vertex = |i: u32| {
        let (x, y) = (
            (i % side) as f32 / GRID as f32 - 0.5,
            (i / side) as f32 / GRID as f32,
        );
        Vec3::new(x, 0.6 + y, depth - x * x)
    };
    let quad = |q: u32| {
        let a = q / GRID * side + q % GRID;
        [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]
    };
    TriMesh::new(
        (0..side * side).map(vertex).collect(),
        (0..GRID * GRID).flat_map(quad).collect(),
    )
    .unwrap()
}

/// Adds texture coordinates with a seam between the left and the right half.
fn with_seam(mut mesh: TriMesh) -> TriMesh {
    let count = mesh.vertices.len() as u32;
    let half =
        |face: &[u32; 3]| u32::from(face.iter().map(|&v| mesh.vertices[v as usize].x).sum::<f32>() > 0.0);
    let coordinates = [0.0, 0.5].iter().flat_map(|shift| {
        mesh.vertices
            .iter()
            .map(move |v| Vec2::new(shift + 0.1 * v.x, v.y))
    });
    mesh.uvs = Some(Uvs {
        coordinates: coordinates.collect(),
        faces: mesh
            .faces
            .iter()
            .map(|face| face.map(|v| v + count * half(face)))
            .collect(),
    });
    mesh
}

fn character() -> Character {
    let body = sheet(0.0);
    let joints: Vec<Vec3> = [
        [0.0, 1.0, 0.0],
        [0.1, 1.2, 0.0],
        [0.2, 1.4, 0.1],
        [-0.2, 1.4, 0.0],
        [0.1, 0.6, 0.0],
        [-0.1, 0.6, 0.1],
    ]
    .map(Vec3::from_array)
    .to_vec();
    // The vertices of the first column have two influences only.
    let weight = |v: &Vec3, j: usize| match v.x < -0.45 && j > 1 {
        true => 0.0,
        false => 1.0 / (0.05 + v.distance_squared(joints[j])),
    };
    let dense: Vec<f32> = (body.vertices.iter())
        .flat_map(|v| (0..JOINTS).map(move |j| (v, j)))
        .map(|(v, j)| weight(v, j))
        .collect();
    let skeleton = SkeletonParts {
        parents: vec![-1, 0, 1, 1, 0, 0],
        rest_pose: (0..JOINTS)
            .map(|j| Vec3::new(0.3, -0.2, 0.1 * j as f32))
            .collect(),
        joints,
        ..SkeletonParts::default()
    };
    Character {
        weights: SkinningWeights::from_dense(&dense, body.vertices.len(), JOINTS).unwrap(),
        skeleton: Skeleton::new(skeleton).unwrap(),
        body,
        file_mesh: None,
    }
}

/// The pose of a frame. The root makes a whole turn, after which its quaternion has the other sign.
fn pose(frame: usize) -> Pose {
    let s = frame as f32 / FPS;
    let local = |j: usize| {
        let turn = Quat::from_rotation_y(if j == 0 { 14.0 * s } else { (3.0 * s).sin() });
        (turn * Quat::from_rotation_x(0.4 * j as f32 * s)).normalize()
    };
    Pose {
        trans: Vec3::new(0.2 * s, 0.1 * (9.0 * s).sin(), 3.0 * s),
        // Signs of quaternions alternate here; in the file they must be continuous.
        local: (0..JOINTS)
            .map(|j| {
                if frame.is_multiple_of(2) {
                    local(j)
                } else {
                    -local(j)
                }
            })
            .collect(),
    }
}

impl Scene {
    pub(crate) fn new() -> Self {
        let garment = with_seam(sheet(0.1));
        let moved = |frame: usize, v: &Vec3| {
            let s = frame as f32 / FPS;
            pose(frame).trans + *v + 0.05 * Vec3::new((7.0 * v.y + 5.0 * s).sin(), (3.0 * s).cos(), v.x * s)
        };
        Self {
            character: character(),
            poses: (0..FRAMES).map(pose).collect(),
            frames: (0..FRAMES)
                .map(|t| garment.vertices.iter().map(|v| moved(t, v)).collect())
                .collect(),
            garment,
            fps: FPS,
            announced: FRAMES,
        }
    }

    /// Adds a chain of joints behind the last one, and binds the vertices to all joints.
    pub(crate) fn with_joint_chain(mut self, joints: usize) -> Self {
        let skeleton = &self.character.skeleton;
        let mut parts = skeleton.to_parts();
        for j in parts.joints.len()..joints {
            parts.names.push(format!("tail_{j}"));
            parts.parents.push(j as i64 - 1);
            parts.joints.push(parts.joints[j - 1] - 0.001 * Vec3::Y);
            parts.rest_pose.push(Vec3::ZERO);
            self.poses
                .iter_mut()
                .for_each(|pose| pose.local.push(Quat::from_rotation_z(0.01)));
        }
        let rows = (0..self.character.body.vertices.len()).map(|v| [(7 * v % joints, 1.0)].into_iter());
        self.character.weights = SkinningWeights::from_rows(joints, rows).unwrap();
        self.character.skeleton = Skeleton::new(parts).unwrap();
        self
    }

    /// Keeps the first frames only.
    pub(crate) fn cut(mut self, frames: usize) -> Self {
        self.poses.truncate(frames);
        self.frames.truncate(frames);
        self.announced = frames;
        self
    }

    pub(crate) fn body_frames(&self) -> Vec<Vec<Vec3>> {
        let Character {
            body,
            skeleton,
            weights,
            ..
        } = &self.character;
        let frame = |pose: &Pose| {
            let (mut joints, mut transforms, mut positions) = (Vec::new(), Vec::new(), Vec::new());
            skeleton.forward_kinematics(pose, &mut joints);
            skeleton.world_from_rest(&joints, &mut transforms);
            weights.skin(&body.vertices, &transforms, &mut positions);
            positions
        };
        self.poses.iter().map(frame).collect()
    }

    pub(crate) fn write(&self) -> Glb {
        Glb::parse(&self.bytes())
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.try_bytes().unwrap()
    }

    /// Writes the scene and returns the bytes of the file. Checks that no other file is left.
    pub(crate) fn try_bytes(&self) -> Result<Vec<u8>> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        let written = self.write_to(&path);
        let left = std::fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(left, usize::from(written.is_ok()));
        written.map(|()| std::fs::read(&path).unwrap())
    }

    fn write_to(&self, path: &std::path::Path) -> Result<()> {
        let scene = GlbScene {
            name: "walk",
            character: &self.character,
            garment: &self.garment,
            fps: self.fps,
            frames: self.announced,
        };
        let mut writer = GlbWriter::create(path, &scene)?;
        for (pose, frame) in self.poses.iter().zip(&self.frames) {
            writer.push(pose, frame)?;
        }
        writer.finish()
    }
}

pub(crate) fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}
