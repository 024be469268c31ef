//! Contract of cloth on a character: it settles the same way whatever was before, follows the body,
//! does not creep, and ends up outside the body.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

use glam::{Quat, Vec3};
use std::{f32::consts::TAU, path::PathBuf, sync::Arc};
use unic_core::{
    Pose,
    character::Character,
    folds::Folds,
    mesh::TriMesh,
    skeleton::{Skeleton, SkeletonParts},
    skinning::SkinningWeights,
    surface::Surface,
};
use unic_io::Capture;
use unic_sim::{
    Attachment, Cloth, ClothSpec, Material, Simulation, SimulationError, SimulationSettings,
    quality::CreepReference,
};

/// A tube around the vertical axis that faces outwards, from the height `top` down, in metres.
fn tube(around: u32, along: u32, radius: f32, top: f32, length: f32) -> TriMesh {
    let place = |i: u32| {
        let angle = TAU * (i % around) as f32 / around as f32;
        let height = top - length * (i / around) as f32 / (along - 1) as f32;
        Vec3::new(radius * angle.sin(), height, radius * angle.cos())
    };
    let at = |x: u32, y: u32| y * around + x % around;
    let squares = (0..along - 1).flat_map(|y| (0..around).map(move |x| (x, y)));
    let faces = squares.flat_map(|(x, y)| {
        let [a, b, c, d] = [at(x, y), at(x, y + 1), at(x + 1, y + 1), at(x + 1, y)];
        [[a, b, c], [a, c, d]]
    });
    TriMesh::new((0..around * along).map(place).collect(), faces.collect()).unwrap()
}

/// A character with a tube for a body and one joint at a height of 1 m.
fn pillar() -> Arc<Character> {
    let body = tube(32, 40, 0.1, 1.2, 1.2);
    let count = body.vertices.len();
    let parts = SkeletonParts {
        parents: vec![-1],
        joints: vec![Vec3::Y],
        ..Default::default()
    };
    Arc::new(Character {
        skeleton: Skeleton::new(parts).unwrap(),
        weights: SkinningWeights::from_dense(&vec![1.0; count], count, 1).unwrap(),
        body,
        file_mesh: None,
    })
}

/// The pose of the pillar at a place, turned about the vertical by `turn` radians.
fn standing(at: Vec3, turn: f32) -> Pose {
    Pose {
        trans: at,
        local: vec![Quat::from_rotation_y(turn)],
    }
}

