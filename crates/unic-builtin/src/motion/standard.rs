//! Standard clips: a training set of everyday motion, and a test set of other kinds of motion.

use super::{
    PerformerError, Side,
    action::{Action, ArmRaise},
    timeline::{Performer, Timeline},
};
use unic_core::{character::Character, clip::Clip};

/// Names of the clips of [`standard_set`], training clips first.
pub const STANDARD_CLIPS: [&str; 15] = [
    "idle",
    "walk_speeds",
    "walk_circles",
    "walk_slalom",
    "walk_starts_stops",
    "run_speeds",
    "run_circles",
    "run_slalom",
    "run_starts_stops",
    "squats_jumps",
    "arms_trunk",
    "mixed",
    "sprint_stop",
    "turn_on_spot",
    "dance",
];

/// Seed with which the names of [`STANDARD_CLIPS`] mean the same motion in every program.
pub const STANDARD_SEED: u64 = 1;

/// Standard clips, split into training and test clips.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardSet {
    /// Training clips, about seven minutes.
    pub train: Vec<Clip>,
    /// Test clips of motion that `train` does not hold: sprints with hard stops, turns on the spot,
    /// a dance.
    pub test: Vec<Clip>,
}

/// Name and actions of a clip.
struct ClipPlan {
    name: &'static str,
    actions: Vec<Action>,
}

/// Stream of random numbers of the first training clip. Each clip has its own: changing one leaves
/// the others alone.
const FIRST_TRAIN_STREAM: u64 = 1;

/// Stream of random numbers of the first test clip.
const FIRST_TEST_STREAM: u64 = 1001;

impl ClipPlan {
    fn perform(self, performer: &Performer, seed: u64, stream: u64, fps: f32) -> Clip {
        Timeline::new(seed.wrapping_mul(1_000_003).wrapping_add(stream))
            .then_all(self.actions)
            .perform(performer)
            .clip(self.name, fps)
    }
}

/// Makes the standard clips for a character at `fps` frames a second.
///
/// The same character, seed and rate give the same bytes.
///
/// # Errors
/// The same as [`Performer::new`].
pub fn standard_set(character: &Character, seed: u64, fps: f32) -> Result<StandardSet, PerformerError> {
    let performer = Performer::new(character)?;
    let clips = |plans: Vec<ClipPlan>, first_stream: u64| {
        (plans.into_iter().zip(first_stream..))
            .map(|(plan, stream)| plan.perform(&performer, seed, stream, fps))
            .collect()
    };
    Ok(StandardSet {
        train: clips(train(), FIRST_TRAIN_STREAM),
        test: clips(test(), FIRST_TEST_STREAM),
    })
}

/// Makes one clip of [`standard_set`] by its name. Returns none for names that are not in
/// [`STANDARD_CLIPS`].
///
/// # Errors
/// The same as [`Performer::new`].
pub fn standard_clip(
    character: &Character,
    name: &str,
    seed: u64,
    fps: f32,
) -> Result<Option<Clip>, PerformerError> {
    let train = train().into_iter().zip(FIRST_TRAIN_STREAM..);
    let test = test().into_iter().zip(FIRST_TEST_STREAM..);
    let Some((plan, stream)) = train.chain(test).find(|(plan, _)| plan.name == name) else {
        return Ok(None);
    };
    let performer = Performer::new(character)?;
    Ok(Some(plan.perform(&performer, seed, stream, fps)))
}

fn clip(name: &'static str, actions: impl Into<Vec<Action>>) -> ClipPlan {
    let actions = actions.into();
    ClipPlan { name, actions }
}

fn travel(speed: f32, turn_rate: f32, seconds: f32) -> Action {
    Action::Travel {
        speed,
        turn_rate,
        seconds,
    }
}

fn idle(seconds: f32) -> Action {
    Action::Idle { seconds }
}

fn train() -> Vec<ClipPlan> {
    let walking_speeds = [0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 1.3];
    let running_speeds = [2.5, 3.0, 3.6, 4.3, 5.0, 3.2];
    vec![
        clip("idle", [idle(36.0)]),
        clip("walk_speeds", walking_speeds.map(|v| travel(v, 0.0, 5.5))),
        clip("walk_circles", circles([1.2, 0.9, 1.5], 0.55)),
        clip("walk_slalom", walking_slaloms()),
        clip("walk_starts_stops", starts_and_stops([1.0, 1.4, 0.8, 1.7, 1.2])),
        clip("run_speeds", running_speeds.map(|v| travel(v, 0.0, 5.0))),
        clip("run_circles", circles([2.6, 3.2, 3.8], 0.45)),
        clip("run_slalom", running_slaloms()),
        clip("run_starts_stops", starts_and_stops([2.6, 3.2, 2.8, 3.8, 3.0])),
        clip("squats_jumps", squats_and_jumps()),
        clip("arms_trunk", arms_and_trunk()),
        clip("mixed", mixed()),
    ]
}

