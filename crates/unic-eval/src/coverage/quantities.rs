//! Quantities of a motion in everyday terms: speeds, angles, kinds of movement.

use super::{report::Excess, unit::Unit};
use crate::kinematics::ClipKinematics;
use glam::Vec3;
use std::ops::Range;
use unic_core::{clip::Clip, motion::MotionSlices, skeleton::Skeleton};

/// Kind of movement. A frame may be of several kinds.
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

    /// Returns the kind in words.
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

/// Least speed of a character that is not standing, m/s.
const STANDING: f32 = 0.3;
/// Least speed of running, m/s.
const RUNNING: f32 = 2.0;
/// Least turning rate of a turn, degrees per second.
const TURNING: f32 = 45.0;
/// Largest height of the pelvis in crouching, as a share of its height in the bind pose.
const CROUCHING: f32 = 0.8;
/// Least angle to the vertical in lying, degrees.
const LYING: f32 = 60.0;

/// Quantities of the whole body, which come first. Those of the joints follow.
const WHOLE: [(&str, Unit); 7] = [
    ("speed", Unit::MetresPerSecond),
    ("speed forwards", Unit::MetresPerSecond),
    ("speed to the left", Unit::MetresPerSecond),
    ("vertical speed", Unit::MetresPerSecond),
    ("turning rate to the left", Unit::DegreesPerSecond),
    ("height of the pelvis", Unit::Metres),
    ("lean of the pelvis", Unit::Degrees),
];
/// Indices into [`WHOLE`].
const SPEED: usize = 0;
const FORWARDS: usize = 1;
const LEFT: usize = 2;
const VERTICAL: usize = 3;
const TURN: usize = 4;
const HEIGHT: usize = 5;
const LEAN: usize = 6;

/// Names and units of all quantities of a skeleton.
#[derive(Clone, Debug)]
pub(super) struct Quantities {
    pub(super) names: Vec<(String, Unit)>,
    slices: MotionSlices,
    /// Joints other than the root.
    joints: Vec<usize>,
    /// Left and right upper arm.
    arms: Vec<UpperArm>,
    /// Height of the root above the lowest joint in the bind pose, metres.
    standing_height: f32,
}

/// Joints at both ends of an upper arm.
#[derive(Clone, Copy, Debug)]
struct UpperArm {
    shoulder: usize,
    elbow: usize,
}

impl Quantities {
    /// Lists the quantities of a skeleton.
    pub(super) fn of(skeleton: &Skeleton) -> Self {
        let root = skeleton.root();
        let joints: Vec<usize> = (0..skeleton.len()).filter(|&j| j != root).collect();
        let whole = WHOLE.iter().map(|(name, unit)| ((*name).to_owned(), *unit));
        let mut names: Vec<(String, Unit)> = whole.collect();
        for &joint in &joints {
            let name = in_words(&skeleton.names()[joint]);
            names.push((format!("bend of the {name}"), Unit::Degrees));
            names.push((format!("speed of the {name}"), Unit::DegreesPerSecond));
        }
        let mut arms = Vec::new();
        for (side, name) in [("L", "left"), ("R", "right")] {
            let joint = |part: &str| skeleton.joint(&format!("{side}_{part}"));
            if let (Some(shoulder), Some(elbow)) = (joint("shoulder"), joint("elbow")) {
                arms.push(UpperArm { shoulder, elbow });
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

    /// Returns the value of every quantity in a frame.
    pub(super) fn values(
        &self,
        skeleton: &Skeleton,
        clip: &Clip,
        kinematics: &ClipKinematics,
        frame: usize,
    ) -> Vec<f32> {
        let c = kinematics.motion(frame);
        // The motion vector's velocity is relative to the air. Speeds here are over the ground.
        let wind = kinematics.world_from_frame(frame).rotation.inverse() * clip.wind_at(frame);
        let velocity = Vec3::from_slice(&c[self.slices.root_velocity.clone()]) + wind;
        let turning = c[self.slices.root_angular_velocity.start + 1];
        // The y row of the root's rotation matrix. Its middle element is the cosine of the angle to
        // the vertical.
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
        // Frame 0 has no frame before it and takes the velocities of frame 1.
        let now = &clip.poses[frame].local;
        let (before, after) = match frame {
            0 => (0, 1.min(clip.len() - 1)),
            _ => (frame - 1, frame),
        };
        let (before, after) = (&clip.poses[before].local, &clip.poses[after].local);
        for &joint in &self.joints {
            values.push(angle(now[joint].w));
            // The cosine of half the angle between two unit quaternions is their inner product.
            values.push(angle(before[joint].dot(after[joint])) * clip.fps);
        }
        let root = skeleton.root();
        let position = |joint: usize| {
            // The motion vector leaves out the root, whose position is its origin.
            let local = joint - usize::from(joint > root);
            Vec3::from_slice(&c[self.slices.joint_positions.start + 3 * local..][..3])
        };
        for &UpperArm { shoulder, elbow } in &self.arms {
            let arm = position(elbow) - position(shoulder);
            values.push(arm.angle_between(Vec3::NEG_Y).to_degrees());
        }
        values
    }

    /// Returns the kinds of movement of a frame.
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

/// Returns the angle of a rotation from the cosine of half of it, degrees. The sign is ignored: a
/// quaternion and its negative are one rotation.
fn angle(half_cosine: f32) -> f32 {
    2.0 * half_cosine.abs().min(1.0).acos().to_degrees()
}

/// Returns the name of a joint in words: `L_elbow` is "left elbow".
fn in_words(name: &str) -> String {
    match name.split_once('_') {
        Some(("L", rest)) => format!("left {rest}"),
        Some(("R", rest)) => format!("right {rest}"),
        _ => name.replace('_', " "),
    }
}

/// Range of every quantity in a capture.
#[derive(Clone, Debug)]
pub(super) struct Ranges {
    /// Least and largest value of each quantity.
    seen: Vec<[f32; 2]>,
}

impl Ranges {
    /// Starts without any value.
    pub(super) fn new(quantities: &Quantities) -> Self {
        Self {
            seen: vec![[f32::INFINITY, f32::NEG_INFINITY]; quantities.names.len()],
        }
    }

    /// Extends the ranges by the values of a frame.
    pub(super) fn add(&mut self, values: &[f32]) {
        for ([least, most], &value) in self.seen.iter_mut().zip(values) {
            (*least, *most) = (least.min(value), most.max(value));
        }
    }

    /// Ends the collection. Quantities without any value get the range zero.
    pub(super) fn close(&mut self) {
        let empty = |range: &&mut [f32; 2]| range[0] > range[1];
        self.seen
            .iter_mut()
            .filter(empty)
            .for_each(|range| *range = [0.0; 2]);
    }

    /// Returns the quantities that leave their range by more than the margin within some frames.
    /// The farthest out come first, in proportion to the margin.
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
