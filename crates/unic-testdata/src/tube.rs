//! A figure of six joints in a tube, symmetric left to right.

use crate::capture::Figure;
use glam::Vec3;
use std::f32::consts::TAU;
use unic_core::{
    character::{Character, Garment},
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// Around and along the garment.
const SIDES: u32 = 12;
const RINGS: u32 = 5;
/// Around and along the body.
const BODY_SIDES: u32 = 16;
const BODY_RINGS: u32 = 17;

/// Vertices of the garment.
pub const VERTICES: usize = (SIDES * RINGS) as usize;
/// Vertices of the body.
pub const BODY_VERTICES: usize = (BODY_SIDES * BODY_RINGS) as usize;
/// Joints of the skeleton: hip, chest, left and right arm, left and right foot.
pub const JOINTS: usize = 6;

const NAMES: [&str; JOINTS] = ["hip", "chest", "L_arm", "R_arm", "L_foot", "R_foot"];
const PARENTS: [i64; JOINTS] = [-1, 0, 1, 1, 0, 0];
/// Metres.
const PLACES: [[f32; 3]; JOINTS] = [
    [0.0, 0.9, 0.0],
    [0.0, 1.2, 0.0],
    [0.2, 1.4, 0.0],
    [-0.2, 1.4, 0.0],
    [0.1, 0.1, 0.0],
    [-0.1, 0.1, 0.0],
];

impl Figure {
    /// The body is a column of 0.15 m radius; the garment is so tight that it cuts into it when it
    /// swings.
    pub fn tube() -> Self {
        let body = cylinder(0.15, 0.0, 1.6, [BODY_RINGS, BODY_SIDES]);
        let rest = cylinder(0.16, 0.7, 1.4, [RINGS, SIDES]);
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
            },
            garment: {
                let weights = weights(&rest);
                Garment::new(rest, weights)
            },
            contact_joints: [4, 4, 5, 5],
        }
    }
}

/// The tube's garment vertex on the other side.
pub fn opposite(vertex: u32) -> u32 {
    let (ring, side) = (vertex / SIDES, vertex % SIDES);
    ring * SIDES + (SIDES - side) % SIDES
}

/// Around +Y, symmetric in x: vertex `side` of a ring is the mirror image of `sides − side`.
fn cylinder(radius: f32, from: f32, to: f32, [rings, sides]: [u32; 2]) -> TriMesh {
    let vertex = |i: u32| {
        let (sin, cos) = (TAU * (i % sides) as f32 / sides as f32).sin_cos();
        let y = from + (to - from) * (i / sides) as f32 / (rings - 1) as f32;
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

/// From hip to chest by height, a little of the arm on each side.
fn weights(mesh: &TriMesh) -> SkinningWeights {
    let row = |v: &Vec3| {
        let upper = ((v.y - 0.9) / 0.4).clamp(0.0, 1.0);
        let arm = |x: f32| upper * (2.0 * x).clamp(0.0, 0.4);
        let (left, right) = (arm(v.x), arm(-v.x));
        [1.0 - upper, upper - left - right, left, right, 0.0, 0.0]
    };
    let dense: Vec<f32> = mesh.vertices.iter().flat_map(row).collect();
    SkinningWeights::from_dense(&dense, mesh.vertices.len(), JOINTS).unwrap()
}
