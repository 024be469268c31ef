//! Signals over time that follow from the steps.

use super::{
    curve::{Knot, Spline, Track},
    foot::{Foot, Swing},
    footsteps::Jump,
    gait::GRAVITY,
    path::GroundPath,
    script::Script,
};
use glam::DVec2;

/// Signals that follow from the steps.
#[derive(Clone, Debug)]
pub(super) struct Tracks {
    /// Distance of the left foot ahead of the right one, metres.
    pub(super) ahead: Track,
    /// Distance of the supporting feet to the left of the path, metres.
    pub(super) support: Track,
    /// Load of the legs: 1 on the left leg alone, −1 on the right one alone, 0 on both or none.
    pub(super) load: Track,
    /// Height of the pelvis joint without the vertical motion of `flight`, metres.
    pub(super) height: Track,
    /// Vertical motion of the pelvis around flight phases, metres.
    pub(super) flight: Spline,
}

impl Tracks {
    /// Samples the signals; `height` is zero until the caller has computed it from the others.
    pub(super) fn new(script: &Script, path: &GroundPath, feet: &[Foot; 2], flight: Spline) -> Self {
        let planted = |t: f64| [0, 1].map(|i| f64::from(u8::from(feet[i].is_planted(t))));
        // Positions of both feet relative to the body: x to the left, y ahead.
        let relative = |t: f64| {
            let ground_pose = path.at(&script.gestures, t);
            let place = |i: usize| feet[i].base(t).footprint.position - ground_pose.position;
            [0, 1].map(|i| {
                DVec2::new(
                    place(i).dot(ground_pose.left()),
                    place(i).dot(ground_pose.forward()),
                )
            })
        };
        let support = |t: f64| {
            let ([l, r], [left, right]) = (planted(t), relative(t));
            // In flight both weights are zero, and so is the support.
            (l * left.x + r * right.x) / (l + r).max(1.0)
        };
        let sample = |signal: &dyn Fn(f64) -> f64| Track::sample(script.seconds, signal);
        Self {
            ahead: sample(&|t| relative(t)[0].y - relative(t)[1].y).smoothed(0.1),
            // Support and load jump when a foot lifts or lands: smoothing makes them continuous.
            support: sample(&support).smoothed(0.3),
            load: sample(&|t| planted(t)[0] - planted(t)[1]).smoothed(0.16),
            height: sample(&|_| 0.0),
            flight,
        }
    }
}

/// Phase in which both feet are off the ground. Times are in seconds.
#[derive(Clone, Copy)]
struct Flight {
    takeoff: f64,
    landing: f64,
}

/// Vertical motion of the pelvis, metres.
///
/// It is ballistic while both feet are off the ground. Between flights, quintic curves absorb the
/// landing and push off again.
pub(super) fn flight_spline(feet: &[Foot; 2], script: &Script) -> Spline {
    let mut knots: Vec<Knot> = Vec::new();
    for Flight { takeoff, landing } in flights(feet) {
        // Takeoffs of jumps are copied from the script, so that they agree up to rounding.
        let jump = script.jumps.iter().find(|j| (j.takeoff - takeoff).abs() < 1e-6);
        let rest_before = knots.last().map(|k| k.time);
        let since = rest_before.map_or(f64::INFINITY, |t| takeoff - t);
        // In a run, flights follow one another without a rest; this one comes after a rest.
        if jump.is_some() || since > 0.55 {
            if let Some(landed) = rest_before {
                knots.push(Knot::rest(landed + 0.45 * since.min(1.0), 0.0));
            }
            knots.extend(preparation(takeoff, jump));
        }
        // A jump takes off from stretched legs and toes, above the standing height.
        let takeoff_height = jump.map_or(0.0, |_| 0.06);
        knots.extend(ballistic(takeoff, landing, takeoff_height));
        if let Some(jump) = jump {
            knots.push(Knot::rest(landing + 0.24, -0.8 * jump.crouch));
        }
    }
    if let Some(last) = knots.last().copied() {
        knots.push(Knot::rest(last.time + 0.6, 0.0));
    }
    Spline { knots }
}

/// Knots before a takeoff: a deep crouch before a jump.
fn preparation(takeoff: f64, jump: Option<&Jump>) -> Vec<Knot> {
    match jump {
        None => vec![Knot::rest(takeoff - 0.3, 0.0)],
        Some(jump) => vec![
            Knot::rest(takeoff - 0.95, 0.0),
            Knot::rest(takeoff - 0.34, -jump.crouch),
        ],
    }
}

/// Knots of a free fall that begins and ends at the height `value`, metres.
fn ballistic(takeoff: f64, landing: f64, value: f64) -> [Knot; 2] {
    // A quintic with these values, velocities and accelerations at both ends is the parabola
    // itself.
    let velocity = 0.5 * GRAVITY * (landing - takeoff);
    [(takeoff, velocity), (landing, -velocity)].map(|(time, velocity)| Knot {
        time,
        value,
        velocity,
        acceleration: -GRAVITY,
    })
}

/// Flight phases, by time: the overlaps of swings of both feet.
fn flights(feet: &[Foot; 2]) -> Vec<Flight> {
    let [left, right] = feet;
    let overlap = |a: &Swing, b: &Swing| Flight {
        takeoff: a.lift.max(b.lift),
        landing: a.land.min(b.land),
    };
    let mut both: Vec<Flight> = (left.swings.iter())
        .flat_map(|a| right.swings.iter().map(move |b| overlap(a, b)))
        // Swings that do not overlap give a negative duration; below a millisecond it is no flight.
        .filter(|flight| flight.landing - flight.takeoff > 1e-3)
        .collect();
    both.sort_by(|a, b| a.takeoff.total_cmp(&b.takeoff));
    both
}
