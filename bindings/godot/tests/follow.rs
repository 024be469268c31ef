//! Contract: a garment is where the animator of `unic-core` puts it for the same motion, whatever the
//! axes of the bones, the names' namespace and the size of the character are. No engine is needed.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../examples/expected/walk.rs"]
mod walk;

use glam::{Quat, Vec3};
use godot_unic::{
    garment::{BodyContact, Garment, Picture, Surroundings},
    rig::{Bone, Rig, RigError},
};
use std::{f32::consts::FRAC_PI_2, sync::Arc};
use unic_core::{Animator, AnimatorState, Model, Pose, Start, transform::Rigid};
use walk::{input, pose_at};

const TSHIRT: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../apps/unic-cli/garments/tshirt.unic"
);

/// Distance from the animator of all but a hundredth of the vertices, metres.
const TOLERANCE_M: f32 = 1e-5;

/// Largest distance, metres. Intersection handling chooses between faces, so that rounding may move
/// single vertices.
const LARGEST_M: f32 = 1e-3;

fn model() -> Arc<Model> {
    Arc::new(Model::from_bytes(&std::fs::read(TSHIRT).unwrap()).unwrap())
}

/// A rig: the model's joints, each turned in its own space, in a skeleton of other axes and size.
struct Character {
    model: Arc<Model>,
    turn: Quat,
    skeleton_from_model: Quat,
    size: f32,
}

impl Character {
    fn plain(model: &Arc<Model>) -> Self {
        Self {
            model: Arc::clone(model),
            turn: Quat::IDENTITY,
            skeleton_from_model: Quat::IDENTITY,
            size: 1.0,
        }
    }

    /// Bones in the rest pose of the rig.
    fn bones(&self, namespace: &str) -> Vec<Bone> {
        let skeleton = &self.model.character().skeleton;
        let bind = self.global(&skeleton.bind_pose());
        let bone = |(name, bind): (&String, &Rigid)| Bone {
            name: format!("{namespace}{name}"),
            skeleton_from_bone: Rigid::new(
                self.skeleton_from_model * bind.rotation,
                self.skeleton_from_model * bind.translation,
            ),
        };
        skeleton.names().iter().zip(&bind).map(bone).collect()
    }

    /// Bones in the world, in a pose.
    fn global(&self, pose: &Pose) -> Vec<Rigid> {
        let mut joints = Vec::new();
        self.model
            .character()
            .skeleton
            .forward_kinematics(pose, &mut joints);
        let turned = |joint: &Rigid| Rigid::new(joint.rotation * self.turn, self.size * joint.translation);
        joints.iter().map(turned).collect()
    }

    fn garment(&self) -> Garment {
        let rig = Rig::new(&self.model.character().skeleton, &self.bones("")).unwrap();
        Garment::new(&self.model, rig)
    }
}

fn around(picture: Picture) -> Surroundings {
    Surroundings {
        picture,
        contact: BodyContact::OfModel,
        wind: Vec3::ZERO,
        ground_height: 0.0,
        teleport_m: 1.0,
    }
}

/// Positions in the world after a frame.
fn advance(garment: &mut Garment, bones: &[Rigid], frame_s: f32, picture: Picture) -> Vec<Vec3> {
    let frame = garment
        .advance(bones, frame_s.into(), &around(picture))
        .unwrap()
        .unwrap();
    frame.positions.iter().map(|p| *p * frame.size).collect()
}

#[track_caller]
fn assert_near(found: &[Vec3], expected: &[Vec3], what: &str) {
    assert_eq!(found.len(), expected.len());
    let mut far: Vec<f32> = found.iter().zip(expected).map(|(a, b)| a.distance(*b)).collect();
    far.sort_by(f32::total_cmp);
    let (most, largest) = (far[far.len() * 99 / 100], far[far.len() - 1]);
    assert!(
        most < TOLERANCE_M && largest < LARGEST_M,
        "{what}: most are within {most} m, the largest distance is {largest} m"
    );
}

#[test]
fn other_axes_and_another_size_make_no_difference() {
    let model = model();
    let plain = Character::plain(&model);
    let turned = Character {
        turn: Quat::from_euler(glam::EulerRot::XYZ, 0.7, -1.1, 2.0),
        skeleton_from_model: Quat::from_rotation_x(FRAC_PI_2),
        size: 1.5,
        ..Character::plain(&model)
    };
    for character in [plain, turned] {
        let mut garment = character.garment();
        let mut animator = Animator::new(Arc::clone(&model));
        for tick in 0..20 {
            let pose = pose_at(&model, tick as f32);
            match tick {
                0 => drop(animator.reset(&input(&pose), Start::MeanShape).unwrap()),
                _ => drop(animator.step(&input(&pose)).unwrap()),
            }
            let bones = character.global(&pose);
            let found = advance(&mut garment, &bones, 1.0 / model.config().fps, Picture::Tick);
            let expected = animator.garment().positions.iter();
            let expected: Vec<Vec3> = expected.map(|p| *p * character.size).collect();
            assert_near(
                &found,
                &expected,
                &format!("size {}, tick {tick}", character.size),
            );
        }
    }
}

#[test]
fn a_faster_display_shows_cloth_on_its_own_poses() {
    let model = model();
    let character = Character::plain(&model);
    let mut garment = character.garment();
    let mut before: Option<Vec<Vec3>> = None;
    for frame in 0..40 {
        let bones = character.global(&pose_at(&model, frame as f32 / 4.0));
        let frame_s = 0.25 / model.config().fps;
        let now = advance(&mut garment, &bones, frame_s, Picture::Interpolated);
        if let Some(before) = &before
            && frame > 8
        {
            let moved = now.iter().zip(before).map(|(a, b)| a.distance(*b));
            let moved = moved.fold(0.0, f32::max);
            // The walk is slower than 3 m/s at 120 frames a second.
            assert!(moved > 1e-5 && moved < 0.025, "frame {frame}: {moved} m");
        }
        before = Some(now);
    }
}

