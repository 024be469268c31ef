//! What a motion does, in terms that people use.

use super::report::Excess;
use crate::kinematics::ClipKinematics;
use glam::Vec3;
use serde::Serialize;
use std::ops::Range;
use unic_core::{clip::Clip, motion::MotionSlices, skeleton::Skeleton};

/// Unit of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub enum Unit {
    /// Metres.
    #[serde(rename = "m")]
    Metres,
    /// Metres a second.
    #[serde(rename = "m/s")]
    MetresPerSecond,
    /// Degrees.
    #[serde(rename = "°")]
    Degrees,
    /// Degrees a second.
    #[serde(rename = "°/s")]
    DegreesPerSecond,
}

impl Unit {
    /// How far a value may be outside before it is worth a word.
    fn margin(self) -> f32 {
        match self {
            Unit::Metres => 0.03,
            Unit::MetresPerSecond => 0.15,
            Unit::Degrees => 7.0,
            Unit::DegreesPerSecond => 60.0,
        }
    }

    pub(super) fn symbol(self) -> &'static str {
        match self {
            Unit::Metres => "m",
            Unit::MetresPerSecond => "m/s",
            Unit::Degrees => "°",
            Unit::DegreesPerSecond => "°/s",
        }
    }

    pub(super) fn digits(self) -> usize {
        match self {
            Unit::Metres | Unit::MetresPerSecond => 2,
            Unit::Degrees | Unit::DegreesPerSecond => 0,
        }
    }
}

/// A kind of movement; a frame may be of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Standing,
    TurningOnTheSpot,
    Walking,
    Running,
    Sideways,
    Backwards,
    Crouching,
    InTheAir,
    Lying,
}

impl Kind {
    pub(super) const COUNT: usize = 9;
    pub(super) const ALL: [Kind; Self::COUNT] = [
        Kind::Standing,
        Kind::TurningOnTheSpot,
        Kind::Walking,
        Kind::Running,
        Kind::Sideways,
        Kind::Backwards,
        Kind::Crouching,
        Kind::InTheAir,
        Kind::Lying,
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Kind::Standing => "standing",
            Kind::TurningOnTheSpot => "turning on the spot",
            Kind::Walking => "walking",
            Kind::Running => "running",
            Kind::Sideways => "moving sideways",
            Kind::Backwards => "moving backwards",
            Kind::Crouching => "crouching",
            Kind::InTheAir => "both feet off the ground",
            Kind::Lying => "lying or upside down",
        }
    }
}

/// Slower is standing, faster is running, m/s.
const STANDING: f32 = 0.3;
const RUNNING: f32 = 2.0;
/// Faster is a turn, degrees a second.
const TURNING: f32 = 45.0;
/// Lower than this share of the bind pose's height is crouching.
const CROUCHING: f32 = 0.8;
/// Further from the vertical is lying, degrees.
const LYING: f32 = 60.0;

/// The first quantities of every character; joints follow.
const WHOLE: [(&str, Unit); 7] = [
    ("speed", Unit::MetresPerSecond),
    ("speed forwards", Unit::MetresPerSecond),
    ("speed to the left", Unit::MetresPerSecond),
    ("vertical speed", Unit::MetresPerSecond),
    ("turning rate to the left", Unit::DegreesPerSecond),
    ("height of the pelvis", Unit::Metres),
    ("lean of the pelvis", Unit::Degrees),
];
const SPEED: usize = 0;
const FORWARDS: usize = 1;
const LEFT: usize = 2;
const VERTICAL: usize = 3;
const TURN: usize = 4;
const HEIGHT: usize = 5;
const LEAN: usize = 6;

/// Names and units of what is measured.
#[derive(Clone, Debug)]
pub(super) struct Quantities {
    pub(super) names: Vec<(String, Unit)>,
    slices: MotionSlices,
    joints: Vec<usize>,
    /// Shoulder and elbow, left and right.
    arms: Vec<[usize; 2]>,
    /// Height of the root in the bind pose above the lowest joint.
    standing_height: f32,
}

impl Quantities {
    pub(super) fn of(skeleton: &Skeleton) -> Self {
        let root = skeleton.root();
        let joints: Vec<usize> = (0..skeleton.len()).filter(|&j| j != root).collect();
        let whole = WHOLE.iter().map(|(name, unit)| ((*name).to_owned(), *unit));
        let mut names: Vec<(String, Unit)> = whole.collect();
        for &joint in &joints {
            let name = spoken(&skeleton.names()[joint]);
            names.push((format!("bend of the {name}"), Unit::Degrees));
            names.push((format!("speed of the {name}"), Unit::DegreesPerSecond));
        }
        let mut arms = Vec::new();
        for (side, name) in [("L", "left"), ("R", "right")] {
            let joint = |part: &str| skeleton.joint(&format!("{side}_{part}"));
            if let (Some(shoulder), Some(elbow)) = (joint("shoulder"), joint("elbow")) {
                arms.push([shoulder, elbow]);
                names.push((format!("raise of the {name} arm"), Unit::Degrees));
            }
        }
        let lowest = skeleton
            .joints()
            .iter()
            .map(|j| j.y)
            .fold(f32::INFINITY, f32::min);
        Self {
            names,
            slices: MotionSlices::new(skeleton.len()),
            joints,
            arms,
            standing_height: skeleton.joints()[root].y - lowest,
        }
    }

