//! A set of clips that covers what people do, to train on, and kinds of their own to test on.

use super::{
    MotionError,
    action::{Action, ArmRaise},
    channel::Side,
    timeline::{Performer, Timeline},
};
use unic_core::{character::Character, clip::Clip};

/// Clips by their use.
#[derive(Clone, Debug, PartialEq)]
pub struct StandardSet {
    /// About seven minutes.
    pub train: Vec<Clip>,
    /// Kinds of motion that `train` does not hold: a sprint with a hard stop, turns on the spot, a
    /// dance.
    pub test: Vec<Clip>,
}

/// The standard clips for a character at `fps` frames a second. The same seed gives the same bytes.
///
/// # Errors
/// As [`Performer::new`].
pub fn standard_set(character: &Character, seed: u64, fps: f32) -> Result<StandardSet, MotionError> {
    let performer = Performer::new(character)?;
    let clips = |named: Vec<(&str, Vec<Action>)>, stream: u64| {
        (named.into_iter().zip(stream..))
            .map(|((name, actions), i)| {
                let seed = seed.wrapping_mul(1_000_003).wrapping_add(i);
                Timeline::new(seed)
                    .then_all(actions)
                    .perform(&performer)
                    .clip(name, fps)
            })
            .collect()
    };
    Ok(StandardSet {
        train: clips(train(), 1),
        test: clips(test(), 1001),
    })
}

fn go(speed: f32, turn_rate: f32, seconds: f32) -> Action {
    Action::Travel {
        speed,
        turn_rate,
        seconds,
    }
}

fn idle(seconds: f32) -> Action {
    Action::Idle { seconds }
}

fn slalom([speed, turn_rate, period, seconds]: [f32; 4]) -> Action {
    Action::Slalom {
        speed,
        turn_rate,
        period,
        seconds,
    }
}

fn train() -> Vec<(&'static str, Vec<Action>)> {
    vec![
        ("idle", vec![idle(36.0)]),
        (
            "walk_speeds",
            [0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 1.3]
                .map(|v| go(v, 0.0, 5.5))
                .into(),
        ),
        ("walk_circles", circles([1.2, 0.9, 1.5], 0.55)),
        (
            "walk_slalom",
            vec![slalom([1.3, 0.7, 5.0, 20.0]), slalom([1.0, 0.9, 4.0, 14.0])],
        ),
        ("walk_starts_stops", starts_and_stops([1.0, 1.4, 0.8, 1.7, 1.2])),
        (
            "run_speeds",
            [2.5, 3.0, 3.6, 4.3, 5.0, 3.2].map(|v| go(v, 0.0, 5.0)).into(),
        ),
        ("run_circles", circles([2.6, 3.2, 3.8], 0.45)),
        (
            "run_slalom",
            vec![slalom([2.7, 0.6, 4.5, 16.0]), slalom([3.4, 0.45, 4.0, 12.0])],
        ),
        ("run_starts_stops", starts_and_stops([2.6, 3.2, 2.8, 3.8, 3.0])),
        ("squats_jumps", squats_and_jumps()),
        ("arms_trunk", arms_and_trunk()),
        ("mixed", mixed()),
    ]
}

fn test() -> Vec<(&'static str, Vec<Action>)> {
    vec![
        ("sprint_stop", sprints()),
        ("turn_on_spot", turns_on_spot()),
        (
            "dance",
            vec![Action::Dance {
                seconds: 30.0,
                beats_per_minute: 108.0,
            }],
        ),
    ]
}

/// Each speed (m/s) to the left and to the right.
fn circles(speeds: [f32; 3], turn_rate: f32) -> Vec<Action> {
    (speeds.into_iter())
        .flat_map(|v| [go(v, turn_rate, 6.5), go(v, -turn_rate, 6.5)])
        .collect()
}

fn starts_and_stops(speeds: [f32; 5]) -> Vec<Action> {
    (speeds.into_iter().zip([0.0, 0.4, -0.4, 0.0, -0.3]))
        .flat_map(|(speed, turn_rate)| [go(speed, turn_rate, 3.8), idle(1.2)])
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
        go(1.2, 0.3, 4.0),
        go(3.0, 0.0, 4.0),
        go(1.4, -0.5, 4.0),
        Action::TurnOnSpot { angle: 1.2 },
        Action::Squat { depth: 0.3 },
        go(1.5, -0.3, 4.0),
        Action::Jump { height: 0.2 },
        Action::RaiseArms(ArmRaise::Star),
        go(3.6, 0.3, 5.0),
        Action::Twist { angle: 0.5 },
        go(1.0, 0.6, 4.0),
        idle(2.0),
    ]
}

fn sprints() -> Vec<Action> {
    let stop = |seconds| Action::Stop { seconds };
    vec![
        go(5.0, 0.0, 5.0),
        stop(1.4),
        idle(1.0),
        go(5.5, 0.1, 5.5),
        stop(1.5),
        idle(1.0),
        go(4.5, -0.2, 4.5),
        stop(1.3),
    ]
}

fn turns_on_spot() -> Vec<Action> {
    ([1.6, -1.6, 3.1, -3.1, 0.8, -2.4, 6.2].into_iter())
        .flat_map(|angle| [Action::TurnOnSpot { angle }, idle(0.6)])
        .collect()
}
