//! Motion of one character as a function of time.
//!
//! Factors without a comment are chosen by eye.

mod height;

use super::{
    Side,
    channel::Channel,
    foot::Foot,
    footsteps::StepPlanner,
    gait::GRAVITY,
    path::{GroundPath, GroundPose, on_ground},
    rig::{Arm, Posture, Rig},
    script::Script,
    tracks::{Tracks, flight_spline},
};
use glam::Quat;
use unic_core::{Pose, clip::Clip};

/// Motion of one character, a continuous function of time.
///
/// It is twice continuously differentiable except at landings. Every frame rate samples the same
/// motion.
#[derive(Clone, Debug)]
pub struct Performance {
    rig: Rig,
    script: Script,
    path: GroundPath,
    feet: [Foot; 2],
    tracks: Tracks,
}

impl Performance {
    pub(super) fn new(rig: Rig, script: Script) -> Self {
        let path = GroundPath::new(&script.gestures, script.seconds);
        let planner = StepPlanner {
            gestures: &script.gestures,
            path: &path,
            jumps: &script.jumps,
            stature: rig.stature,
            soles: &rig.soles,
            half_width: rig.half_width(),
            tempo: script.habit.tempo,
            first: script.habit.first,
            timing: script.timing,
        };
        let feet = planner.plan(script.seconds);
        let flight = flight_spline(&feet, &script);
        let tracks = Tracks::new(&script, &path, &feet, flight);
        // The height needs the poses of pelvis and feet, which in turn need the other tracks.
        let mut performance = Self {
            rig,
            script,
            path,
            feet,
            tracks,
        };
        performance.tracks.height = performance.height_track();
        performance
    }

    /// Length in seconds.
    pub fn seconds(&self) -> f32 {
        self.script.seconds as f32
    }

    /// Pose at a time in seconds, with the ground at height zero.
    ///
    /// Before the start and after the end the character stands still.
    pub fn pose_at(&self, seconds: f32) -> Pose {
        self.pose(f64::from(seconds))
    }

    /// Samples the motion from its start to its end at `fps` frames a second.
    ///
    /// # Panics
    /// Panics if `fps` is not positive.
    pub fn clip(&self, name: &str, fps: f32) -> Clip {
        assert!(fps > 0.0, "frames per second");
        // A thousandth of a frame of slack: rounding must not drop the last frame where the length
        // is a whole number of frames.
        let frames = (self.script.seconds * f64::from(fps) + 1e-3) as usize + 1;
        Clip {
            name: name.into(),
            fps,
            poses: (0..frames)
                .map(|f| self.pose(f as f64 / f64::from(fps)))
                .collect(),
            ground_height: 0.0,
            wind: Vec::new(),
        }
    }

    /// Returns true while a foot carries weight: it stays in place but for its roll over heel and
    /// ball.
    pub fn is_planted(&self, side: Side, seconds: f32) -> bool {
        self.feet[side.index()].is_planted(f64::from(seconds))
    }

    fn pose(&self, t: f64) -> Pose {
        let t = t.clamp(0.0, self.script.seconds);
        let state = self.state(t);
        let height = self.tracks.height.at(t) + self.tracks.flight.at(t);
        let pelvis = self.pelvis(&state);
        self.rig.pose(&Posture {
            position: on_ground(self.ground_point(&state), height),
            pelvis,
            chest: self.chest(&state),
            head: self.head(&state),
            arms: Side::BOTH.map(|side| self.arm(&state, side)),
            feet: Side::BOTH.map(|side| {
                let i = side.index();
                self.feet[i].at(t, &self.rig.soles[i])
            }),
        })
    }

    /// Collects the quantities that several parts of the body need at time `t`.
    fn state(&self, t: f64) -> BodyState {
        let channel = |channel| self.script.gestures.at(channel, t);
        let speed = channel(Channel::Speed);
        let speed_near = |dt: f64| self.script.gestures.at(Channel::Speed, t + dt);
        let turn_rate = channel(Channel::TurnRate);
        BodyState {
            t,
            ground_pose: self.path.at(&self.script.gestures, t),
            speed,
            run: self.rig.stature.running_weight(speed),
            // Central difference of the speed channel.
            acceleration: (speed_near(0.06) - speed_near(-0.06)) / 0.12,
            turn_rate,
            // 60 % of the lean that would balance the centripetal acceleration, limited smoothly.
            bank: (0.6 * speed * turn_rate / GRAVITY).tanh(),
            ahead: self.tracks.ahead.at(t),
        }
    }

    fn channel(&self, channel: Channel, state: &BodyState) -> f64 {
        self.script.gestures.at(channel, state.t)
    }