fn test() -> Vec<ClipPlan> {
    let dance = Action::Dance {
        seconds: 30.0,
        beats_per_minute: 108.0,
    };
    vec![
        clip("sprint_stop", sprints()),
        clip("turn_on_spot", turns_on_spot()),
        clip("dance", [dance]),
    ]
}

/// Circles to the left and to the right at each speed (m/s) and the given turning rate (rad/s).
fn circles(speeds: [f32; 3], turn_rate: f32) -> Vec<Action> {
    (speeds.into_iter())
        .flat_map(|v| [travel(v, turn_rate, 6.5), travel(v, -turn_rate, 6.5)])
        .collect()
}

fn walking_slaloms() -> [Action; 2] {
    [
        Action::Slalom {
            speed: 1.3,
            turn_rate: 0.7,
            period: 5.0,
            seconds: 20.0,
        },
        Action::Slalom {
            speed: 1.0,
            turn_rate: 0.9,
            period: 4.0,
            seconds: 14.0,
        },
    ]
}

fn running_slaloms() -> [Action; 2] {
    [
        Action::Slalom {
            speed: 2.7,
            turn_rate: 0.6,
            period: 4.5,
            seconds: 16.0,
        },
        Action::Slalom {
            speed: 3.4,
            turn_rate: 0.45,
            period: 4.0,
            seconds: 12.0,
        },
    ]
}

/// Starts to each speed (m/s), straight or in curves, and stops in between.
fn starts_and_stops(speeds: [f32; 5]) -> Vec<Action> {
    (speeds.into_iter().zip([0.0, 0.4, -0.4, 0.0, -0.3]))
        .flat_map(|(speed, turn_rate)| [travel(speed, turn_rate, 3.8), idle(1.2)])
        .collect()
}

fn squats_and_jumps() -> Vec<Action> {
    let squat = |depth| Action::Squat { depth };
    let jump = |height| Action::Jump { height };
    let squats = [0.25, 0.4, 0.5, 0.35].map(squat);
    let jumps = [0.12, 0.25, 0.35, 0.2].map(jump);
    let pairs = squats.into_iter().zip(jumps);
    pairs.flat_map(|(squat, jump)| [squat, jump, idle(0.8)]).collect()
}

fn arms_and_trunk() -> Vec<Action> {
    vec![
        Action::RaiseArms(ArmRaise::Forward),
        Action::Twist { angle: 0.6 },
        Action::RaiseArms(ArmRaise::Sideways),
        Action::SideBend { angle: 0.4 },
        Action::RaiseArms(ArmRaise::Overhead),
        Action::Bow { angle: 0.9 },
        Action::RaiseArms(ArmRaise::Star),
        Action::Twist { angle: 0.9 },
        Action::RaiseArms(ArmRaise::Akimbo),
        Action::RaiseArms(ArmRaise::Wave(Side::Right)),
        Action::RaiseArms(ArmRaise::Wave(Side::Left)),
    ]
}

fn mixed() -> Vec<Action> {
    vec![
        idle(2.0),
        travel(1.2, 0.3, 4.0),
        travel(3.0, 0.0, 4.0),
        travel(1.4, -0.5, 4.0),
        Action::TurnOnSpot { angle: 1.2 },
        Action::Squat { depth: 0.3 },
        travel(1.5, -0.3, 4.0),
        Action::Jump { height: 0.2 },
        Action::RaiseArms(ArmRaise::Star),
        travel(3.6, 0.3, 5.0),
        Action::Twist { angle: 0.5 },
        travel(1.0, 0.6, 4.0),
        idle(2.0),
    ]
}

fn sprints() -> Vec<Action> {
    let stop = |seconds| Action::Stop { seconds };
    vec![
        travel(5.0, 0.0, 5.0),
        stop(1.4),
        idle(1.0),
        travel(5.5, 0.1, 5.5),
        stop(1.5),
        idle(1.0),
        travel(4.5, -0.2, 4.5),
        stop(1.3),
    ]
}

fn turns_on_spot() -> Vec<Action> {
    ([1.6, -1.6, 3.1, -3.1, 0.8, -2.4, 6.2].into_iter())
        .flat_map(|angle| [Action::TurnOnSpot { angle }, idle(0.6)])
        .collect()
}