#[test]
fn attached_vertices_follow_the_body() {
    let character = pillar();
    let skirt = tube(40, 20, 0.12, 1.0, 0.4);
    let surface = Surface::build(&character.body);
    let attach = |vertex: u32| {
        let place = skirt.vertices[vertex as usize];
        Attachment::to_nearest(vertex, place, &character.body, &surface).unwrap()
    };
    let spec = ClothSpec {
        attachments: (0..40).map(attach).collect(),
        ..ClothSpec::new(skirt.clone(), Material::COTTON)
    };
    let cloth = Arc::new(Cloth::new(&spec).unwrap());
    let mut simulation =
        Simulation::on_character(cloth, Arc::clone(&character), SimulationSettings::default()).unwrap();
    let (at, turn) = (Vec3::new(3.0, 0.1, -2.0), 2.5);
    simulation
        .settle(&standing(at, turn), &standing(at, turn))
        .unwrap();
    let mut worst = 0.0f32;
    for frame in 0..=30 {
        let (at, turn) = (at + Vec3::X * 0.04 * frame as f32, turn + 0.05 * frame as f32);
        let garment = simulation.step_frame(&standing(at, turn), Vec3::ZERO).unwrap();
        for (moved, rest) in garment.iter().zip(&skirt.vertices).take(40) {
            let expected = Quat::from_rotation_y(turn) * (rest - Vec3::Y) + Vec3::Y + at;
            worst = worst.max(moved.distance(expected));
        }
        assert!(
            garment.iter().all(|v| v.y > 0.5),
            "frame {frame}: the skirt has slid"
        );
    }
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn settling_does_not_depend_on_the_earlier_state() {
    let cloth = Arc::new(Cloth::new(&ClothSpec::new(tube(30, 12, 0.11, 1.0, 0.2), Material::SILK)).unwrap());
    let mut one = Simulation::on_character(cloth, pillar(), SimulationSettings::default()).unwrap();
    let poses = [0.0, 0.1].map(|x| standing(Vec3::X * x, 0.3));
    let first = one.settle(&poses[0], &poses[1]).unwrap().to_vec();
    one.step_frame(&standing(Vec3::Z * 0.1, 1.0), Vec3::Z).unwrap();
    assert_eq!(one.settle(&poses[0], &poses[1]).unwrap(), first);
}

#[test]
fn creep_is_the_height_that_remains_when_the_character_stands_again() {
    let character = pillar();
    let skirt = tube(30, 12, 0.11, 1.0, 0.3);
    let surface = Surface::build(&character.body);
    let attach = |v: u32| Attachment::to_nearest(v, skirt.vertices[v as usize], &character.body, &surface);
    let spec = ClothSpec {
        attachments: (0..30).filter_map(attach).collect(),
        ..ClothSpec::new(skirt.clone(), Material::COTTON)
    };
    let cloth = Arc::new(Cloth::new(&spec).unwrap());
    let settings = SimulationSettings::default();
    let before = CreepReference::new(&cloth, &character, &settings, || true)
        .unwrap()
        .unwrap();
    let mut simulation = Simulation::on_character(cloth, Arc::clone(&character), settings).unwrap();
    let poses: Vec<Pose> = (0..=20)
        .map(|t| standing(Vec3::new(0.05 * t as f32, 0.02 * t as f32, 0.0), 0.1 * t as f32))
        .collect();
    simulation.settle(&poses[0], &poses[1]).unwrap();
    for pose in &poses[1..] {
        simulation.step_frame(pose, Vec3::ZERO).unwrap();
    }
    let last = &poses[20];
    for pose in CreepReference::poses_to_standing(&character.skeleton, last, 30.0) {
        simulation.step_frame(&pose, Vec3::ZERO).unwrap();
    }
    let creep = |simulation: &Simulation| before.creep_mm(simulation, &character.skeleton, last);
    assert!(creep(&simulation).abs() < 2.0, "{} mm", creep(&simulation));
    simulation.place(|rest| rest + last.trans);
    let low = creep(&simulation);
    simulation.place(|rest| rest + last.trans + Vec3::Y * 0.03);
    let raised = creep(&simulation) - low;
    assert!((raised - 30.0).abs() < 0.01, "{raised} mm");
}

#[test]
fn the_creep_reference_stops_when_keep_going_returns_false() {
    let cloth = Arc::new(Cloth::new(&ClothSpec::new(tube(8, 3, 0.2, 1.0, 0.1), Material::SILK)).unwrap());
    let settings = SimulationSettings::default();
    let frames = CreepReference::frame_count(&settings);
    let mut left = frames;
    let mut keep_going = || {
        left -= 1;
        left > frames / 2
    };
    assert!(
        CreepReference::new(&cloth, &pillar(), &settings, &mut keep_going)
            .unwrap()
            .is_none()
    );
    assert_eq!(left, frames / 2);
}

#[test]
fn poses_that_do_not_fit_the_character_are_errors() {
    let cloth = Arc::new(Cloth::new(&ClothSpec::new(tube(8, 3, 0.2, 1.0, 0.1), Material::SILK)).unwrap());
    let mut alone = Simulation::new(Arc::clone(&cloth), SimulationSettings::default()).unwrap();
    let pose = standing(Vec3::ZERO, 0.0);
    let refused = alone.settle(&pose, &pose).map(|_| ());
    assert!(matches!(refused, Err(SimulationError::NoCharacter { .. })));
    let mut worn = Simulation::on_character(cloth, pillar(), SimulationSettings::default()).unwrap();
    for bad in [
        Pose {
            trans: Vec3::NAN,
            ..pose.clone()
        },
        Pose {
            local: vec![],
            ..pose
        },
    ] {
        let refused = worn.step_frame(&bad, Vec3::ZERO).map(|_| ());
        assert!(matches!(refused, Err(SimulationError::Pose { expected: 1, .. })));
    }
}

#[test]
fn a_shirt_whose_rest_shape_intersects_the_body_ends_up_outside() {
    let folder =
        PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/captures/tshirt_blender");
    if !folder.exists() {
        eprintln!("skipped: {} is not there", folder.display());
        return;
    }
    let capture = Capture::open(&folder).unwrap();
    let clip = capture.load_clip("run_02_03").unwrap().clip;
    let cloth = Cloth::new(&ClothSpec::new(capture.garment.rest.clone(), Material::COTTON)).unwrap();
    let character = Arc::new(capture.character.clone());
    let mut simulation =
        Simulation::on_character(Arc::new(cloth), character, SimulationSettings::default()).unwrap();
    simulation.settle(&clip.poses[0], &clip.poses[1]).unwrap();
    let (mut deep, mut counted) = (0, 0);
    let mut surface = Surface::build(&capture.character.body);
    for pose in &clip.poses[1..30] {
        simulation.step_frame(pose, Vec3::ZERO).unwrap();
        surface.refit(simulation.body().unwrap());
        let mut folds = Folds::default();
        folds.find(&surface);
        let hits = simulation.vertices().iter().filter_map(|&v| surface.closest(v));
        for hit in hits.filter(|hit| !folds.is_face_folded(hit.face)) {
            counted += 1;
            deep += u32::from(hit.signed_distance < -1e-3);
        }
    }
    let share = f64::from(deep) / f64::from(counted);
    assert!(share < 5e-3, "{share}");
}
