//! What several test files share.
#![allow(
    dead_code,
    reason = "every test file is a program of its own and uses a part of this"
)]

use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    character::{Character, Garment},
    clip::Clip,
    mesh::{TriMesh, Uvs},
    skeleton::{Pose, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};

/// The real inputs beside the checkout; a missing one is reported as a skip.
pub(crate) fn data(below: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data")
        .join(below);
    if path.exists() {
        return Some(path);
    }
    eprintln!("skipped: {} is not there", path.display());
    None
}

/// A tetrahedron on a two-joint skeleton.
pub(crate) fn small_character() -> Character {
    let skeleton = Skeleton::new(SkeletonParts {
        names: vec!["hip".into(), "knée".into()],
        parents: vec![-1, 0],
        joints: vec![Vec3::Y, Vec3::Y * 0.5],
        rest_pose: vec![Vec3::ZERO, Vec3::X * 0.25],
    });
    let corners = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
    let faces = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    Character {
        body: TriMesh::new(corners, faces).unwrap(),
        skeleton: skeleton.unwrap(),
        weights: SkinningWeights::from_dense(&[1.0, 0.0, 0.5, 0.5, 0.25, 0.75, 0.0, 1.0], 4, 2).unwrap(),
    }
}

/// A square of two triangles with a seam in its texture.
pub(crate) fn small_garment() -> Garment {
    let corner = |x: f32, y: f32| Vec3::new(x, y, 1.0 / 3.0);
    Garment {
        rest: TriMesh {
            vertices: vec![
                corner(0.0, 0.1),
                corner(1.0, 1e-7),
                corner(1.0, 1.0),
                corner(0.0, 1.0),
            ],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            uvs: Some(Uvs {
                coordinates: [[0.0, 0.0], [1.0, 0.0], [0.1, 0.7], [0.3, 0.3]]
                    .map(Into::into)
                    .to_vec(),
                faces: vec![[0, 1, 2], [3, 2, 1]],
            }),
        },
        weights: SkinningWeights::from_dense(&[1.0, 0.0, 0.5, 0.5, 0.75, 0.25, 0.0, 1.0], 4, 2).unwrap(),
    }
}

/// A clip for [`small_character`].
pub(crate) fn small_clip(name: &str, frames: usize) -> Clip {
    let pose = |t: usize| {
        let t = t as f32;
        let turns = [Vec3::new(0.1 * t, 0.2, -0.3), Vec3::X * (0.5 - 0.05 * t)];
        Pose::from_axis_angles(Vec3::new(0.1 * t, 0.0, -0.2 * t), &turns)
    };
    Clip {
        name: name.into(),
        fps: 30.0,
        poses: (0..frames).map(pose).collect(),
        ground_height: -0.125,
    }
}

/// A frame of [`small_garment`].
pub(crate) fn small_frame(t: usize) -> Vec<Vec3> {
    let shift = Vec3::new(0.1, 0.2, 0.3) * t as f32;
    small_garment().rest.vertices.iter().map(|v| v + shift).collect()
}

/// Largest angle between two clips' local rotations (radians), and distance of their roots.
pub(crate) fn largest_differences(a: &Clip, b: &Clip) -> (f32, f32) {
    assert_eq!(a.len(), b.len());
    let (mut angle, mut distance) = (0.0_f32, 0.0_f32);
    for (p, q) in a.poses.iter().zip(&b.poses) {
        distance = distance.max(p.trans.distance(q.trans));
        for (x, y) in p.local.iter().zip(&q.local) {
            // Twice the sine of half the angle: exact where acos is not.
            let y = if x.dot(*y) < 0.0 { -*y } else { *y };
            angle = angle.max(2.0 * (*x - y).length());
        }
    }
    (angle, distance)
}
