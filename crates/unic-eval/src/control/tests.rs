//! Contract: scripts repeat and walk the paths that their names say; metrics have their closed-form
//! values on runs that are made by hand.

use super::{ControlMetrics, ControlRun, DataReference, Player, Script, Tick};
use glam::{Quat, Vec2, Vec3};
use unic_core::{
    Pose,
    clip::Clip,
    leg::Leg,
    motion_matching::{
        Clamping, Command, Database, DatabaseSettings, Feature, FeatureGroup, RootFrame, SearchOutcome,
        SimulatedObject, StepReport, TagFilter, TagRange, TaggedClip,
    },
    skeleton::{Skeleton, SkeletonParts},
};

const FPS: f32 = 30.0;

/// A pelvis and one toe, which is both feet. It glides at 1 m/s.
fn database() -> Database {
    database_of(|t| t as f32 / FPS, vec![])
}

/// A glide with its position along +Z by frame, metres.
fn database_of(z: impl Fn(usize) -> f32, tags: Vec<TagRange>) -> Database {
    let skeleton = Skeleton::new(SkeletonParts {
        parents: vec![-1, 0],
        joints: vec![Vec3::Y, Vec3::ZERO],
        ..SkeletonParts::default()
    })
    .unwrap();
    let pose = |t: usize| Pose {
        trans: Vec3::Z * z(t),
        local: vec![Quat::IDENTITY; 2],
    };
    let clip = Clip {
        name: "glide".into(),
        fps: FPS,
        poses: (0..60).map(pose).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    };
    let leg = Leg {
        hip: 0,
        knee: 0,
        ankle: 1,
        toe: 1,
    };
    let feature = Feature::JointPosition(1);
    let settings = DatabaseSettings {
        groups: vec![FeatureGroup { feature, weight: 1.0 }],
        legs: [leg; 2],
        toe_heights_m: [0.0; 2],
        mirror: None,
        end_margin_s: 0.1,
        contact_speed_m_s: 0.2,
        contact_height_m: 0.05,
    };
    Database::build(&skeleton, &[TaggedClip { clip: &clip, tags }], settings).unwrap()
}

/// Frames that are never played do not count.
#[test]
fn references_are_those_of_the_frames_that_are_played() {
    let fast = TagRange {
        tag: "fast".into(),
        frames: 41..60,
    };
    // 1 m/s up to frame 40, 3 m/s behind it.
    let database = database_of(|t| (t + 2 * t.saturating_sub(40)) as f32 / FPS, vec![fast]);
    let played = |excluded| TagFilter {
        required: 0,
        excluded,
    };
    let all = DataReference::measure(&database, TagFilter::default());
    let slow = DataReference::measure(&database, played(database.tag_bit("fast").unwrap()));
    near(slow.skating_m_s, 1.0);
    near(all.skating_m_s, (40.0 * 1.0 + 19.0 * 3.0) / 59.0);
    // The change from one speed to the other is not among the slow frames.
    assert!(slow.jump_m_s < 1e-3 && all.jump_m_s > 1.9);
}

/// A run whose root moves at `speed(tick)` m/s along +Z, 0.1 m and 0.2 rad off the object.
fn run(ticks: usize, command: impl Fn(usize) -> Vec2, speed: impl Fn(usize) -> f32) -> ControlRun {
    let mut z = 0.0;
    let tick = |t: usize| {
        z += speed(t) / FPS;
        let root = RootFrame {
            position: Vec2::new(0.1, z),
            yaw: 0.2,
        };
        Tick {
            command: Command::travel(command(t)),
            object: RootFrame {
                position: Vec2::new(0.0, z),
                yaw: 0.0,
            },
            root,
            pose: Pose::default(),
            joints: vec![Vec3::new(0.1, 1.0, z), Vec3::new(0.1, 0.0, z)],
            locked: [true, false],
            frame: 0,
            report: StepReport {
                search: SearchOutcome::NotDue,
                adjusted_m: 0.01,
                clamping: if t.is_multiple_of(4) {
                    Clamping::Clamped
                } else {
                    Clamping::Within
                },
            },
        }
    };
    ControlRun {
        script: Script::StartStop,
        fps: FPS,
        ticks: (0..ticks).map(tick).collect(),
        queries: Vec::new(),
    }
}

