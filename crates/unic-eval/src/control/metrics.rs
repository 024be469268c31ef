//! Metrics of one run.

use super::{
    reference::{DataReference, Skating, velocity_jump},
    run::{ControlRun, Tick},
};
use glam::{Vec2, Vec3};
use serde::Serialize;
use unic_core::motion_matching::{Clamping, Database, Facing, SearchOutcome, wrapped};

/// Share of a change that counts as made.
const MADE: f32 = 0.9;
/// Share of a change that counts as begun.
const BEGUN: f32 = 0.25;
/// Change of the velocity within a tick that is an input step, m/s.
const STEP_M_S: f32 = 0.5;
/// Change of the direction asked for within a tick that is an input step, radians.
const STEP_RAD: f32 = 0.5;
/// Ticks after a switch that belong to it: the velocity takes a tick to show.
const SWITCH_TICKS: usize = 2;

/// Metrics of one run. The JSON form is a public contract.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ControlMetrics {
    /// Root mean square distance of the shown root from the simulated object, metres.
    pub trajectory_error_m: f64,
    /// Root mean square difference of their directions, degrees.
    pub heading_error_deg: f64,
    /// Mean time from an input step until the shown root has made 90 % of the change to the command
    /// of that time, seconds; none without an input step. Steps: `docs/reference/json.md`.
    pub response_s: Option<f64>,
    /// Foot skating by that of the captured motion.
    pub foot_skating_ratio: f64,
    /// Largest velocity jump of any joint at a switch by the 99th percentile of the captured
    /// motion's.
    pub transition_ratio: f64,
    /// Longest time from an input step until a quarter of the change is made, seconds.
    pub stuck_s: f64,
    /// Frames in which the root was clamped to the object, percent.
    pub clamped_percent: f64,
    /// Distance by which the root's position was adjusted towards the object, metres. Turns and
    /// clamped distances do not count.
    pub adjusted_m: f64,
    /// Mean horizontal speed of locked toes, m/s.
    pub locked_foot_m_s: f64,
}

impl ControlMetrics {
    /// Measures a run.
    pub fn measure(run: &ControlRun, database: &Database, reference: &DataReference) -> Self {
        let ticks = &run.ticks;
        let distance = |t: &Tick| f64::from(t.root.position.distance(t.object.position));
        let turn = |t: &Tick| f64::from(wrapped(t.root.yaw - t.object.yaw)).to_degrees();
        let steps = StepTimes::measure(run);
        let is_clamped = |t: &&Tick| t.report.clamping == Clamping::Clamped;
        Self {
            trajectory_error_m: root_mean_square(ticks.iter().map(distance)),
            heading_error_deg: root_mean_square(ticks.iter().map(turn)),
            response_s: steps.mean_response(),
            foot_skating_ratio: skating(run, database) / reference.skating_m_s,
            transition_ratio: largest_jump(run) / reference.jump_m_s,
            stuck_s: steps.longest_start(),
            clamped_percent: 100.0 * ticks.iter().filter(is_clamped).count() as f64 / ticks.len() as f64,
            adjusted_m: ticks.iter().map(|t| f64::from(t.report.adjusted_m)).sum(),
            locked_foot_m_s: locked_speed(run, database),
        }
    }
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|x| x * x).sum::<f64>() / count).sqrt()
}

fn skating(run: &ControlRun, database: &Database) -> f64 {
    let mut skating = Skating::default();
    for pair in run.ticks.windows(2) {
        skating.add(database, &pair[0].joints, &pair[1].joints);
    }
    skating.mean()
}

/// Largest velocity jump of any joint within two ticks of a switch, m/s.
fn largest_jump(run: &ControlRun) -> f64 {
    let joints: Vec<&[Vec3]> = run.ticks.iter().map(|t| t.joints.as_slice()).collect();
    let mut largest = 0.0f32;
    for (t, tick) in run.ticks.iter().enumerate().skip(2) {
        if tick.report.search == SearchOutcome::Switched {
            for t in t..(t + SWITCH_TICKS).min(joints.len()) {
                largest = largest.max(velocity_jump(&joints[t - 2..=t], run.fps));
            }
        }
    }
    f64::from(largest)
}

