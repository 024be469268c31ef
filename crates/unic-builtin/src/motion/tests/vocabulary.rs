//! Contract: timelines and the standard set are repeatable and valid, and other skeletons are
//! refused.

use super::figure::{every_kind, figure, perform, travel};
use crate::motion::{
    Action, ArmRaise, Performer, PerformerError, STANDARD_CLIPS, Side, Timeline, control_set, standard_clip,
    standard_set,
};
use proptest::prelude::*;
use unic_core::{skeleton::Skeleton, skinning::SkinningWeights};

#[test]
fn the_standard_set_is_complete_and_repeatable() {
    let body = figure();
    let set = standard_set(&body, 3, 30.0).unwrap();
    let seconds: f32 = set.train.iter().map(|c| c.seconds()).sum();
    assert!((360.0..=480.0).contains(&seconds), "{seconds} s");
    let all = || set.train.iter().chain(&set.test);
    let names: Vec<&str> = all().map(|c| c.name.as_str()).collect();
    assert_eq!(names, STANDARD_CLIPS);
    assert!(all().all(|c| c.fps == 30.0 && c.poses.iter().all(|p| p.is_valid())));
    assert_eq!(set, standard_set(&body, 3, 30.0).unwrap());
    assert_ne!(set, standard_set(&body, 4, 30.0).unwrap());
    for clip in all() {
        let alone = standard_clip(&body, &clip.name, 3, 30.0).unwrap();
        assert!(alone.as_ref() == Some(clip), "{}", clip.name);
    }
    assert_eq!(standard_clip(&body, "polka", 3, 30.0).unwrap(), None);
}

#[test]
fn any_rate_samples_the_same_motion() {
    let motion = perform(&figure(), every_kind());
    let (slow, fast) = (motion.clip("slow", 25.0), motion.clip("fast", 100.0));
    assert!(
        slow.poses
            .iter()
            .zip(fast.poses.iter().step_by(4))
            .all(|(a, b)| a == b)
    );
    assert!((slow.seconds() - motion.seconds()).abs() < 1.0 / 25.0);
}

#[test]
fn hands_go_where_they_are_raised_to() {
    let body = figure();
    let hand = |raise| {
        let motion = perform(&body, [Action::RaiseArms(raise)]);
        let pose = motion.pose_at(0.5 * motion.seconds());
        super::figure::joints(&body, &pose)[20].translation
    };
    assert!(hand(ArmRaise::Overhead).y > 1.75);
    assert!(hand(ArmRaise::Sideways).x > 0.6);
    assert!(hand(ArmRaise::Forward).z > 0.4);
    assert!(hand(ArmRaise::Wave(Side::Left)).y > 1.4);
    assert!(hand(ArmRaise::Wave(Side::Right)).y < 1.1);
}

#[test]
fn other_skeletons_are_refused() {
    let mut body = figure();
    let mut parts = body.skeleton.to_parts();
    parts.parents[15] = 9;
    body.skeleton = Skeleton::new(parts).unwrap();
    let expected = PerformerError::Parent {
        joint: 15,
        expected: Some(12),
        found: Some(9),
    };
    assert_eq!(Performer::new(&body).unwrap_err(), expected);
    let mut body = figure();
    let rows = body.body.vertices.len();
    let dense: Vec<f32> = (0..rows * 24).map(|i| f32::from(u8::from(i % 24 == 0))).collect();
    body.weights = SkinningWeights::from_dense(&dense, rows, 24).unwrap();
    assert_eq!(Performer::new(&body).unwrap_err(), PerformerError::NoFeet);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Poses of any timeline are finite, and the pelvis stays within the body's height.
    #[test]
    fn every_timeline_is_a_valid_motion(
        seed in any::<u64>(), speed in 0.0_f32..6.0, turn_rate in -1.5_f32..1.5, height in 0.0_f32..0.8,
    ) {
        let performer = Performer::new(&figure()).unwrap();
        let timeline = Timeline::new(seed)
            .then(travel(speed, turn_rate, 3.0))
            .then(Action::Stop { seconds: 0.0 })
            .then(Action::Jump { height })
            .then(Action::Dance { seconds: 3.0, beats_per_minute: 300.0 * height });
        for pose in timeline.perform(&performer).clip("any", 10.0).poses {
            prop_assert!(pose.is_valid());
            prop_assert!((-0.75..=0.95).contains(&pose.trans.y), "{}", pose.trans.y);
        }
    }
}

/// A pointer's walk ends at a stand, and goes forward, backward and to both sides.
#[test]
fn a_wander_goes_in_all_directions_and_ends_at_a_stand() {
    let body = figure();
    let motion = perform(&body, [Action::Wander { seconds: 40.0 }]);
    let clip = motion.clip("", 30.0);
    let velocities = clip.poses.windows(2).map(|two| {
        let forward = two[0].local[0] * glam::Vec3::Z;
        let yaw = glam::Quat::from_rotation_y(forward.x.atan2(forward.z));
        yaw.inverse() * (two[1].trans - two[0].trans) * 30.0
    });
    let velocities: Vec<glam::Vec3> = velocities.collect();
    let any = |is: fn(glam::Vec3) -> bool| velocities.iter().any(|&v| is(v));
    assert!(any(|v| v.z > 1.2) && any(|v| v.z < -0.4), "forward and backward");
    assert!(any(|v| v.x > 0.4) && any(|v| v.x < -0.4), "to both sides");
    assert!(velocities.iter().all(|v| v.length() < 2.6));
    let last = velocities[velocities.len() - 5..].iter();
    assert!(last.map(|v| v.length()).fold(0.0, f32::max) < 0.1);
}

/// A start from a stand to 1.8 m/s within 0.8 s.
#[test]
fn quick_steps_keep_the_pelvis_up() {
    let body = figure();
    let performer = Performer::new(&body).unwrap();
    let start = || Timeline::new(2).then(travel(1.8, 0.0, 3.0));
    let lowest = |timeline: Timeline| {
        let poses = timeline.perform(&performer).clip("", 30.0).poses;
        poses
            .iter()
            .map(|pose| pose.trans.y)
            .fold(f32::INFINITY, f32::min)
    };
    let (quick, ordinary) = (lowest(start().with_quick_steps()), lowest(start()));
    assert!(quick > -0.13 && quick > ordinary + 0.03, "{quick} {ordinary}");
}

#[test]
fn the_control_set_is_repeatable_and_has_all_speeds() {
    let body = figure();
    let set = control_set(&body, 3, 30.0).unwrap();
    assert_eq!(set, control_set(&body, 3, 30.0).unwrap());
    let speeds = set.iter().flat_map(|clip| {
        let steps = clip.poses.windows(2);
        steps.map(|two| (two[1].trans - two[0].trans).length() * 30.0)
    });
    assert!(speeds.fold(0.0, f32::max) > 3.0);
    assert!(set.iter().all(|clip| clip.seconds() > 10.0));
}