    /// One number a quantity.
    pub(super) fn values(
        &self,
        skeleton: &Skeleton,
        clip: &Clip,
        kinematics: &ClipKinematics,
        frame: usize,
    ) -> Vec<f32> {
        let c = kinematics.motion(frame);
        // Over the ground: the motion vector's is relative to the air.
        let wind = kinematics.world_from_frame(frame).rotation.inverse() * clip.wind_at(frame);
        let velocity = Vec3::from_slice(&c[self.slices.root_velocity.clone()]) + wind;
        let turning = c[self.slices.root_angular_velocity.start + 1];
        // The y row of the root's rotation; its middle is the cosine to the vertical.
        let upright = c[self.slices.root_orientation.start + 4];
        let mut values = vec![
            velocity.reject_from(Vec3::Y).length(),
            velocity.z,
            velocity.x,
            velocity.y,
            turning.to_degrees(),
            c[self.slices.root_position.start + 1],
            upright.clamp(-1.0, 1.0).acos().to_degrees(),
        ];
        // Frame 0 moves as frame 1 does.
        let now = &clip.poses[frame].local;
        let (before, after) = match frame {
            0 => (0, 1.min(clip.len() - 1)),
            _ => (frame - 1, frame),
        };
        let (before, after) = (&clip.poses[before].local, &clip.poses[after].local);
        for &joint in &self.joints {
            values.push(angle(now[joint].w));
            values.push(angle(before[joint].dot(after[joint])) * clip.fps);
        }
        let root = skeleton.root();
        let position = |joint: usize| {
            let local = joint - usize::from(joint > root);
            Vec3::from_slice(&c[self.slices.joint_positions.start + 3 * local..][..3])
        };
        for &[shoulder, elbow] in &self.arms {
            let arm = position(elbow) - position(shoulder);
            values.push(arm.angle_between(Vec3::NEG_Y).to_degrees());
        }
        values
    }

    pub(super) fn kinds(&self, values: &[f32], kinematics: &ClipKinematics, frame: usize) -> Vec<Kind> {
        let contacts = &kinematics.motion(frame)[self.slices.contacts.clone()];
        let speed = values[SPEED];
        let lies = values[LEAN] > LYING;
        let is = |kind: Kind| match kind {
            Kind::Standing => speed < STANDING && values[TURN].abs() < TURNING && !lies,
            Kind::TurningOnTheSpot => speed < STANDING && values[TURN].abs() >= TURNING && !lies,
            Kind::Walking => (STANDING..RUNNING).contains(&speed) && !lies,
            Kind::Running => speed >= RUNNING && !lies,
            Kind::Sideways => speed >= STANDING && values[LEFT].abs() > values[FORWARDS].abs(),
            Kind::Backwards => speed >= STANDING && -values[FORWARDS] > values[LEFT].abs(),
            Kind::Crouching => values[HEIGHT] < CROUCHING * self.standing_height,
            Kind::InTheAir => contacts.iter().all(|&c| c == 0.0) && values[VERTICAL].abs() > STANDING,
            Kind::Lying => lies,
        };
        Kind::ALL.into_iter().filter(|&kind| is(kind)).collect()
    }
}

/// Angle of a rotation from the (absolute) cosine of half of it, degrees.
fn angle(half_cosine: f32) -> f32 {
    2.0 * half_cosine.abs().min(1.0).acos().to_degrees()
}

/// `L_elbow` as "left elbow".
fn spoken(name: &str) -> String {
    match name.split_once('_') {
        Some(("L", rest)) => format!("left {rest}"),
        Some(("R", rest)) => format!("right {rest}"),
        _ => name.replace('_', " "),
    }
}

/// Least and largest value of every quantity in a capture.
#[derive(Clone, Debug)]
pub(super) struct Ranges {
    seen: Vec<[f32; 2]>,
}

impl Ranges {
    pub(super) fn new(quantities: &Quantities) -> Self {
        Self {
            seen: vec![[f32::INFINITY, f32::NEG_INFINITY]; quantities.names.len()],
        }
    }

    pub(super) fn add(&mut self, values: &[f32]) {
        for ([least, most], &value) in self.seen.iter_mut().zip(values) {
            (*least, *most) = (least.min(value), most.max(value));
        }
    }

    /// Without any frame nothing is seen: every range is zero.
    pub(super) fn close(&mut self) {
        let empty = |range: &&mut [f32; 2]| range[0] > range[1];
        self.seen
            .iter_mut()
            .filter(empty)
            .for_each(|range| *range = [0.0; 2]);
    }

    /// Quantities that leave their range by more than a margin within some frames, the furthest
    /// out first, in proportion to the margin.
    pub(super) fn outside(
        &self,
        quantities: &Quantities,
        values: &[Vec<f32>],
        frames: Range<usize>,
        fps: f32,
    ) -> Vec<Excess> {
        let mut found: Vec<(f32, Excess)> = Vec::new();
        for (q, (name, unit)) in quantities.names.iter().enumerate() {
            let [least, most] = self.seen[q];
            let beyond = |t: usize| (values[t][q] - most).max(least - values[t][q]);
            let out = frames.clone().filter(|&t| beyond(t) > unit.margin()).count();
            let worst = frames.clone().max_by(|&a, &b| beyond(a).total_cmp(&beyond(b)));
            if let Some(worst) = worst.filter(|_| out > 0) {
                let excess = Excess {
                    quantity: name.clone(),
                    unit: *unit,
                    seen: [least, most],
                    found: values[worst][q],
                    at_seconds: worst as f32 / fps,
                    seconds: out as f32 / fps,
                };
                found.push((beyond(worst) / unit.margin(), excess));
            }
        }
        found.sort_by(|a, b| b.0.total_cmp(&a.0));
        found.into_iter().map(|(_, excess)| excess).collect()
    }
}
