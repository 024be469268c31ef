//! Test bodies, and measurements of their motion.

use crate::human::{HumanParameters, human};
use crate::motion::{Action, Performance, Performer, Timeline};
use glam::Vec3;
use std::path::Path;
use unic_core::{
    Pose,
    character::Character,
    mesh::TriMesh,
    skeleton::{SMPL_PARENTS, Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    transform::Rigid,
};

/// Joints of the figure's left half with their positions, metres; the right half mirrors them.
const LEFT: [(usize, [f32; 3]); 9] = [
    (1, [0.09, 0.90, 0.0]),
    (4, [0.09, 0.50, 0.01]),
    (7, [0.09, 0.08, 0.0]),
    (10, [0.10, 0.025, 0.13]),
    (13, [0.05, 1.40, 0.0]),
    (16, [0.18, 1.40, 0.0]),
    (18, [0.45, 1.40, -0.01]),
    (20, [0.70, 1.40, 0.0]),
    (22, [0.79, 1.40, 0.0]),
];

/// Joints on the figure's midplane with their positions, metres.
const MIDDLE: [(usize, [f32; 3]); 6] = [
    (0, [0.0, 0.96, 0.0]),
    (3, [0.0, 1.08, -0.01]),
    (6, [0.0, 1.21, -0.01]),
    (9, [0.0, 1.27, 0.0]),
    (12, [0.0, 1.47, 0.0]),
    (15, [0.0, 1.57, 0.02]),
];

/// T-posed skeleton of 1.7 m whose only vertices are heel, ball and toe of each foot, and the
/// crown.
pub(super) fn figure() -> Character {
    let mirrored = |p: [f32; 3]| Vec3::new(-p[0], p[1], p[2]);
    let mut joints = vec![Vec3::ZERO; 24];
    MIDDLE.iter().for_each(|&(j, p)| joints[j] = p.into());
    for (j, p) in LEFT {
        (joints[j], joints[j + 1]) = (p.into(), mirrored(p));
    }
    let left = [
        (7, [0.09, 0.0, -0.05]),
        (7, [0.10, 0.0, 0.10]),
        (10, [0.10, 0.0, 0.20]),
    ];
    let feet = left
        .into_iter()
        .flat_map(|(j, p)| [(j, Vec3::from(p)), (j + 1, mirrored(p))]);
    let rows: Vec<(usize, Vec3)> = feet.chain([(15, Vec3::new(0.0, 1.7, 0.0))]).collect();
    let dense: Vec<f32> = (rows.iter())
        .flat_map(|&(joint, _)| (0..24).map(move |j| f32::from(u8::from(j == joint))))
        .collect();
    Character {
        body: TriMesh::new(rows.iter().map(|r| r.1).collect(), vec![[0, 2, 4], [1, 3, 5]]).unwrap(),
        skeleton: Skeleton::new(SkeletonParts {
            parents: SMPL_PARENTS.to_vec(),
            joints,
            ..SkeletonParts::default()
        })
        .unwrap(),
        weights: SkinningWeights::from_dense(&dense, rows.len(), 24).unwrap(),
        file_mesh: None,
    }
}

/// The figure, the built-in human, and the real body if its file exists.
pub(super) fn bodies() -> Vec<Character> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/body/character.npz");
    let mut bodies = vec![figure(), human(&HumanParameters::default()).unwrap()];
    match unic_io::read_character(&path) {
        Ok(body) => bodies.push(body),
        Err(_) => eprintln!("skipped: the real body, {} is not there", path.display()),
    }
    bodies
}

pub(super) fn perform(character: &Character, actions: impl IntoIterator<Item = Action>) -> Performance {
    let performer = Performer::new(character).unwrap();
    Timeline::new(5).then_all(actions).perform(&performer)
}

pub(super) fn travel(speed: f32, turn_rate: f32, seconds: f32) -> Action {
    Action::Travel {
        speed,
        turn_rate,
        seconds,
    }
}

pub(super) fn joints(character: &Character, pose: &Pose) -> Vec<Rigid> {
    let mut world = Vec::new();
    character.skeleton.forward_kinematics(pose, &mut world);
    world
}

/// Height of the lowest vertex.
pub(super) fn lowest(character: &Character, pose: &Pose) -> f32 {
    let (world, mut transforms, mut skinned) = (joints(character, pose), Vec::new(), Vec::new());
    character.skeleton.world_from_rest(&world, &mut transforms);
    character
        .weights
        .skin(&character.body.vertices, &transforms, &mut skinned);
    skinned.iter().map(|v| v.y).fold(f32::INFINITY, f32::min)
}

/// Actions of every kind.
pub(super) fn every_kind() -> Vec<Action> {
    let mut actions = vec![Action::Idle { seconds: 5.0 }];
    actions.extend([0.8, 1.3, 1.8].map(|v| travel(v, 0.0, 4.0)));
    actions.extend([
        travel(1.2, 0.6, 4.0),
        travel(3.0, -0.4, 4.0),
        travel(5.0, 0.0, 5.0),
    ]);
    actions.extend([
        Action::Stop { seconds: 1.5 },
        Action::TurnOnSpot { angle: -2.0 },
        Action::Squat { depth: 0.5 },
        Action::Jump { height: 0.3 },
        Action::Twist { angle: 0.8 },
        Action::Dance {
            seconds: 14.0,
            beats_per_minute: 110.0,
        },
        Action::Wander { seconds: 20.0 },
    ]);
    actions
}
