//! Steps of a controller.

use crate::common::{FPS, SMPL_LEGS, figure, figure_settings, gliding, human_database, winding};
use glam::{Vec2, Vec3};
use std::{
    f32::consts::{FRAC_PI_4, PI},
    sync::Arc,
};
use unic_core::{
    Pose,
    motion_matching::{
        Command, Controller, ControllerError, ControllerSettings, ControllerState, Database,
        DatabaseSettings, Facing, MouseButtons, MouseControl, PoseInterpolator, RootFrame, SearchOutcome,
        SimulatedObject, StoredClip, TagFilter, TaggedClip, direction_of, wrapped,
    },
};

fn controller() -> Controller {
    Controller::new(human_database(), ControllerSettings::default())
}

/// Commands that change direction and speed every second.
fn command(tick: usize) -> Command {
    let second = (tick / 30) as f32;
    Command::travel(direction_of(1.9 * second) * (1.0 + second % 3.0 * 0.5))
}

fn joints(controller: &Controller) -> Vec<Vec3> {
    let mut world = Vec::new();
    let skeleton = controller.database().skeleton();
    skeleton.forward_kinematics(controller.pose(), &mut world);
    world.iter().map(|joint| joint.translation).collect()
}

fn poses(controller: &mut Controller, ticks: std::ops::Range<usize>) -> Vec<Pose> {
    ticks
        .map(|tick| {
            controller.step(&command(tick)).unwrap();
            controller.pose().clone()
        })
        .collect()
}

/// The trap of motion matching: a cost of continuity from which the character never leaves idle.
#[test]
fn every_command_leaves_idle_within_a_second() {
    for direction in 0..8 {
        for speed in [0.8, 1.4, 2.0] {
            let mut controller = controller();
            for _ in 0..30 {
                controller.step(&Command::STAND).unwrap();
            }
            let from = controller.state().root().position;
            let way = direction_of(direction as f32 * FRAC_PI_4);
            for _ in 0..30 {
                controller.step(&Command::travel(way * speed)).unwrap();
            }
            let travelled = (controller.state().root().position - from).dot(way);
            assert!(travelled > 0.25 * speed, "{direction} {speed}: {travelled} m");
        }
    }
}

#[test]
fn commands_to_stand_stop_the_character() {
    let mut controller = controller();
    poses(&mut controller, 0..60);
    for _ in 0..60 {
        controller.step(&Command::STAND).unwrap();
    }
    let from = controller.state().root();
    for _ in 0..30 {
        controller.step(&Command::STAND).unwrap();
    }
    let to = controller.state().root();
    assert!(from.position.distance(to.position) < 0.05);
}

#[test]
fn a_changed_command_is_searched_for_at_once() {
    let settings = ControllerSettings {
        search_interval_s: 10.0,
        ..ControllerSettings::default()
    };
    let mut controller = Controller::new(human_database(), settings);
    controller.step(&Command::STAND).unwrap();
    assert_eq!(
        controller.step(&Command::STAND).unwrap().search,
        SearchOutcome::NotDue
    );
    let walk = Command::travel(Vec2::new(0.0, 1.4));
    assert_ne!(controller.step(&walk).unwrap().search, SearchOutcome::NotDue);
}

/// Controller without searches that are due, over a clip tagged `glide` and a clip tagged `wind`.
fn tagged_controller() -> Controller {
    let (glide, wind) = (gliding(300, 0.0), winding(300, 0.7));
    let clips = [
        TaggedClip::whole(&glide, "glide"),
        TaggedClip::whole(&wind, "wind"),
    ];
    // No search ends within half a second of the end of a clip, which would cause the next search.
    let rules = DatabaseSettings {
        end_margin_s: 0.5,
        ..figure_settings()
    };
    let database = Database::build(&figure(), &clips, rules).unwrap();
    let settings = ControllerSettings {
        search_interval_s: 100.0,
        ..ControllerSettings::default()
    };
    Controller::new(Arc::new(database), settings)
}

/// Tags that exclude the frame that plays.
fn without_present(controller: &Controller) -> TagFilter {
    TagFilter {
        required: 0,
        excluded: controller.database().tags(controller.state().frame()),
    }
}

