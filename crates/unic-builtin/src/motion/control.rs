//! Clips for interactive control: every speed, turn, start and stop that a player asks for.

use super::{
    PerformerError,
    action::Action,
    timeline::{Performer, Timeline},
};
use unic_core::{character::Character, clip::Clip};

/// Makes the clips for interactive control for a character at `fps` frames a second.
///
/// They are walks and runs in curves, sharp turns, starts and stops, turns on the spot, and walks in
/// all directions after a pointer. A motion database mirrors its clips, so most turns go to the left.
/// The same character, seed and rate give the same bytes.
///
/// # Errors
/// The same as [`Performer::new`].
pub fn control_set(character: &Character, seed: u64, fps: f32) -> Result<Vec<Clip>, PerformerError> {
    let performer = Performer::new(character)?;
    let clip = |(stream, (name, actions)): (u64, (String, Vec<Action>))| {
        // Each clip has its own stream of random numbers: changing one leaves the others alone.
        let seed = seed.wrapping_mul(1_000_003).wrapping_add(stream);
        let timeline = Timeline::new(seed).with_quick_steps().then_all(actions);
        timeline.perform(&performer).clip(&name, fps)
    };
    Ok((2001..).zip(plans()).map(clip).collect())
}

/// Number of walks after a pointer. Fewer leave transitions that jump.
const WANDERS: usize = 11;

/// Names and actions of the clips.
fn plans() -> Vec<(String, Vec<Action>)> {
    let wanders = (1..=WANDERS).map(|n| {
        (
            format!("control_wander_{n}"),
            vec![Action::Wander { seconds: 60.0 }],
        )
    });
    let named = [
        ("control_idle", vec![Action::Idle { seconds: 20.0 }]),
        ("control_speeds", speeds()),
        ("control_circles", circles()),
        ("control_slalom", slaloms()),
        ("control_turns", turns()),
        ("control_reversals", reversals()),
        ("control_starts_stops", starts_and_stops()),
        ("control_turning_starts", turning_starts()),
        ("control_turns_on_spot", turns_on_spot()),
        ("control_dashes", dashes()),
    ];
    (named
        .into_iter()
        .map(|(name, actions)| (name.to_owned(), actions)))
    .chain(wanders)
    .collect()
}

fn travel(speed: f32, turn_rate: f32, seconds: f32) -> Action {
    Action::Travel {
        speed,
        turn_rate,
        seconds,
    }
}

/// Speeds up and down, m/s.
fn speeds() -> Vec<Action> {
    let speeds = [
        0.5, 0.8, 1.1, 1.4, 1.7, 2.0, 2.6, 3.2, 2.0, 1.4, 0.9, 1.4, 2.0, 1.2, 1.4,
    ];
    speeds.map(|speed| travel(speed, 0.0, 3.5)).into()
}

/// Circles at several speeds (m/s) and turning rates (rad/s).
fn circles() -> Vec<Action> {
    let at = |speed: f32| [0.35, 0.7, 1.0, 1.4].map(|turn_rate| travel(speed, turn_rate, 4.5));
    [0.7, 1.1, 1.4, 1.8, 2.2].into_iter().flat_map(at).collect()
}

fn slaloms() -> Vec<Action> {
    let slalom = |speed, turn_rate, period| Action::Slalom {
        speed,
        turn_rate,
        period,
        seconds: 3.0 * period,
    };
    vec![
        slalom(1.4, 1.3, 4.0),
        slalom(1.4, 0.9, 3.0),
        slalom(1.0, 1.2, 4.0),
        slalom(1.9, 1.2, 4.0),
    ]
}

