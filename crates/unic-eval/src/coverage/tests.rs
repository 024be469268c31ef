//! Contract: a capture covers itself; motion that it does not cover is found, named and placed in
//! time.

use super::*;
use crate::synthetic::cube;
use glam::{Quat, Vec3};
use unic_core::{
    Pose,
    character::Character,
    skeleton::{Skeleton, SkeletonParts},
};

/// Cube with an arm of two bones at its side.
fn character() -> Character {
    let names = ["pelvis", "spine1", "L_shoulder", "L_elbow"];
    let skeleton = Skeleton::new(SkeletonParts {
        names: names.map(String::from).to_vec(),
        parents: vec![-1, 0, 1, 2],
        joints: vec![
            Vec3::Y,
            Vec3::Y * 1.3,
            Vec3::new(0.2, 1.4, 0.0),
            Vec3::new(0.5, 1.4, 0.0),
        ],
        rest_pose: vec![],
    });
    Character {
        skeleton: skeleton.unwrap(),
        ..cube()
    }
}

/// Makes a clip that walks forwards at `speed` m/s. The spine sways, and the elbow bends up to
/// `bend` radians.
fn walk(name: &str, seconds: f32, speed: f32, bend: f32) -> Clip {
    let pose = |t: usize| {
        let s = t as f32 / 30.0;
        Pose {
            trans: Vec3::new(0.0, 0.02 * (6.0 * s).sin(), speed * s),
            local: vec![
                Quat::IDENTITY,
                Quat::from_rotation_y(0.3 * (3.0 * s).sin()),
                Quat::from_rotation_z(-1.3),
                Quat::from_rotation_y(-bend * (0.5 - 0.5 * (3.0 * s).cos())),
            ],
        }
    };
    Clip {
        name: name.into(),
        fps: 30.0,
        poses: (0..(30.0 * seconds) as usize).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    }
}

fn fitted(clips: &[Clip]) -> Coverage {
    let character = character();
    let spec = MotionSpec::new(
        MotionLayout::Heading,
        VelocityScheme::Backward,
        [3; 4],
        &character,
    );
    Coverage::fit(spec.unwrap(), &character, clips).unwrap()
}

#[test]
fn a_capture_covers_itself_wherever_it_stands() {
    let clips = [walk("slow", 10.0, 1.0, 0.5), walk("fast", 10.0, 1.5, 0.5)];
    let coverage = fitted(&clips);
    let mut moved = clips[1].clone();
    let turn = Quat::from_rotation_y(2.0);
    for pose in &mut moved.poses {
        pose.trans = turn * pose.trans + Vec3::new(5.0, 0.0, -3.0);
        pose.local[0] = turn * pose.local[0];
    }
    for clip in [&clips[0], &moved] {
        let report = coverage.assess(clip);
        assert_eq!(report.covered_percent, 100.0, "{report}");
        assert!(report.largest_distance < 5e-2, "{report}");
        assert!(report.worst.is_empty() && report.outside.is_empty(), "{report}");
    }
}

#[test]
fn an_elbow_that_bends_farther_is_named_with_its_time() {
    let clips = [walk("slow", 10.0, 1.0, 0.5), walk("fast", 10.0, 1.5, 0.5)];
    let coverage = fitted(&clips);
    let mut bent = clips[0].clone();
    // From 4 s to 5 s the forearm goes up by 90°, without a jump.
    for t in 120..150 {
        let rise = (std::f32::consts::PI * (t - 120) as f32 / 30.0).sin();
        bent.poses[t].local[3] *= Quat::from_rotation_y(-1.57 * rise);
    }
    let report = coverage.assess(&bent);
    assert!((85.0..95.0).contains(&report.covered_percent), "{report}");
    let worst = &report.worst[0];
    assert!(
        (3.9..4.4).contains(&worst.from_seconds) && (4.6..5.2).contains(&worst.to_seconds),
        "{report}"
    );
    let elbow = report
        .outside
        .iter()
        .find(|e| e.quantity == "bend of the left elbow")
        .unwrap();
    let seen = 0.5_f32.to_degrees();
    assert!(
        (elbow.seen[1] - seen).abs() < 0.1 && elbow.found > seen + 60.0,
        "{elbow}"
    );
    assert!((4.3..4.7).contains(&elbow.at_seconds), "{elbow}");
    assert!(worst.reasons.iter().any(|e| e.quantity.contains("left elbow")));
    assert!(report.to_string().contains("bend of the left elbow"), "{report}");
    assert!(
        !report.outside.iter().any(|e| e.quantity.contains("spine")),
        "{report}"
    );
}

#[test]
fn running_is_missing_in_a_capture_of_walks() {
    let coverage = fitted(&[walk("slow", 10.0, 1.0, 0.5), walk("fast", 10.0, 1.5, 0.5)]);
    let report = coverage.assess(&walk("run", 5.0, 3.5, 0.5));
    assert_eq!(report.covered_percent, 0.0, "{report}");
    let speed = report.outside.iter().find(|e| e.quantity == "speed").unwrap();
    assert!(
        (speed.found - 3.5).abs() < 1e-3 && (speed.seen[1] - 1.5).abs() < 1e-3,
        "{speed}"
    );
    let text = report.to_string();
    assert!(
        text.contains("the capture lacks: running (5.0 s here, 0.0 s there)"),
        "{text}"
    );
    assert!(text.contains("most like fast"), "{text}");
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["worst"][0]["nearest"]["clip"], "fast");
    assert_eq!(json["outside"][0]["unit"], "m/s");
}

#[test]
fn a_clip_that_is_added_is_covered() {
    let one = fitted(&[walk("slow", 10.0, 1.0, 0.5), walk("fast", 10.0, 1.5, 0.5)]);
    let clip = walk("new", 5.0, 1.25, 0.6);
    let two = fitted(&[
        walk("slow", 10.0, 1.0, 0.5),
        walk("fast", 10.0, 1.5, 0.5),
        clip.clone(),
    ]);
    let [one, two] = [one, two].map(|c| c.assess(&clip).covered_percent);
    assert!(two == 100.0 && one < two, "{one} {two}");
}

#[test]
fn the_neighbour_search_is_exact() {
    let clips = [walk("slow", 10.0, 1.0, 0.5), walk("fast", 10.0, 1.5, 0.9)];
    let coverage = fitted(&clips);
    let skeleton = &coverage.character.skeleton;
    let of = |clip: &Clip| ClipKinematics::new(&coverage.spec, skeleton, clip);
    let seen: Vec<ClipKinematics> = clips.iter().map(of).collect();
    let asked = of(&walk("asked", 3.0, 1.3, 1.4));
    let found = coverage.frames.nearest(&asked);
    for (frame, neighbour) in found.iter().enumerate() {
        let distances = seen.iter().flat_map(|clip| {
            (0..clip.len()).map(|t| {
                coverage
                    .frames
                    .plain_distance(asked.motion(frame), clip.motion(t))
            })
        });
        let nearest = distances.fold(f32::INFINITY, f32::min);
        assert!(
            (neighbour.distance - nearest).abs() < 1e-4 * (1.0 + nearest),
            "{frame}: {neighbour:?} {nearest}"
        );
    }
}