/// Mean horizontal speed of toes that are locked in two successive ticks, m/s.
fn locked_speed(run: &ControlRun, database: &Database) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for pair in run.ticks.windows(2) {
        for (side, leg) in database.settings().legs.iter().enumerate() {
            if pair[0].locked[side] && pair[1].locked[side] {
                let way = (pair[1].joints[leg.toe] - pair[0].joints[leg.toe]) * Vec3::new(1.0, 0.0, 1.0);
                sum += f64::from(way.length() * run.fps);
                count += 1;
            }
        }
    }
    sum / f64::from(count.max(1))
}

/// Times that the character takes to follow input steps, seconds.
#[derive(Debug, Default)]
struct StepTimes {
    responses: Vec<f64>,
    starts: Vec<f64>,
}

/// Change that an input step asks for.
#[derive(Clone, Copy)]
enum Change {
    /// Velocity of the root before the step, m/s.
    Velocity(Vec2),
    /// Yaw of the root before the step, radians.
    Yaw(f32),
}

impl StepTimes {
    fn measure(run: &ControlRun) -> Self {
        let mut times = Self::default();
        let steps = input_steps(run);
        let ends = steps.iter().skip(1).map(|step| step.0).chain([run.ticks.len()]);
        for (&(at, change), end) in steps.iter().zip(ends) {
            let time_to = |share: f32| {
                let done = (at..end).find(|&t| progress(run, t, change) >= share);
                // A change that is never made counts until the next step.
                (done.unwrap_or(end) - at + 1) as f64 / f64::from(run.fps)
            };
            times.responses.push(time_to(MADE));
            times.starts.push(time_to(BEGUN));
        }
        times
    }

    fn mean_response(&self) -> Option<f64> {
        let count = self.responses.len();
        (count > 0).then(|| self.responses.iter().sum::<f64>() / count as f64)
    }

    fn longest_start(&self) -> f64 {
        self.starts.iter().copied().fold(0.0, f64::max)
    }
}

/// Lists the ticks in which the command jumps, with the state of the root before them.
fn input_steps(run: &ControlRun) -> Vec<(usize, Change)> {
    let yaw = |facing: Facing| match facing {
        Facing::Yaw(yaw) => Some(yaw),
        Facing::Travel => None,
    };
    let step = |t: usize| {
        let (before, after) = (run.ticks[t - 1].command, run.ticks[t].command);
        if after.velocity.distance(before.velocity) > STEP_M_S {
            return Some((t, Change::Velocity(root_velocity(run, t - 1))));
        }
        let turn = wrapped(yaw(after.facing)? - yaw(before.facing)?);
        (turn.abs() > STEP_RAD).then_some((t, Change::Yaw(run.ticks[t - 1].root.yaw)))
    };
    let mut steps: Vec<(usize, Change)> = Vec::new();
    for found in (2..run.ticks.len()).filter_map(step) {
        // A blended target takes a few ticks to jump: that is one step.
        let is_new = steps.last().is_none_or(|last| found.0 > last.0 + 3);
        if is_new {
            steps.push(found);
        }
    }
    steps
}

/// Velocity of the shown root in a tick, m/s.
fn root_velocity(run: &ControlRun, t: usize) -> Vec2 {
    let before = t.saturating_sub(1);
    (run.ticks[t].root.position - run.ticks[before].root.position) * run.fps
}

/// Share of the change to the present command that the root has made.
fn progress(run: &ControlRun, t: usize, change: Change) -> f32 {
    let tick = &run.ticks[t];
    match change {
        Change::Velocity(start) => {
            let asked = tick.command.velocity - start;
            let made = root_velocity(run, t) - start;
            // A change that is no longer asked for is made.
            match asked.length() < 0.5 * STEP_M_S {
                true => 1.0,
                false => made.dot(asked) / asked.length_squared(),
            }
        }
        Change::Yaw(start) => {
            let goal = match tick.command.facing {
                Facing::Yaw(yaw) => yaw,
                Facing::Travel => return 1.0,
            };
            1.0 - wrapped(goal - tick.root.yaw).abs() / wrapped(goal - start).abs().max(1e-3)
        }
    }
}