#[test]
fn a_change_of_the_facing_mode_is_searched_for_at_once() {
    let mut controller = tagged_controller();
    let facing = |facing| Command {
        velocity: Vec2::Y,
        facing,
    };
    let mut search = |mode| controller.step(&facing(mode)).unwrap().search;
    search(Facing::Travel);
    assert_eq!(search(Facing::Travel), SearchOutcome::NotDue);
    assert_ne!(search(Facing::Yaw(0.0)), SearchOutcome::NotDue);
    assert_eq!(search(Facing::Yaw(0.0)), SearchOutcome::NotDue);
    assert_ne!(search(Facing::Travel), SearchOutcome::NotDue);
}

#[test]
fn frames_that_are_excluded_stop_playing_at_once() {
    let mut controller = tagged_controller();
    let walk = Command::travel(Vec2::Y);
    while controller.step(&walk).unwrap().search != SearchOutcome::NotDue {}
    let tags = without_present(&controller);
    controller.set_tags(tags).unwrap();
    assert_eq!(controller.step(&walk).unwrap().search, SearchOutcome::Switched);
    for _ in 0..400 {
        let playing = controller.database().tags(controller.state().frame());
        assert!(tags.accepts(playing));
        controller.step(&walk).unwrap();
    }
    // Tags that accept more are searched for at once too.
    controller.set_tags(TagFilter::default()).unwrap();
    assert_ne!(controller.step(&walk).unwrap().search, SearchOutcome::NotDue);
}

#[test]
fn tags_are_part_of_a_saved_state() {
    let (mut a, mut b) = (tagged_controller(), tagged_controller());
    poses(&mut a, 0..10);
    a.set_tags(without_present(&a)).unwrap();
    b.restore(a.state().clone()).unwrap();
    assert_eq!(poses(&mut a, 10..100), poses(&mut b, 10..100));
    let text = serde_json::to_string(a.state()).unwrap();
    let none = text.replacen("\"required\":0", "\"required\":4", 1);
    let none: ControllerState = serde_json::from_str(&none).unwrap();
    assert_eq!(b.restore(none), Err(ControllerError::NoFrames));
    assert_eq!(a.state(), b.state());
}

/// World positions of the joints of a frame in the space of its clip.
fn captured_joints(database: &Database, frame: usize) -> Vec<Vec3> {
    let (skeleton, mut local) = (database.skeleton(), database.rotations(frame).to_vec());
    let world_from_root = database.root(frame).world_from_root();
    let root = skeleton.root();
    local[root] = (world_from_root.rotation * local[root]).normalize();
    let trans = world_from_root.point(database.hips(frame)) - skeleton.joints()[root];
    let mut world = Vec::new();
    skeleton.forward_kinematics(&Pose { trans, local }, &mut world);
    world.iter().map(|joint| joint.translation).collect()
}

/// Largest speed of any joint in the last of three frames, and largest change of its velocity, m/s.
fn speed_and_jump(three: &[Vec<Vec3>]) -> [f32; 2] {
    let pairs = three[0].iter().zip(&three[1]).zip(&three[2]);
    pairs.fold([0.0f32; 2], |[speed, jump], ((&a, &b), &c)| {
        [
            speed.max((c - b).length() * FPS),
            jump.max((c - 2.0 * b + a).length() * FPS),
        ]
    })
}

/// 99th percentiles over the frames of the database.
fn captured_speed_and_jump(database: &Database) -> [f32; 2] {
    let of_clip = |clip: &StoredClip| {
        let joints = (clip.first..clip.end()).map(|frame| captured_joints(database, frame));
        let joints: Vec<_> = joints.collect();
        joints.windows(3).map(speed_and_jump).collect::<Vec<_>>()
    };
    let all: Vec<[f32; 2]> = database.clips().iter().flat_map(of_clip).collect();
    [0, 1].map(|i| {
        let mut values: Vec<f32> = all.iter().map(|pair| pair[i]).collect();
        values.sort_by(f32::total_cmp);
        values[values.len() * 99 / 100]
    })
}