#[test]
fn a_teleport_keeps_the_shape_and_a_restart_does_not() {
    let model = model();
    let character = Character::plain(&model);
    let tick_s = 1.0 / model.config().fps;
    let mut pose = pose_at(&model, 0.0);
    let mut garment = character.garment();
    for tick in 0..10 {
        pose = pose_at(&model, tick as f32);
        advance(&mut garment, &character.global(&pose), tick_s, Picture::Tick);
    }
    let before = advance(&mut garment, &character.global(&pose), 0.0, Picture::Tick);
    let jump = Vec3::new(2.0, 0.0, 0.0);
    pose.trans += jump;
    let bones = character.global(&pose);
    let expected: Vec<Vec3> = before.iter().map(|p| *p + jump).collect();
    let found = advance(&mut garment, &bones, tick_s, Picture::Tick);
    assert_near(&found, &expected, "after a teleport");

    garment.restart();
    let mut fresh = Animator::new(Arc::clone(&model));
    fresh.reset(&input(&pose), Start::MeanShape).unwrap();
    let found = advance(&mut garment, &bones, tick_s, Picture::Tick);
    assert_near(&found, fresh.garment().positions, "after a restart");
}

#[test]
fn the_body_is_ignored_on_demand() {
    let model = model();
    let character = Character::plain(&model);
    let (mut garment, mut animator) = (character.garment(), Animator::new(Arc::clone(&model)));
    let ignoring = Surroundings {
        contact: BodyContact::Ignored,
        ..around(Picture::Tick)
    };
    animator.set_intersection(unic_core::IntersectionMode::Off);
    for tick in 0..5 {
        let pose = pose_at(&model, tick as f32);
        match tick {
            0 => drop(animator.reset(&input(&pose), Start::MeanShape).unwrap()),
            _ => drop(animator.step(&input(&pose)).unwrap()),
        }
        let bones = character.global(&pose);
        let frame = garment.advance(&bones, 1.0 / f64::from(model.config().fps), &ignoring);
        let found = frame.unwrap().unwrap().positions.to_vec();
        assert_near(&found, animator.garment().positions, &format!("tick {tick}"));
    }
    // The model itself corrects vertices.
    let bones = character.global(&pose_at(&model, 4.0));
    garment.restart();
    let corrected = advance(&mut garment, &bones, 0.0, Picture::Tick);
    garment.restart();
    let ignored = garment.advance(&bones, 0.0, &ignoring).unwrap().unwrap();
    assert_ne!(ignored.positions, corrected);
}

#[test]
fn a_restored_state_continues_at_another_place_of_the_rig() {
    let model = model();
    let character = Character::plain(&model);
    let tick_s = 1.0 / model.config().fps;
    let mut garment = character.garment();
    assert!(garment.state().is_none(), "no frame has been shown");
    let mut bones = Vec::new();
    for tick in 0..6 {
        bones = character.global(&pose_at(&model, tick as f32));
        advance(&mut garment, &bones, tick_s, Picture::Tick);
        if tick == 4 {
            let mut saved = Vec::new();
            garment.state().unwrap().save(7, &mut saved).unwrap();
            assert!(
                AnimatorState::from_saved(&saved, 8).is_err(),
                "a state of another model"
            );
        }
    }
    let state = garment.state().unwrap().clone();
    let mut expected = character.garment();
    expected.restore(state.clone()).unwrap();
    let expected = advance(&mut expected, &bones, tick_s, Picture::Tick);
    // The other garment has been five metres away.
    let mut other = character.garment();
    let mut far = pose_at(&model, 0.0);
    far.trans.x += 5.0;
    advance(&mut other, &character.global(&far), tick_s, Picture::Tick);
    other.restore(state).unwrap();
    assert_eq!(advance(&mut other, &bones, tick_s, Picture::Tick), expected);
}

#[test]
fn names_have_a_namespace_or_not() {
    let model = model();
    let character = Character::plain(&model);
    let skeleton = &model.character().skeleton;
    for namespace in ["", "rig:", "rig_", "Mixamo_Rig_"] {
        let mut bones = character.bones(namespace);
        for bone in &mut bones {
            bone.name = bone.name.to_uppercase();
        }
        // A prop whose name ends as that of the root does.
        let mut prop = bones[skeleton.root()].clone();
        prop.name = format!("prop_{}", skeleton.names()[skeleton.root()]);
        bones.push(prop);
        let rig = Rig::new(skeleton, &bones).unwrap();
        let expected = (0..skeleton.len()).map(Some);
        assert!(rig.bones().eq(expected), "namespace {namespace}");
    }
}

#[test]
fn rigs_that_do_not_fit_are_refused() {
    let model = model();
    let character = Character::plain(&model);
    let skeleton = &model.character().skeleton;
    let elbow = skeleton.joint("L_elbow").unwrap();
    let mut bones = character.bones("");
    bones[elbow].name = "lower arm".to_owned();
    let error = Rig::new(skeleton, &bones).unwrap_err();
    assert_eq!(error, RigError::Joints(vec!["L_elbow".to_owned()]));

    let mut bones = character.bones("");
    bones[elbow].skeleton_from_bone.translation.y += 0.1;
    let error = Rig::new(skeleton, &bones).unwrap_err();
    assert!(
        matches!(&error, RigError::RestPose { joint, .. } if joint == "L_elbow"),
        "{error}"
    );
}
