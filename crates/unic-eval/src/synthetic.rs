//! Synthetic scene for tests: a cube with two joints that walks, and a grid as its garment.

use crate::kinematics::PreparedClip;
use glam::{Quat, Vec3};
use unic_core::{
    Pose,
    character::{Character, Garment},
    clip::Clip,
    mesh::TriMesh,
    motion::{MotionLayout, MotionSpec, VelocityScheme},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{CapturedClip, GarmentFrames};

/// Cube from −1 to 1 on every axis. The root joint at the origin moves it, the second joint moves
/// nothing.
pub(crate) fn cube() -> Character {
    let corner = |i: usize| {
        let side = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        Vec3::new(side(0), side(1), side(2))
    };
    let faces = [
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
    ];
    let skeleton = Skeleton::new(SkeletonParts {
        parents: vec![-1, 0],
        joints: vec![Vec3::ZERO, Vec3::Y],
        ..SkeletonParts::default()
    });
    Character {
        body: TriMesh::new((0..8).map(corner).collect(), faces.to_vec()).unwrap(),
        skeleton: skeleton.unwrap(),
        weights: SkinningWeights::from_dense(&[1.0, 0.0].repeat(8), 8, 2).unwrap(),
        file_mesh: None,
    }
}

/// Grid of 6 × 6 vertices, 0.4 m apart and 1.5 m above the root, that follow both joints.
pub(crate) fn grid() -> Garment {
    let vertices: Vec<Vec3> = (0..36)
        .map(|i| Vec3::new((i % 6) as f32 * 0.4 - 1.0, 1.5, (i / 6) as f32 * 0.4 - 1.0))
        .collect();
    let square = |i: u32| {
        let a = i % 5 + i / 5 * 6;
        [[a, a + 6, a + 7], [a, a + 7, a + 1]]
    };
    let weights: Vec<f32> = (0..36)
        .flat_map(|i| [1.0 - i as f32 / 40.0, i as f32 / 40.0])
        .collect();
    Garment::new(
        TriMesh::new(vertices, (0..25).flat_map(square).collect()).unwrap(),
        SkinningWeights::from_dense(&weights, 36, 2).unwrap(),
    )
}

/// Motion specification with the heading layout.
pub(crate) fn spec() -> MotionSpec {
    MotionSpec::new(MotionLayout::Heading, VelocityScheme::Backward, [1; 4], &cube()).unwrap()
}

/// Pose of a walk along +Z at 0.3 m/s with a nodding joint.
pub(crate) fn pose(frame: usize) -> Pose {
    let t = frame as f32;
    Pose {
        trans: Vec3::Z * 0.01 * t,
        local: vec![Quat::IDENTITY, Quat::from_rotation_x(0.3 * (0.4 * t).sin())],
    }
}

/// Clip of [`pose`]s with the given garment frames, at 30 fps.
pub(crate) fn clip(character: &Character, garment: &[Vec<Vec3>]) -> PreparedClip {
    let numbers: Vec<f32> = garment.iter().flatten().flat_map(|v| v.to_array()).collect();
    let captured = CapturedClip {
        findings: Vec::new(),
        clip: Clip {
            name: "walk".into(),
            fps: 30.0,
            poses: (0..garment.len()).map(pose).collect(),
            ground_height: -1.0,
            wind: Vec::new(),
        },
        garment: GarmentFrames::new(numbers, garment.len(), garment[0].len()).unwrap(),
        body: None,
    };
    PreparedClip::new(&spec(), &character.skeleton, captured)
}