/// Joints do not jump at switches. Their speed and the change of their velocity stay within 1.5
/// times the 99th percentile of the captured motion.
#[test]
fn switches_are_continuous() {
    let [most_speed, most_jump] = captured_speed_and_jump(&human_database()).map(|x| 1.5 * x);
    let mut controller = controller();
    let mut tracks = Vec::new();
    let mut switches = Vec::new();
    for tick in 0..300 {
        let report = controller.step(&command(tick)).unwrap();
        tracks.push(joints(&controller));
        if report.search == SearchOutcome::Switched && tick >= 2 {
            switches.push(tick);
        }
    }
    assert!(switches.len() > 20);
    for t in switches {
        let [speed, jump] = speed_and_jump(&tracks[t - 2..=t]);
        assert!(speed < most_speed, "tick {t}: {speed} m/s, most {most_speed}");
        assert!(jump < most_jump, "tick {t}: {jump} m/s, most {most_jump}");
    }
}

#[test]
fn locked_feet_do_not_move_and_toes_stay_above_the_ground() {
    let mut controller = controller();
    let rest = controller.database().settings().toe_heights_m;
    let (mut before, mut was_locked, mut ticks) = (joints(&controller), [false; 2], 0);
    for tick in 0..600 {
        controller.step(&command(tick)).unwrap();
        let (now, locked) = (joints(&controller), controller.locked_feet());
        for side in 0..2 {
            let toe = SMPL_LEGS[side].toe;
            assert!(now[toe].y > rest[side] - 0.005, "tick {tick}: {} m", now[toe].y);
            if locked[side] && was_locked[side] {
                let slip = (now[toe] - before[toe]) * Vec3::new(1.0, 0.0, 1.0);
                let speed = slip.length() * FPS;
                assert!(speed < 0.01, "tick {tick}: {speed} m/s");
                ticks += 1;
            }
        }
        (before, was_locked) = (now, locked);
    }
    assert!(ticks > 300, "{ticks} locked ticks");
}

#[test]
fn bones_keep_their_lengths() {
    let mut controller = controller();
    poses(&mut controller, 0..100);
    let database = human_database();
    let (skeleton, world) = (database.skeleton(), joints(&controller));
    for (joint, parent) in skeleton.parents().iter().enumerate() {
        if let Some(parent) = *parent {
            let rest = skeleton.joints()[joint].distance(skeleton.joints()[parent]);
            assert!((world[joint].distance(world[parent]) - rest).abs() < 1e-4);
        }
    }
}

#[test]
fn runs_and_restored_states_give_the_same_bytes() {
    let (mut a, mut b) = (controller(), controller());
    assert_eq!(poses(&mut a, 0..200), poses(&mut b, 0..200));
    let saved = serde_json::to_string(a.state()).unwrap();
    let ahead = poses(&mut a, 200..300);
    let mut other = controller();
    other
        .restore(serde_json::from_str::<ControllerState>(&saved).unwrap())
        .unwrap();
    assert_eq!(other.state(), b.state());
    assert_eq!(poses(&mut other, 200..300), ahead);
}

#[test]
fn a_restored_state_shows_its_pose() {
    let (mut a, mut b) = (controller(), controller());
    let shown = poses(&mut a, 0..100).pop().unwrap();
    b.restore(a.state().clone()).unwrap();
    assert_eq!(b.pose(), &shown);
}

#[test]
fn unusable_commands_states_and_tags_are_refused() {
    let mut controller = controller();
    let before = controller.state().clone();
    let wrong = Command::travel(Vec2::new(f32::NAN, 0.0));
    assert_eq!(controller.step(&wrong), Err(ControllerError::NotFinite));
    let none = TagFilter {
        required: 1,
        excluded: 0,
    };
    assert_eq!(controller.set_tags(none), Err(ControllerError::NoFrames));
    let text = serde_json::to_string(&before).unwrap();
    let frame = format!("\"frame\":{}", before.frame());
    let beyond = text.replacen(&frame, "\"frame\":99999999", 1);
    let beyond: ControllerState = serde_json::from_str(&beyond).unwrap();
    assert!(matches!(
        controller.restore(beyond),
        Err(ControllerError::State { .. })
    ));
    assert_eq!(controller.state(), &before);
}

