use super::*;
use crate::bvh::{Bvh, RestJoint};
use glam::Quat;
use unic_core::{Pose, clip::Clip};
use unic_testdata::{Figure, mixamo_clip};

const FPS: f64 = 30.0;

/// Frames of a figure's body in a motion.
fn frames(figure: &Figure, clip: &Clip) -> Vec<BodyFrame> {
    let Character {
        body,
        skeleton,
        weights,
        ..
    } = &figure.character;
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    let frame = |(t, pose): (usize, &Pose)| {
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut transforms);
        let mut vertices = Vec::new();
        weights.skin(&body.vertices, &transforms, &mut vertices);
        BodyFrame {
            seconds: t as f64 / FPS,
            vertices,
        }
    };
    clip.poses.iter().enumerate().map(frame).collect()
}

/// The joints of a figure in a motion, in units of `unit` metres, displaced in their rest pose.
fn motion(skeleton: &Skeleton, clip: &Clip, unknown: Unknown, unit: f32) -> MotionSkeleton {
    let joint = |joint: usize| RestJoint {
        name: skeleton.names()[joint].clone(),
        parent: skeleton.parents()[joint],
        position: skeleton.joints()[joint] / unit,
    };
    let joints: Vec<RestJoint> = (0..skeleton.len()).map(joint).collect();
    let (mut world, mut frames) = (Vec::new(), Vec::new());
    for pose in &clip.poses {
        skeleton.forward_kinematics(pose, &mut world);
        world.iter_mut().for_each(|joint| joint.translation /= unit);
        Bvh::push_frame(&joints, &world, &mut frames);
    }
    let bvh = Bvh::from_rest(joints, FPS as f32, frames);
    MotionSkeleton::new("walk.bvh".as_ref(), bvh, unknown, Quat::IDENTITY).unwrap()
}

fn fitted(figure: &Figure, clip: &Clip, motion: &MotionSkeleton) -> Result<FittedRig> {
    let faces = &figure.character.body.faces;
    fit_rig("body.abc".as_ref(), faces, &frames(figure, clip), motion, |_| {
        Ok(())
    })
}

#[test]
fn a_skinned_body_gets_its_rig_back() {
    let (figure, clip) = (Figure::mixamo(), mixamo_clip("walk", 0, 30));
    let skeleton = &figure.character.skeleton;
    let rig = fitted(&figure, &clip, &motion(skeleton, &clip, Unknown::Nothing, 1.0)).unwrap();
    assert!(
        rig.rms_m < 5e-4 && rig.largest_m < 1e-2,
        "{} {}",
        rig.rms_m,
        rig.largest_m
    );
    let joints = rig.character.skeleton.joints().iter().zip(skeleton.joints());
    assert!(
        joints
            .into_iter()
            .all(|(found, expected)| found.distance(*expected) < 1e-4)
    );
    // Frames that it has not been fitted to.
    let other = mixamo_clip("other", 7, 20);
    let refitted = Figure {
        character: rig.character,
        ..figure.clone()
    };
    let pairs = frames(&figure, &other).into_iter().zip(frames(&refitted, &other));
    let (mut sum, mut count) = (0.0, 0);
    for (a, b) in pairs {
        let pairs = a.vertices.iter().zip(&b.vertices);
        sum += pairs.map(|(a, b)| a.distance_squared(*b)).sum::<f32>();
        count += a.vertices.len();
    }
    let rms = (sum / count as f32).sqrt();
    assert!(rms < 8e-3, "{rms} m");
}

#[test]
fn the_unit_of_a_motion_is_found() {
    let (figure, clip) = (Figure::mixamo(), mixamo_clip("walk", 0, 20));
    let skeleton = &figure.character.skeleton;
    let rig = fitted(&figure, &clip, &motion(skeleton, &clip, Unknown::Unit, 0.0254)).unwrap();
    assert!(rig.rms_m < 3e-3, "{}", rig.rms_m);
    for (found, expected) in rig.character.skeleton.joints().iter().zip(skeleton.joints()) {
        assert!(found.distance(*expected) < 0.02, "{found} {expected}");
    }
}

/// Translations of SMPL's files are relative to a place of the root that is not in the file.
#[test]
fn joints_are_found_wherever_the_root_of_the_file_is() {
    let (figure, clip) = (Figure::tube(), unic_testdata::clip("walk", 0, 60));
    let skeleton = &figure.character.skeleton;
    let mut other = clip.clone();
    other.poses.iter_mut().for_each(|pose| pose.trans.y += 1.0);
    let rig = fitted(&figure, &clip, &motion(skeleton, &other, Unknown::Joints, 1.0)).unwrap();
    assert!(rig.rms_m < 5e-3, "{}", rig.rms_m);
    let expected = skeleton.joints()[0] - Vec3::Y;
    let off = rig.character.skeleton.joints()[0].distance(expected);
    assert!(off < 0.1, "{off} m");
}

#[test]
fn a_body_in_another_motion_is_refused() {
    let (figure, clip) = (Figure::mixamo(), mixamo_clip("walk", 0, 20));
    let mut turned = clip.clone();
    let root = figure.character.skeleton.root();
    for (t, pose) in turned.poses.iter_mut().enumerate() {
        pose.trans.x += 0.05 * t as f32;
        pose.local[root] = Quat::from_rotation_y(1.5) * pose.local[root];
    }
    let motion = motion(&figure.character.skeleton, &turned, Unknown::Nothing, 1.0);
    let error = fitted(&figure, &clip, &motion).unwrap_err().to_string();
    assert!(
        error.contains("body.abc: expected a body that the joints of the motion move"),
        "{error}"
    );
    let none: Result<FittedRig> = fit_rig("a".as_ref(), &[], &[], &motion, |_| Ok(()));
    assert!(none.is_err());
    let (faces, frames) = (&figure.character.body.faces, frames(&figure, &clip));
    let mut rounds = Vec::new();
    let ended = fit_rig("a".as_ref(), faces, &frames, &motion, |done| {
        rounds.push(done);
        match done {
            2 => Err(Error::content("a".as_ref(), "no interruption", "one")),
            _ => Ok(()),
        }
    });
    assert!(ended.unwrap_err().to_string().contains("no interruption"));
    assert_eq!(rounds, [0, 1, 2], "an error ends the fit");
}

#[test]
fn motion_between_two_frames_is_interpolated() {
    let (figure, clip) = (Figure::mixamo(), mixamo_clip("walk", 0, 10));
    let motion = motion(&figure.character.skeleton, &clip, Unknown::Nothing, 1.0);
    let (a, b, middle) = (motion.at(3.0 / FPS), motion.at(4.0 / FPS), motion.at(3.5 / FPS));
    for ((a, b), middle) in a.iter().zip(&b).zip(&middle) {
        assert!(middle.translation.distance(0.5 * (a.translation + b.translation)) < 1e-5);
        let dot = middle.rotation.dot(a.rotation.slerp(b.rotation, 0.5));
        assert!(dot > 1.0 - 1e-6, "{dot}");
    }
    assert!((motion.seconds() - 9.0 / FPS).abs() < 1e-9);
}
