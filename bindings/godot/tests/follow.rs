//! Contract: a garment is where the animator of `unic-core` puts it for the same motion, whatever the
//! axes of the bones, the names' namespace and the size of the character are. No engine is needed.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

#[path = "../examples/expected/walk.rs"]
mod walk;

use glam::{Affine3A, Quat, Vec3};
use godot_unic::garment::{BodyContact, FrameChoice, FrameError, Garment};
use std::{f32::consts::FRAC_PI_2, sync::Arc};
use unic_core::{
    Animator, AnimatorState, Model, Pose, Start,
    animator::Display,
    rig::{RigError, RigFit, RigJoint},
    transform::Rigid,
};
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

    /// Bones in the world, in a pose.
    fn global(&self, pose: &Pose) -> Vec<Affine3A> {
        let scale = Affine3A::from_scale(Vec3::splat(self.size));
        let bones = self.bones(pose).into_iter();
        bones.map(|bone| scale * bone).collect()
    }

    /// Bones in a pose, in the size of the model.
    fn bones(&self, pose: &Pose) -> Vec<Affine3A> {
        let mut joints = Vec::new();
        let skeleton = &self.model.character().skeleton;
        skeleton.forward_kinematics(pose, &mut joints);
        let turned = |joint: &Rigid| {
            Affine3A::from_rotation_translation(joint.rotation * self.turn, joint.translation)
        };
        joints.iter().map(turned).collect()
    }

    fn garment(&self) -> Garment {
        let skeleton = &self.model.character().skeleton;
        let to_skeleton = Affine3A::from_quat(self.skeleton_from_model);
        let rest = self.bones(&skeleton.bind_pose());
        let rig: Vec<RigJoint<'_>> = (skeleton.names().iter().zip(&rest))
            .map(|(name, bone)| RigJoint {
                name,
                mesh_from_joint: to_skeleton * *bone,
            })
            .collect();
        Garment::new(&self.model, RigFit::new(skeleton, &rig).unwrap())
    }
}

fn choice(display: Display) -> FrameChoice {
    FrameChoice {
        display,
        ..FrameChoice::default()
    }
}

/// Positions in the world after a frame.
fn advance(garment: &mut Garment, bones: &[Affine3A], frame_s: f32, display: Display) -> Vec<Vec3> {
    let frame = garment
        .advance(bones, frame_s.into(), &choice(display))
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
            let found = advance(&mut garment, &bones, 1.0 / model.config().fps, Display::Ticks);
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
        let now = advance(&mut garment, &bones, frame_s, Display::Interpolated);
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
        advance(&mut garment, &character.global(&pose), tick_s, Display::Ticks);
    }
    let before = advance(&mut garment, &character.global(&pose), 0.0, Display::Ticks);
    let jump = Vec3::new(2.0, 0.0, 0.0);
    pose.trans += jump;
    let bones = character.global(&pose);
    let expected: Vec<Vec3> = before.iter().map(|p| *p + jump).collect();
    let found = advance(&mut garment, &bones, tick_s, Display::Ticks);
    assert_near(&found, &expected, "after a teleport");

    garment.restart();
    let mut fresh = Animator::new(Arc::clone(&model));
    fresh.reset(&input(&pose), Start::MeanShape).unwrap();
    let found = advance(&mut garment, &bones, tick_s, Display::Ticks);
    assert_near(&found, fresh.garment().positions, "after a restart");
}

#[test]
fn the_body_is_ignored_on_demand() {
    let model = model();
    let character = Character::plain(&model);
    let (mut garment, mut animator) = (character.garment(), Animator::new(Arc::clone(&model)));
    let ignoring = FrameChoice {
        contact: BodyContact::Ignored,
        ..choice(Display::Ticks)
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
    let corrected = advance(&mut garment, &bones, 0.0, Display::Ticks);
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
        advance(&mut garment, &bones, tick_s, Display::Ticks);
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
    let expected = advance(&mut expected, &bones, tick_s, Display::Ticks);
    // The other garment has been five metres away.
    let mut other = character.garment();
    let mut far = pose_at(&model, 0.0);
    far.trans.x += 5.0;
    advance(&mut other, &character.global(&far), tick_s, Display::Ticks);
    other.restore(state).unwrap();
    assert_eq!(advance(&mut other, &bones, tick_s, Display::Ticks), expected);
}

#[test]
fn a_rig_in_centimetres_is_dressed_in_its_size() {
    let model = model();
    let character = Character {
        size: 0.01,
        ..Character::plain(&model)
    };
    let (mut garment, mut animator) = (character.garment(), Animator::new(Arc::clone(&model)));
    for tick in 0..5 {
        let pose = pose_at(&model, tick as f32);
        match tick {
            0 => drop(animator.reset(&input(&pose), Start::MeanShape).unwrap()),
            _ => drop(animator.step(&input(&pose)).unwrap()),
        }
        let bones = character.global(&pose);
        let frame = garment.advance(
            &bones,
            1.0 / f64::from(model.config().fps),
            &choice(Display::Ticks),
        );
        let frame = frame.unwrap().unwrap();
        assert!((frame.size / character.size - 1.0).abs() < 1e-5, "{}", frame.size);
        assert_near(
            frame.positions,
            animator.garment().positions,
            &format!("tick {tick}"),
        );
    }
}

#[test]
fn scales_that_the_model_does_not_dress_are_refused_and_the_garment_begins_anew() {
    let model = model();
    let character = Character::plain(&model);
    let pose = pose_at(&model, 3.0);
    let bones = character.global(&pose);
    let mut fresh = Animator::new(Arc::clone(&model));
    fresh.reset(&input(&pose), Start::MeanShape).unwrap();
    let mut garment = character.garment();
    advance(
        &mut garment,
        &character.global(&pose_at(&model, 0.0)),
        0.0,
        Display::Ticks,
    );
    for scale in [Vec3::ZERO, Vec3::new(-1.0, 1.0, 1.0), Vec3::new(1.0, 1.0, 0.5)] {
        let world = Affine3A::from_scale(scale);
        let scaled: Vec<Affine3A> = bones.iter().map(|bone| world * *bone).collect();
        let found = garment
            .advance(&scaled, 0.03, &choice(Display::Ticks))
            .map(|_| ());
        assert!(
            matches!(found, Err(FrameError::Rig(RigError::Scale { .. }))),
            "{scale}: {found:?}"
        );
        let found = advance(&mut garment, &bones, 0.03, Display::Ticks);
        assert_near(
            &found,
            fresh.garment().positions,
            &format!("after the scale {scale}"),
        );
    }
}