#[test]
fn steps_allocate_nothing() {
    let mut controller = controller();
    poses(&mut controller, 0..5);
    let counted = allocation_counter::measure(|| {
        for tick in 5..200 {
            controller.step(&command(tick)).unwrap();
        }
    });
    assert_eq!(counted.count_total, 0);
}

#[test]
fn the_root_follows_the_object() {
    let mut controller = controller();
    for tick in 0..240 {
        let circle = Command::travel(direction_of(0.7 * tick as f32 / 30.0) * 1.4);
        controller.step(&circle).unwrap();
        let (object, root) = (controller.state().object().root(), controller.state().root());
        assert!(object.position.distance(root.position) < 0.15);
        assert!(wrapped(object.yaw - root.yaw).abs() < 0.2);
    }
}

/// The interpolated pose is the earlier one at share 0 and the later one at share 1.
#[test]
fn display_poses_lie_between_the_ticks() {
    let mut controller = controller();
    let mut display = PoseInterpolator::default();
    let two = poses(&mut controller, 40..42);
    two.iter().for_each(|pose| display.tick(pose));
    for (share, expected) in [(0.0, &two[0]), (1.0, &two[1])] {
        let shown = display.show(share);
        assert!(shown.trans.distance(expected.trans) < 1e-6);
        for (a, b) in shown.local.iter().zip(&expected.local) {
            assert!(a.angle_between(*b) < 2e-3);
        }
    }
    let middle = display.show(0.5).trans;
    assert!(middle.distance((two[0].trans + two[1].trans) * 0.5) < 1e-6);
    display.cut(&two[1]);
    // Between two equal poses a last bit is rounding.
    assert!(display.show(0.3).trans.distance(two[1].trans) < 1e-6);
}

/// Forward on a stick is away from the camera, right is to its right.
#[test]
fn sticks_are_relative_to_the_camera() {
    let near = |command: Command, x: f32, z: f32| {
        assert!(command.velocity.distance(Vec2::new(x, z)) < 1e-5, "{command:?}");
    };
    near(Command::from_stick(Vec2::Y, 0.0, 2.0), 0.0, 2.0);
    near(Command::from_stick(Vec2::X, 0.0, 2.0), -2.0, 0.0);
    near(Command::from_stick(Vec2::Y, PI / 2.0, 1.0), 1.0, 0.0);
    near(Command::from_stick(Vec2::new(3.0, 4.0), 0.0, 1.0), -0.6, 0.8);
}

/// The paper's mouse control: a far pointer draws at full reach, a near one stops, the second
/// button turns.
#[test]
fn the_mouse_draws_the_character_to_its_pointer() {
    let object = SimulatedObject::at_rest(RootFrame::default());
    let mut mouse = MouseControl::new(f32::INFINITY);
    let mut held =
        |pointer, buttons| (0..20).fold(Command::STAND, |_, _| mouse.command(&object, pointer, buttons));
    let far = held(Vec2::new(5.0, 0.0), MouseButtons::Left);
    assert!((far.velocity - Vec2::new(3.4, 0.0)).length() < 1e-3, "{far:?}");
    assert_eq!(far.facing, Facing::Yaw(0.0));
    let turning = held(Vec2::new(5.0, 0.0), MouseButtons::LeftAndRight);
    assert_eq!(turning.facing, Facing::Yaw(PI / 2.0));
    assert_eq!(held(Vec2::new(0.1, 0.0), MouseButtons::Left).velocity, Vec2::ZERO);
    assert!(
        held(Vec2::new(5.0, 0.0), MouseButtons::Released)
            .velocity
            .length()
            < 1e-3
    );
}

/// A pointer that is not finite, such as that of a ray that misses the ground, leaves the target
/// where it is.
#[test]
fn the_mouse_ignores_pointers_that_are_not_finite() {
    let object = SimulatedObject::at_rest(RootFrame::default());
    let mut mouse = MouseControl::new(2.0);
    let mut held = |pointer| mouse.command(&object, pointer, MouseButtons::LeftAndRight);
    let before = (0..20).map(|_| held(Vec2::new(5.0, 0.0))).last();
    for wrong in [f32::NAN, f32::INFINITY] {
        assert_eq!(Some(held(Vec2::new(wrong, 0.0))), before);
    }
}