/// Sharp turns within a walk. The turning rate rises and falls within 0.8 s each, so the angle is
/// 0.8 s times the rate.
fn turns() -> Vec<Action> {
    let turn = |(speed, rate)| {
        [
            travel(speed, rate, 0.8),
            travel(speed, 0.0, 2.3),
            travel(1.4, 0.0, 0.6),
        ]
    };
    let rates = [1.0, 2.0, 2.0, 2.6, 2.0, 1.5];
    let speeds = [1.4, 1.4, 1.2, 1.2, 1.6, 1.8];
    std::iter::once(travel(1.4, 0.0, 2.5))
        .chain(speeds.into_iter().zip(rates).flat_map(turn))
        .chain(speeds.into_iter().zip(rates.into_iter().rev()).flat_map(turn))
        .collect()
}

/// Walks that turn back, with little speed at the turn.
fn reversals() -> Vec<Action> {
    let reversal =
        |(speed, seconds): (f32, f32)| [travel(speed, 3.2 / seconds, seconds), travel(1.4, 0.0, 2.2)];
    let kinds = [
        (0.6, 0.85),
        (0.3, 0.85),
        (0.8, 0.9),
        (0.4, 0.8),
        (0.6, 0.95),
        (0.2, 0.8),
    ];
    std::iter::once(travel(1.4, 0.0, 2.5))
        .chain(kinds.into_iter().chain(kinds).flat_map(reversal))
        .collect()
}

/// Starts and stops at several speeds. Different durations stop on either foot.
fn starts_and_stops() -> Vec<Action> {
    let speeds = [1.4, 1.4, 1.4, 1.4, 0.8, 1.0, 1.8, 2.0, 1.4, 0.6, 1.4, 2.6];
    let seconds = [2.0, 2.2, 2.4, 2.6, 2.3, 2.1, 2.2, 2.5, 1.2, 1.6, 1.5, 2.6];
    let brakes = [0.8, 0.9, 0.7, 0.8, 0.7, 0.7, 1.0, 1.0, 0.7, 0.6, 0.8, 1.3];
    let kinds = speeds.into_iter().zip(seconds).zip(brakes);
    let one = |((speed, seconds), brake)| {
        [
            travel(speed, 0.0, seconds),
            Action::Stop { seconds: brake },
            Action::Idle { seconds: 0.6 },
        ]
    };
    kinds.flat_map(one).collect()
}

/// Starts from a stand that turn away at once.
fn turning_starts() -> Vec<Action> {
    let start = |(speed, rate)| {
        [
            travel(speed, rate, 0.95),
            travel(1.4, 0.0, 1.6),
            Action::Stop { seconds: 0.8 },
            Action::Idle { seconds: 0.5 },
        ]
    };
    let kinds = [
        (1.2, 0.8),
        (1.2, 1.6),
        (0.9, 2.4),
        (0.7, 3.2),
        (1.4, 1.2),
        (1.0, 2.0),
        (0.8, 2.8),
    ];
    kinds.into_iter().chain(kinds).flat_map(start).collect()
}

/// Quick walks of 2 m/s that end slowly, as those to a mouse pointer, and turn away at once.
///
/// A change of speed takes 0.8 s or longer. Changes that overlap make a quicker one.
fn dashes() -> Vec<Action> {
    let dash = |(rate, brake): (f32, f32)| {
        [
            travel(0.8, rate, 0.3),
            travel(1.6, rate, 0.3),
            travel(2.0, 0.0, 1.3),
            travel(1.2, 0.0, 0.35),
            travel(0.6, 0.0, 0.35),
            travel(0.2, 0.0, brake),
        ]
    };
    let rates = [0.0, 1.0, 2.0, 3.0, 4.0, 4.8, 1.5, 2.5, 3.5, 4.4];
    let brakes = [0.4, 0.5, 0.6, 0.5, 0.4, 0.5, 0.6, 0.3, 0.5, 0.4];
    rates.into_iter().zip(brakes).flat_map(dash).collect()
}

fn turns_on_spot() -> Vec<Action> {
    ([0.5, 1.0, 1.6, 2.2, 3.1, 1.6].into_iter())
        .flat_map(|angle| [Action::TurnOnSpot { angle }, Action::Idle { seconds: 0.5 }])
        .collect()
}
