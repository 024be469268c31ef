//! Contract: a replay follows the motion that it knows, freezes with a still body, never jumps,
//! stays within its bounds for any motion, and finds what a naive search finds.

use super::{
    key::{KEY_STEPS, distance},
    search::Found,
    *,
};
use crate::network::Linear;

const DT: f32 = 1.0 / 30.0;
const LEN: usize = 20;
const FRAMES: usize = 90;

/// Map that reads the first features of a motion vector.
fn keys() -> KeyMap {
    let weight = |(o, i): (usize, usize)| if o == i { 1.0 } else { 0.0 };
    let features = Linear {
        inputs: LEN,
        outputs: FEATURES,
        weight: (0..FEATURES)
            .flat_map(|o| (0..LEN).map(move |i| (o, i)))
            .map(weight)
            .collect(),
        bias: vec![0.0; FEATURES],
    };
    KeyMap::new(features).unwrap()
}

/// Motion vector of a smooth motion that differs from clip to clip.
fn motion(clip: usize, t: f32) -> Vec<f32> {
    let wave = |i: usize| ((0.05 + 0.013 * i as f32) * t + (clip * 7 + i) as f32).sin() * 2.0;
    (0..LEN).map(wave).collect()
}

fn pair(clip: usize, t: usize) -> Vec<f32> {
    [motion(clip, t.saturating_sub(1) as f32), motion(clip, t as f32)].concat()
}

/// Library of three clips with slowly varying residuals of two coefficients.
fn replay() -> Replay {
    let map = keys();
    let mut found = Vec::new();
    let mut residuals = Vec::new();
    for clip in 0..3 {
        let mut activity = Activity::default();
        for t in 0..FRAMES {
            let pair = pair(clip, t);
            activity.follow(&pair, DT);
            found.push(map.key(&pair, activity));
            let wave = |hz: f32| (100.0 * (hz * t as f32 * DT + clip as f32).sin()) as i8;
            residuals.extend([wave(2.0), wave(1.0)]);
        }
    }
    let library = Library::new(vec![FRAMES as u32; 3], found, residuals, vec![1e-4, 2e-4]).unwrap();
    Replay::new(map, library)
}

fn residual(replay: &Replay, state: &ReplayState) -> [f32; 2] {
    let mut out = [0.0; 2];
    replay.add_to(state, &mut out);
    out
}

/// Residuals of a run through motion vectors, after each tick.
fn run(replay: &Replay, vectors: &[Vec<f32>]) -> Vec<[f32; 2]> {
    let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
    replay.begin(&vectors[..2].concat(), DT, &mut state);
    let ticks = vectors.windows(2);
    ticks
        .map(|w| {
            replay.advance(&w.concat(), DT, &mut state, &mut scratch);
            replay.check(&state).unwrap();
            residual(replay, &state)
        })
        .collect()
}

#[test]
fn a_known_motion_gets_its_own_residuals_from_the_start() {
    let replay = replay();
    let first = 20;
    let vectors: Vec<_> = (first..FRAMES).map(|t| motion(1, t as f32)).collect();
    let found = run(&replay, &vectors);
    // The first tick has the residual of its own frame: a frame of the library differs from the next
    // one by 0.4 mm or more there.
    let mut truth = [0.0; 2];
    replay
        .library
        .add_between((FRAMES + first + 1) as u32, 0.0, &mut truth);
    let gap = (found[0][0] - truth[0]).hypot(found[0][1] - truth[1]);
    assert!(gap < 2e-4, "{:?} of {truth:?}", found[0]);
    for (t, found) in found.iter().enumerate().take(50) {
        let mut truth = [0.0; 2];
        replay
            .library
            .add_between((FRAMES + first + t + 1) as u32, 0.0, &mut truth);
        let gap = (found[0] - truth[0]).abs().max((found[1] - truth[1]).abs());
        assert!(gap < 3e-3, "frame {t}: {:?} of {truth:?}", found);
    }
}

#[test]
fn residuals_are_those_of_the_last_coefficients() {
    let replay = replay();
    let mut state = replay.start();
    replay.begin(&pair(1, 20), DT, &mut state);
    let found = residual(&replay, &state);
    let mut coefficients = [1.0, 2.0, 0.0, 0.0];
    replay.add_to(&state, &mut coefficients);
    assert_eq!(coefficients, [1.0, 2.0, found[0], found[1]]);
    assert!(found[0] != 0.0);
}

#[test]
fn a_scaled_replay_plays_the_same_frames_larger() {
    let play = |replay: &Replay| {
        let (mut state, mut scratch) = (replay.start(), ReplayScratch::default());
        replay.begin(&pair(1, 1), DT, &mut state);
        // Beyond a switch, which leaves an offset.
        for t in 1..2 * FRAMES {
            replay.advance(&pair(t / FRAMES, t), DT, &mut state, &mut scratch);
        }
        (state.stretch, residual(replay, &state))
    };
    let (stretch, expected) = play(&replay());
    let (found, scaled) = play(&replay().scaled(2.0).unwrap());
    assert_eq!(found, stretch);
    assert_eq!(scaled, expected.map(|x| 2.0 * x));
    for factor in [-1.0, f32::NAN, f32::INFINITY] {
        assert!(replay().scaled(factor).is_err(), "{factor}");
    }
}

#[test]
fn a_still_body_has_a_still_residual() {
    let replay = replay();
    let mut vectors: Vec<_> = (0..60).map(|t| motion(0, t as f32)).collect();
    let last = vectors[59].clone();
    vectors.extend(std::iter::repeat_n(last, 300));
    let found = run(&replay, &vectors);
    // The smoothed activity takes a second to end.
    let gap = |k: usize| (found[100][k] - found[350][k]).abs();
    assert!(
        gap(0) < 1e-5 && gap(1) < 1e-5,
        "{:?} {:?}",
        found[100],
        found[350]
    );
    assert!(found[100][1].abs() > 1e-4, "{:?}", found[100]);
}

