//! Signals over time that follow from the steps.

use super::{
    curve::{Knot, Spline, Track},
    foot::Foot,
    footsteps::Jump,
    gait::GRAVITY,
    path::Path,
    script::Script,
};

/// Signals that follow from the steps.
#[derive(Clone, Debug)]
pub(super) struct Tracks {
    /// Left foot ahead of the right one, metres.
    pub(super) ahead: Track,
    /// Support to the left of the path, metres.
    pub(super) support: Track,
    /// Left leg loaded minus right leg loaded, −1 to 1.
    pub(super) load: Track,
    /// Height of the pelvis joint without the share of flight, metres.
    pub(super) height: Track,
    /// Vertical motion about flights, metres.
    pub(super) flight: Spline,
}

impl Tracks {
    pub(super) fn new(script: &Script, path: &Path, feet: &[Foot; 2], flight: Spline) -> Self {
        let planted = |t: f64| [0, 1].map(|i| f64::from(u8::from(feet[i].is_planted(t))));
        let relative = |t: f64| {
            let station = path.at(&script.gestures, t);
            let place = |i: usize| feet[i].base(t).0.position - station.position;
            [0, 1].map(|i| (place(i).dot(station.left()), place(i).dot(station.forward())))
        };
        let support = |t: f64| {
            let ([l, r], [(left, _), (right, _)]) = (planted(t), relative(t));
            (l * left + r * right) / (l + r).max(1.0)
        };
        let sample = |signal: &dyn Fn(f64) -> f64| Track::sample(script.seconds, signal);
        Self {
            ahead: sample(&|t| relative(t)[0].1 - relative(t)[1].1).smoothed(0.1),
            support: sample(&support).smoothed(0.3),
            load: sample(&|t| planted(t)[0] - planted(t)[1]).smoothed(0.16),
            height: sample(&|_| 0.0),
            flight,
        }
    }
}

/// Knots of the pelvis's vertical motion: ballistic while both feet are off the ground, a quintic
/// that takes up the landing and pushes off again between.
pub(super) fn flight(feet: &[Foot; 2], script: &Script) -> Spline {
    let mut knots: Vec<Knot> = Vec::new();
    for (takeoff, landing) in flights(feet) {
        let jump = script.jumps.iter().find(|j| (j.takeoff - takeoff).abs() < 1e-6);
        let rest_before = knots.last().map(|k| k.time);
        let since = rest_before.map_or(f64::INFINITY, |t| takeoff - t);
        if jump.is_some() || since > 0.55 {
            if let Some(landed) = rest_before {
                knots.push(Knot::rest(landed + 0.45 * since.min(1.0), 0.0));
            }
            knots.extend(preparation(takeoff, jump));
        }
        let tall = jump.map_or(0.0, |_| 0.06);
        knots.extend(ballistic(takeoff, landing, tall));
        if let Some(jump) = jump {
            knots.push(Knot::rest(landing + 0.24, -0.8 * jump.crouch));
        }
    }
    if let Some(last) = knots.last().copied() {
        knots.push(Knot::rest(last.time + 0.6, 0.0));
    }
    Spline { knots }
}

fn preparation(takeoff: f64, jump: Option<&Jump>) -> Vec<Knot> {
    match jump {
        None => vec![Knot::rest(takeoff - 0.3, 0.0)],
        Some(jump) => vec![
            Knot::rest(takeoff - 0.95, 0.0),
            Knot::rest(takeoff - 0.34, -jump.crouch),
        ],
    }
}

fn ballistic(takeoff: f64, landing: f64, value: f64) -> [Knot; 2] {
    let velocity = 0.5 * GRAVITY * (landing - takeoff);
    [(takeoff, velocity), (landing, -velocity)].map(|(time, velocity)| Knot {
        time,
        value,
        velocity,
        acceleration: -GRAVITY,
    })
}

/// Intervals without a foot on the ground, by time.
fn flights(feet: &[Foot; 2]) -> Vec<(f64, f64)> {
    let of = |foot: &Foot| foot.swings.iter().map(|s| (s.lift, s.land)).collect::<Vec<_>>();
    let [left, right] = [of(&feet[0]), of(&feet[1])];
    let mut both: Vec<(f64, f64)> = left
        .iter()
        .flat_map(|a| right.iter().map(move |b| (a.0.max(b.0), a.1.min(b.1))))
        .filter(|(takeoff, landing)| landing - takeoff > 1e-3)
        .collect();
    both.sort_by(|a, b| a.0.total_cmp(&b.0));
    both
}
