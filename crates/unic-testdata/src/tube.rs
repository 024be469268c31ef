//! Figure of six joints in a tube, symmetric left to right.

use crate::capture::Figure;
use glam::Vec3;
use std::{f32::consts::TAU, ops::Range};
use unic_core::{
    character::{Character, Garment},
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Number of vertices around the garment.
const SIDES: u32 = 12;

/// Number of rings of vertices along the garment.
const RINGS: u32 = 5;

/// Number of vertices around the body.
const BODY_SIDES: u32 = 16;

/// Number of rings of vertices along the body.
const BODY_RINGS: u32 = 17;

/// Number of vertices of the garment.
pub const VERTICES: usize = (SIDES * RINGS) as usize;

/// Number of vertices of the body.
pub const BODY_VERTICES: usize = (BODY_SIDES * BODY_RINGS) as usize;

/// Number of joints of the skeleton: hip, chest, left and right arm, left and right foot.
pub const JOINTS: usize = 6;

const NAMES: [&str; JOINTS] = ["hip", "chest", "L_arm", "R_arm", "L_foot", "R_foot"];
const PARENTS: [i64; JOINTS] = [-1, 0, 1, 1, 0, 0];
/// Positions of the joints in the rest pose, metres.
const PLACES: [[f32; 3]; JOINTS] = [
    [0.0, 0.9, 0.0],
    [0.0, 1.2, 0.0],
    [0.2, 1.4, 0.0],
    [-0.2, 1.4, 0.0],
    [0.1, 0.1, 0.0],
    [-0.1, 0.1, 0.0],
];

impl Figure {
    /// Figure whose body is a column of 0.15 m radius, in a tube of 0.16 m radius.
    ///
    /// The tube is so tight that it intersects the body when it swings.
    pub fn tube() -> Self {
        let body = cylinder(0.15, 0.0..1.6, BODY_RINGS, BODY_SIDES);
        let rest = cylinder(0.16, 0.7..1.4, RINGS, SIDES);
        let skeleton = Skeleton::new(SkeletonParts {
            names: NAMES.map(str::to_owned).to_vec(),
            parents: PARENTS.to_vec(),
            joints: PLACES.map(Vec3::from_array).to_vec(),
            ..SkeletonParts::default()
        });
        Self {
            character: Character {
                weights: weights(&body),
                body,
                skeleton: skeleton.unwrap(),
                file_mesh: None,
            },
            garment: {
                let weights = weights(&rest);
                Garment::new(rest, weights)
            },
            // There are no ankles: each foot stands for both contacts of its leg.
            contact_joints: [4, 4, 5, 5],
        }
    }
}

/// Index of the mirror image of a vertex of the tube.
pub fn opposite(vertex: u32) -> u32 {
    let (ring, side) = (vertex / SIDES, vertex % SIDES);
    ring * SIDES + (SIDES - side) % SIDES
}

/// Open cylinder around +Y within a range of heights, metres.
///
/// It is symmetric in x: vertex `side` of a ring is the mirror image of `sides − side`.
fn cylinder(radius: f32, heights: Range<f32>, rings: u32, sides: u32) -> TriMesh {
    let vertex = |i: u32| {
        let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let y = heights.start + (heights.end - heights.start) * (i / sides) as f32 / (rings - 1) as f32;
        Vec3::new(radius * sin, y, radius * cos)
    };
    let quad = |i: u32| {
        let (ring, side) = (i / sides, i % sides);
        let [a, b] = [ring * sides + side, ring * sides + (side + 1) % sides];
        [[a, b, b + sides], [a, b + sides, a + sides]]
    };
    let vertices = (0..rings * sides).map(vertex).collect();
    TriMesh::new(vertices, (0..(rings - 1) * sides).flat_map(quad).collect()).unwrap()
}

/// Skinning weights that pass from hip to chest with the height, with a little of the arm on each
/// side.
fn weights(mesh: &TriMesh) -> SkinningWeights {
    let row = |v: &Vec3| {
        let upper = ((v.y - 0.9) / 0.4).clamp(0.0, 1.0);
        let arm = |x: f32| upper * (2.0 * x).clamp(0.0, 0.4);
        let (left, right) = (arm(v.x), arm(-v.x));
        // In the order of the joints; the feet carry nothing. The sum is 1.
        [1.0 - upper, upper - left - right, left, right, 0.0, 0.0]
    };
    let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
    SkinningWeights::from_dense(&dense, mesh.vertices.len(), JOINTS).unwrap()
}