#[test]
fn residuals_never_jump() {
    let replay = replay();
    // Motions of all clips in turn, half a second each, force switches.
    let vectors: Vec<_> = (0..900)
        .map(|t| motion((t / 45) % 3, (7 * t % 80) as f32 / 2.0 + t as f32))
        .collect();
    let found = run(&replay, &vectors);
    let mut before = found[0];
    for (t, now) in found.iter().enumerate() {
        // A frame of the library changes by at most 1.3 mm and is played at 1.25 times the speed;
        // the offset, of up to 60 mm, fades by at most 3 % of itself.
        let step = (now[0] - before[0]).hypot(now[1] - before[1]);
        assert!(step < 4e-3, "frame {t}: {step} m");
        before = *now;
    }
}

#[test]
fn residuals_are_bounded_for_any_motion() {
    let replay = replay();
    // White noise, which no capture contains.
    let noise = |t: usize, i: usize| 5.0 * ((t * 7919 + i * 104_729) as f32).sin();
    let vectors: Vec<Vec<f32>> = (0..5000)
        .map(|t| (0..LEN).map(|i| noise(t, i)).collect())
        .collect();
    let bound = (1.0 + LONGEST_OFFSET) * replay.library.longest();
    assert!(run(&replay, &vectors).iter().all(|x| x[0].hypot(x[1]) <= bound));
}

#[test]
fn the_search_finds_the_first_of_the_best_frames() {
    let replay = replay();
    let library = &replay.library;
    for (clip, t) in [(0, 12), (1, 40), (2, 3), (0, 88)] {
        let pair = pair(clip, t);
        let (key, residual) = (replay.keys.key(&pair, Activity::default()), [3e-3, -1e-3]);
        let cost = |frame: u32| {
            let gap: f32 = library
                .residual(frame)
                .zip(residual)
                .map(|(a, b)| (a - b).powi(2))
                .sum();
            let unit = KEY_STEPS * KEY_STEPS / library.mean_square();
            distance(&key, library.key(frame)) as f32 + unit * gap
        };
        let mut naive: Option<Found> = None;
        for frame in (0..library.len() as u32).filter(|f| library.remaining(*f) >= 30) {
            let cost = cost(frame);
            if naive.is_none_or(|best| cost < best.cost) {
                naive = Some(Found { frame, cost });
            }
        }
        assert_eq!(library.best(&key, &residual, 30), naive);
    }
    // All frames alike.
    let alike = Library::new(vec![50], vec![[1; KEY]; 50], vec![0; 50], vec![0.0]).unwrap();
    assert_eq!(alike.best(&[1; KEY], &[0.0], 30).unwrap().frame, 0);
    assert_eq!(alike.best(&[1; KEY], &[0.0], 50), None);
}

#[test]
fn a_saved_state_continues_with_the_same_bytes() {
    let replay = replay();
    let tick = |state: &mut ReplayState, t: usize| {
        replay.advance(&pair(2, t), DT, state, &mut ReplayScratch::default());
    };
    let mut state = replay.start();
    replay.begin(&pair(2, 1), DT, &mut state);
    (1..40).for_each(|t| tick(&mut state, t));
    let mut restored: ReplayState = serde_json::from_str(&serde_json::to_string(&state).unwrap()).unwrap();
    for t in 40..80 {
        tick(&mut state, t);
        tick(&mut restored, t);
        assert_eq!(residual(&replay, &state), residual(&replay, &restored));
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let new = |clips: &[u32], keys: usize, residuals: usize, scale: f32| {
        Library::new(
            clips.to_vec(),
            vec![[0; KEY]; keys],
            vec![0; residuals],
            vec![scale; 2],
        )
        .map(|_| ())
    };
    assert_eq!(new(&[3, 2], 5, 10, 1.0), Ok(()));
    assert_eq!(new(&[], 0, 0, 1.0), Err(ReplayError::Size { found: 0 }));
    assert!(matches!(
        new(&[u32::MAX, 2], 5, 10, 1.0),
        Err(ReplayError::Size { .. })
    ));
    let frames = |found| Err(ReplayError::Frames { expected: 5, found });
    assert_eq!(new(&[3, 2], 4, 10, 1.0), frames(4));
    assert_eq!(new(&[3, 2], 5, 8, 1.0), frames(4));
    assert!(matches!(new(&[3, 2], 5, 11, 1.0), Err(ReplayError::Unusable(_))));
    assert!(matches!(
        new(&[3, 2], 5, 10, f32::NAN),
        Err(ReplayError::Unusable(_))
    ));
    assert!(matches!(
        Library::new(vec![1], vec![[0; KEY]], vec![127, 0], vec![f32::MAX; 2]),
        Err(ReplayError::Unusable(_))
    ));
    let replay = replay();
    let text = serde_json::to_string(&replay.start()).unwrap();
    let shrinking = text.replacen("\"activity\":0.0", "\"activity\":-1e30", 1);
    assert_ne!(shrinking, text);
    assert!(replay.check(&serde_json::from_str(&shrinking).unwrap()).is_err());
    let mut state = replay.start();
    state.offset.pop();
    let expected = ReplayError::Coefficients {
        expected: 2,
        found: 1,
    };
    assert_eq!(replay.check(&state), Err(expected));
    let mut state = replay.start();
    state.stretch = Some(Stretch {
        frame: 3 * FRAMES as u32,
        fraction: 0.0,
        held: 0,
    });
    assert!(replay.check(&state).is_err());
}