    /// World x and z of the pelvis joint.
    fn ground_point(&self, state: &BodyState) -> glam::DVec2 {
        // Towards the centre of a curve, as the whole body leans into it.
        let inward = 0.45 * state.bank;
        // The pelvis moves over the foot that carries the weight.
        let sway = self.channel(Channel::Sway, state) + 0.6 * self.tracks.support.at(state.t);
        let shift = self.channel(Channel::Shift, state) + 0.012 * state.acceleration.tanh();
        state.ground_pose.offset(sway + inward, shift)
    }

    /// Forward lean of the trunk, radians.
    fn lean(&self, state: &BodyState) -> f64 {
        let habit = self.script.habit.lean + 0.03 * (state.speed / 1.4).min(1.5) + 0.10 * state.run;
        // The trunk leans into acceleration and back while braking.
        let effort = 0.09 * (0.5 * state.acceleration).tanh();
        habit + effort + self.channel(Channel::Lean, state)
    }

    /// Rotation of the pelvis.
    fn pelvis(&self, state: &BodyState) -> Quat {
        // The pelvis turns with the leading leg.
        let yaw = -0.13 * state.ahead * (1.0 - 0.3 * state.run) + self.channel(Channel::HipTurn, state);
        let sway = self.channel(Channel::Sway, state);
        // The hip of the swinging leg drops a little, and so does the one away from a shifted
        // weight.
        let list = 0.045 * self.tracks.load.at(state.t) + 0.9 * sway.clamp(-0.2, 0.2);
        let roll = list - state.bank + 0.25 * self.channel(Channel::SideBend, state);
        turned(state, yaw, 0.4 * self.lean(state), roll)
    }

    /// Rotation of the chest, which counters the turn and the tilt of the pelvis.
    fn chest(&self, state: &BodyState) -> Quat {
        let twist = self.channel(Channel::Twist, state) + 0.4 * self.channel(Channel::HipTurn, state);
        let yaw = (0.10 + 0.04 * state.run) * state.ahead + twist;
        let counter = 0.35 * self.channel(Channel::Sway, state);
        let roll = self.channel(Channel::SideBend, state) - state.bank - counter;
        turned(state, yaw, self.lean(state), roll)
    }

    /// Rotation of the head, which stays nearly level and turns ahead of the body.
    fn head(&self, state: &BodyState) -> Quat {
        let into_turn = 0.3 * state.turn_rate.tanh();
        let yaw =
            self.channel(Channel::LookYaw, state) + into_turn + 0.45 * self.channel(Channel::Twist, state);
        let bow = self.channel(Channel::LookDown, state) + 0.25 * self.lean(state);
        let roll = 0.35 * self.channel(Channel::SideBend, state) - 0.3 * state.bank;
        turned(state, yaw, bow, roll)
    }

    /// Angles of one arm, which swings against the leg of its side.
    fn arm(&self, state: &BodyState, side: Side) -> Arm {
        let swing = -f64::from(side.sign()) * (state.ahead / 0.9).tanh() * self.script.habit.arm_swing;
        let lean = self.lean(state);
        let flexion = (0.52 + 0.12 * state.run) * swing + 0.02 + 0.5 * lean - 0.15 * state.run;
        let elbow = self.script.habit.elbow + 0.22 * swing * (1.0 - state.run) + 1.25 * state.run;
        Arm {
            flexion: (flexion + self.channel(Channel::Flexion(side), state)) as f32,
            abduction: (0.13 + 0.11 * state.run + self.channel(Channel::Abduction(side), state)) as f32,
            rotation: (0.12 - 0.10 * state.run + self.channel(Channel::Rotation(side), state)) as f32,
            elbow: (elbow + self.channel(Channel::Elbow(side), state)) as f32,
        }
    }
}

/// Quantities at one time that several parts of the body depend on.
struct BodyState {
    /// Time, seconds.
    t: f64,
    ground_pose: GroundPose,
    /// Speed along the heading, m/s.
    speed: f64,
    /// Blend weight of running, 0 to 1.
    run: f64,
    /// Acceleration along the heading, m/s².
    acceleration: f64,
    /// Turning rate, rad/s, positive to the left.
    turn_rate: f64,
    /// Lean into the curve, radians, positive to the left.
    bank: f64,
    /// Distance of the left foot ahead of the right one, metres.
    ahead: f64,
}

/// World rotation that is turned from the heading by `yaw`, leant forward and rolled to the right,
/// all in radians.
fn turned(state: &BodyState, yaw: f64, lean: f64, roll: f64) -> Quat {
    Quat::from_rotation_y((state.ground_pose.heading + yaw) as f32)
        * Quat::from_rotation_x(lean as f32)
        * Quat::from_rotation_z(roll as f32)
}