fn near(found: f64, expected: f64) {
    assert!(
        (found - expected).abs() < 1e-3 * expected.abs().max(1.0),
        "{found}, expected {expected}"
    );
}

#[test]
fn errors_and_speeds_have_their_closed_form() {
    let database = database();
    let reference = DataReference::measure(&database, TagFilter::default());
    // The toe of the database glides at 1 m/s on the ground.
    near(reference.skating_m_s, 1.0);
    let steady = run(100, |_| Vec2::Y, |_| 0.5);
    let metrics = ControlMetrics::measure(&steady, &database, &reference);
    near(metrics.trajectory_error_m, 0.1);
    near(metrics.heading_error_deg, 0.2f64.to_degrees());
    near(metrics.foot_skating_ratio, 0.5);
    near(metrics.locked_foot_m_s, 0.5);
    near(metrics.clamped_percent, 25.0);
    near(metrics.adjusted_m, 1.0);
    assert_eq!(
        (metrics.response_s, metrics.stuck_s, metrics.transition_ratio),
        (None, 0.0, 0.0)
    );
}

/// A root that rises to 1 m/s within a second from the step on has made 90 % of it in 0.9 s.
#[test]
fn response_is_the_time_of_nine_tenths_of_a_step() {
    let database = database();
    let reference = DataReference::measure(&database, TagFilter::default());
    let command = |t: usize| if t < 30 { Vec2::ZERO } else { Vec2::Y };
    let speed = |t: usize| ((t as f32 - 29.0) / 30.0).clamp(0.0, 1.0);
    let metrics = ControlMetrics::measure(&run(120, command, speed), &database, &reference);
    assert!((metrics.response_s.unwrap() - 0.9).abs() < 0.04, "{metrics:?}");
    assert!((metrics.stuck_s - 0.25).abs() < 0.04, "{metrics:?}");
    // A root that never moves is stuck until the end.
    let metrics = ControlMetrics::measure(&run(120, command, |_| 0.0), &database, &reference);
    near(metrics.stuck_s, 91.0 / 30.0);
}

/// The object of the database's rate follows the path of a script if it obeys at once.
fn path(script: Script, seed: u64) -> Vec<Vec2> {
    let mut player = Player::new(script, seed);
    let mut object = SimulatedObject::at_rest(RootFrame::default());
    (0..(script.seconds() * FPS) as usize)
        .map(|tick| {
            let command = player.command(tick as f32 / FPS, &object);
            object.motion.position += command.velocity / FPS;
            object.motion.position
        })
        .collect()
}

#[test]
fn paths_have_their_shapes() {
    let extent = |script: Script| {
        let path = path(script, 0);
        let along = |axis: usize| {
            let values = || path.iter().map(|p| p[axis]);
            values().fold(f32::MIN, f32::max) - values().fold(f32::MAX, f32::min)
        };
        [along(0), along(1)]
    };
    let close = |found: [f32; 2], expected: [f32; 2]| {
        assert!(
            (0..2).all(|i| (found[i] - expected[i]).abs() < 0.15),
            "{found:?} {expected:?}"
        );
    };
    close(extent(Script::Circle), [4.0, 4.0]);
    close(extent(Script::Figure8), [8.0, 4.0]);
    close(extent(Script::Square), [4.0, 4.0]);
    close(extent(Script::Reversals), [0.0, 4.2]);
    close(extent(Script::StartStop), [0.0, 16.8]);
}

#[test]
fn scripts_repeat_and_seeds_differ() {
    for script in Script::ALL {
        assert_eq!(path(script, 3), path(script, 3));
    }
    for script in [Script::RandomMouse, Script::RandomStick] {
        assert_ne!(path(script, 3), path(script, 4));
    }
}

#[test]
fn the_random_stick_asks_for_all_speeds_and_stands() {
    let mut player = Player::new(Script::RandomStick, 5);
    let object = SimulatedObject::default();
    let speeds: Vec<f32> = (0..1200)
        .map(|tick| player.command(tick as f32 / FPS, &object).velocity.length())
        .collect();
    assert_eq!(speeds[0], 0.0);
    assert!(speeds[600..].contains(&0.0));
    assert!(speeds.iter().any(|&v| v > 1.5) && speeds.iter().any(|v| (0.4..1.0).contains(v)));
    assert!(speeds.iter().all(|&v| v < 2.001));
}
