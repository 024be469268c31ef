//! A walking figure with a closed form, and the built-in character with its clips.

use glam::{Quat, Vec3};
use std::sync::{Arc, LazyLock};
use unic_core::{
    Pose,
    clip::Clip,
    leg::Leg,
    motion_matching::{Database, DatabaseSettings, TaggedClip, standard_groups},
    skeleton::{Skeleton, SkeletonParts},
};

pub(crate) const FPS: f32 = 30.0;
/// Speed of the gliding figure, m/s.
pub(crate) const SPEED: f32 = 1.2;

/// Legs in SMPL's order.
pub(crate) const SMPL_LEGS: [Leg; 2] = [
    Leg {
        hip: 1,
        knee: 4,
        ankle: 7,
        toe: 10,
    },
    Leg {
        hip: 2,
        knee: 5,
        ankle: 8,
        toe: 11,
    },
];

/// Joint with left and right exchanged, in SMPL's order.
pub(crate) const SMPL_MIRROR: [usize; 24] = [
    0, 2, 1, 3, 5, 4, 6, 8, 7, 9, 11, 10, 12, 14, 13, 15, 17, 16, 19, 18, 21, 20, 23, 22,
];

/// Figure of two legs: hips, knees, ankles and toes beside each other.
pub(crate) fn figure() -> Skeleton {
    let names = [
        "pelvis", "L_hip", "R_hip", "L_knee", "R_knee", "L_ankle", "R_ankle", "L_foot", "R_foot",
    ];
    let side = |x: f32, y: f32, z: f32| [Vec3::new(x, y, z), Vec3::new(-x, y, z)];
    let joints = [Vec3::new(0.0, 1.0, 0.0)].into_iter().chain(
        [
            side(0.1, 0.9, 0.0),
            side(0.1, 0.5, 0.02),
            side(0.1, 0.1, 0.0),
            side(0.1, 0.03, 0.15),
        ]
        .concat(),
    );
    Skeleton::new(SkeletonParts {
        names: names.map(String::from).to_vec(),
        parents: vec![-1, 0, 0, 1, 2, 3, 4, 5, 6],
        joints: joints.collect(),
        rest_pose: vec![],
    })
    .unwrap()
}

pub(crate) const FIGURE_LEGS: [Leg; 2] = [
    Leg {
        hip: 1,
        knee: 3,
        ankle: 5,
        toe: 7,
    },
    Leg {
        hip: 2,
        knee: 4,
        ankle: 6,
        toe: 8,
    },
];

pub(crate) const FIGURE_MIRROR: [usize; 9] = [0, 2, 1, 4, 3, 6, 5, 8, 7];

pub(crate) fn figure_settings() -> DatabaseSettings {
    DatabaseSettings {
        groups: standard_groups(&FIGURE_LEGS, 0),
        legs: FIGURE_LEGS,
        toe_heights_m: [0.03; 2],
        mirror: None,
        end_margin_s: 0.1,
        contact_speed_m_s: 0.25,
        contact_height_m: 0.05,
    }
}

/// The figure gliding along `yaw` with stiff legs.
pub(crate) fn gliding(frames: usize, yaw: f32) -> Clip {
    let turn = Quat::from_rotation_y(yaw);
    let pose = |t: usize| Pose {
        trans: turn * Vec3::Z * SPEED * t as f32 / FPS,
        local: std::iter::once(turn).chain([Quat::IDENTITY; 8]).collect(),
    };
    clip("gliding", (0..frames).map(pose).collect())
}

/// The figure on a winding path, with swinging legs; another one for each seed.
pub(crate) fn winding(frames: usize, seed: f32) -> Clip {
    let pose = |t: usize| {
        let s = t as f32 / FPS;
        let swing = |phase: f32| Quat::from_rotation_x(0.6 * (5.0 * s + phase + seed).sin());
        let mut local = vec![Quat::IDENTITY; 9];
        local[0] = Quat::from_rotation_y((1.3 * s + seed).sin() * 1.5)
            * Quat::from_rotation_z(0.1 * (3.0 * s).sin());
        (local[1], local[2]) = (swing(0.0), swing(2.9));
        (local[3], local[4]) = (swing(0.7), swing(3.5));
        Pose {
            trans: Vec3::new(
                (0.7 * s + seed).sin(),
                0.05 * (9.0 * s).sin(),
                s + 0.3 * (1.1 * s * seed).cos(),
            ),
            local,
        }
    };
    clip("winding", (0..frames).map(pose).collect())
}

fn clip(name: &str, poses: Vec<Pose>) -> Clip {
    Clip {
        name: name.into(),
        fps: FPS,
        poses,
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

pub(crate) fn build(skeleton: &Skeleton, clips: &[Clip], settings: DatabaseSettings) -> Database {
    let tagged: Vec<TaggedClip> = clips.iter().map(TaggedClip::untagged).collect();
    Database::build(skeleton, &tagged, settings).unwrap()
}

/// Database of the built-in human, mirrored.
pub(crate) fn human_database() -> Arc<Database> {
    static DATABASE: LazyLock<Arc<Database>> = LazyLock::new(|| {
        let character = unic_builtin::human::human(&Default::default()).unwrap();
        let clips = unic_builtin::motion::control_set(&character, 0, FPS).unwrap();
        let settings = DatabaseSettings {
            mirror: Some(SMPL_MIRROR.to_vec()),
            ..DatabaseSettings::standard(&character, SMPL_LEGS)
        };
        Arc::new(build(&character.skeleton, &clips, settings))
    });
    Arc::clone(&DATABASE)
}
