//! Characters, garments and clips that several test files share.
#![allow(
    dead_code,
    reason = "every test file is a program of its own and uses a part of this"
)]

use glam::Vec3;
use std::path::{Path, PathBuf};
use unic_core::{
    Pose,
    character::{Character, Garment},
    clip::Clip,
    leg::Leg,
    mesh::{TriMesh, Uvs},
    motion_matching::{Database, DatabaseSettings, Feature, FeatureGroup, TagRange, TaggedClip},
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
};
use unic_io::{FootLock, GroundPlacement, LowPass, MotionOptions};

/// Path of a real input file beside the checkout; a missing one is reported as skipped.
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
        file_mesh: None,
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
        carriers: None,
        mask: Some(vec![1.0, 0.0, 0.25, 1.0]),
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
        wind: Vec::new(),
    }
}

/// A database of two clips of [`small_character`], mirrored, with ten tagged frames in each view.
pub(crate) fn small_database() -> Database {
    let clips = ["walk", "run"].map(|name| small_clip(name, 40));
    let tagged = |clip| TaggedClip {
        clip,
        tags: vec![TagRange {
            tag: "crouched".into(),
            frames: 35..40,
        }],
    };
    let leg = Leg {
        hip: 0,
        knee: 0,
        ankle: 1,
        toe: 1,
    };
    let group = |feature, weight| FeatureGroup { feature, weight };
    let settings = DatabaseSettings {
        groups: vec![
            group(Feature::JointVelocity(1), 1.5),
            group(Feature::TrajectoryPositions(vec![0.5, 1.0]), 1.0),
        ],
        legs: [leg; 2],
        toe_heights_m: [0.0; 2],
        mirror: Some(vec![0, 1]),
        end_margin_s: 0.2,
        contact_speed_m_s: 0.2,
        contact_height_m: 0.05,
    };
    Database::build(
        &small_character().skeleton,
        &[tagged(&clips[0]), tagged(&clips[1])],
        settings,
    )
    .unwrap()
}

/// A frame of [`small_garment`].
pub(crate) fn small_frame(t: usize) -> Vec<Vec3> {
    let shift = Vec3::new(0.1, 0.2, 0.3) * t as f32;
    small_garment().rest.vertices.iter().map(|v| v + shift).collect()
}

/// Returns the largest angle between the local rotations of two clips (radians), and the largest
/// distance of their roots (metres).
pub(crate) fn largest_differences(a: &Clip, b: &Clip) -> (f32, f32) {
    assert_eq!(a.len(), b.len());
    let (mut angle, mut distance) = (0.0_f32, 0.0_f32);
    for (p, q) in a.poses.iter().zip(&b.poses) {
        distance = distance.max(p.trans.distance(q.trans));
        for (x, y) in p.local.iter().zip(&q.local) {
            // Twice the chord approximates small angles exactly, where the arc cosine rounds.
            let y = if x.dot(*y) < 0.0 { -*y } else { *y };
            angle = angle.max(2.0 * (*x - y).length());
        }
    }
    (angle, distance)
}

/// A person of simple proportions in a T-pose with SMPL's 24 joints. The body is a triangle at the
/// pelvis and one under each foot.
pub(crate) fn humanoid() -> Character {
    let half = |joints: [[f32; 3]; 9]| joints.map(Vec3::from_array);
    let [hip, knee, ankle, foot, collar, shoulder, elbow, wrist, hand] = half([
        [0.09, 0.90, 0.0],
        [0.10, 0.49, 0.01],
        [0.10, 0.08, -0.02],
        [0.11, 0.02, 0.12],
        [0.05, 1.40, 0.0],
        [0.18, 1.42, -0.01],
        [0.45, 1.42, -0.02],
        [0.71, 1.42, 0.0],
        [0.80, 1.41, 0.0],
    ]);
    let right = |p: Vec3| Vec3::new(-p.x, p.y, p.z);
    let middle = |y: f32, z: f32| Vec3::new(0.0, y, z);
    let joints = vec![
        middle(0.97, 0.0),
        hip,
        right(hip),
        middle(1.08, -0.01),
        knee,
        right(knee),
        middle(1.20, -0.02),
        ankle,
        right(ankle),
        middle(1.28, -0.01),
        foot,
        right(foot),
        middle(1.48, -0.02),
        collar,
        right(collar),
        middle(1.57, 0.01),
        shoulder,
        right(shoulder),
        elbow,
        right(elbow),
        wrist,
        right(wrist),
        hand,
        right(hand),
    ];
    let parents = [
        -1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21,
    ];
    // A triangle under each foot and one through the pelvis, each rigid.
    let corners = [(10, 0.0), (11, 0.0), (0, 0.97)].map(|(joint, y)| {
        let at = |p: Vec3| Vec3::new(p.x, y, p.z);
        let centre = at(joints[joint]);
        (joint, [centre, centre + Vec3::Z * 0.05, centre + Vec3::X * 0.02])
    });
    let vertices: Vec<Vec3> = corners.iter().flat_map(|(_, c)| *c).collect();
    let mut weights = vec![0.0; vertices.len() * 24];
    for (vertex, (joint, _)) in corners.iter().flat_map(|c| [c, c, c]).enumerate() {
        weights[24 * vertex + joint] = 1.0;
    }
    let skeleton = SkeletonParts {
        parents: parents.to_vec(),
        joints,
        ..SkeletonParts::default()
    };
    Character {
        body: TriMesh::new(vertices, vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]]).unwrap(),
        skeleton: Skeleton::new(skeleton).unwrap(),
        weights: SkinningWeights::from_dense(&weights, 9, 24).unwrap(),
        file_mesh: None,
    }
}

/// Vertices of a body in a pose.
pub(crate) fn posed(character: &Character, pose: &Pose) -> Vec<Vec3> {
    let (mut joints, mut transforms, mut vertices) = (Vec::new(), Vec::new(), Vec::new());
    character.skeleton.forward_kinematics(pose, &mut joints);
    character.skeleton.world_from_rest(&joints, &mut transforms);
    (character.weights).skin(&character.body.vertices, &transforms, &mut vertices);
    vertices
}

/// Largest distance between vertices of equal index, metres.
pub(crate) fn largest_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// Options without any step after the transfer.
pub(crate) fn without_filters() -> MotionOptions {
    MotionOptions {
        ground: GroundPlacement::Keep,
        low_pass: LowPass::Off,
        feet: FootLock::Keep,
        ..MotionOptions::default()
    }
}

/// A slow motion of all limbs, trunk and root.
pub(crate) fn full_body_motion(frames: usize) -> Clip {
    let pose = |t: usize| {
        let s = t as f32 / 30.0;
        let swing = |j: usize| {
            let j = j as f32;
            Vec3::new(
                (s * 2.0 + j).sin(),
                (s * 1.3 + 2.0 * j).cos(),
                (s * 1.7 - j).sin(),
            ) * 0.25
        };
        let mut turns: Vec<Vec3> = (0..24).map(swing).collect();
        turns[0] = Vec3::Y * 0.6 * s;
        // Knees bend backwards.
        turns[4] = Vec3::X * (0.4 + 0.3 * (2.0 * s).sin());
        turns[5] = Vec3::X * (0.4 - 0.3 * (2.0 * s).sin());
        Pose::from_axis_angles(Vec3::new(0.4 * s, 0.02 * (3.0 * s).sin(), 0.7 * s), &turns)
    };
    Clip {
        name: "walk".into(),
        fps: 30.0,
        poses: (0..frames).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}
