//! Footstep plan: the times and places of steps that keep both feet below a moving body.

use super::{
    Side,
    channel::{Channel, Gestures, Interval},
    curve::Easing,
    foot::{Foot, Footprint, Swing},
    gait::{Gait, Stature},
    path::{GroundPath, GroundPose},
    sole::Sole,
};

/// Distance between a foot and its home position that triggers a step, metres.
const STEP_DISTANCE: f64 = 0.05;

/// Angle between a foot and its home direction that triggers a step, radians.
const STEP_ANGLE: f64 = 0.12;

/// Shortest time on the ground between two swings of one foot, seconds.
const LEAST_STANCE_S: f64 = 0.1;

/// Time step at which a standing character checks whether a step is due, seconds.
const CHECK_S: f64 = 1.0 / 60.0;

/// Outward angle of the feet, radians.
const TOE_OUT: f64 = 0.1;

/// Distance of the ankles behind the pelvis, metres: the weight lies in front of the ankle.
const ANKLE_BEHIND: f64 = 0.02;

/// Additional distance behind the pelvis in the middle of a stance, per m/s of speed, seconds.
///
/// Feet leave the ground further behind the body than they land before it.
const ANKLE_TRAILING_S: f64 = 0.05;

/// Speed above which that additional distance stays constant, m/s.
const TRAILING_SPEED: f64 = 2.5;

/// Longest step to the side, metres a stride: the trailing foot must not reach the leading one.
const SIDE_STRIDE: f64 = 0.34;

/// Highest frequency of strides, Hz: feet that step more often hardly stand.
const MOST_STRIDE_HZ: f64 = 3.5;

/// Further times ahead at which quick steps read the gait, seconds.
const QUICK_AHEAD_S: [f64; 4] = [0.15, 0.3, 0.45, 0.6];

/// Time before a jump's takeoff from which on no further step begins, seconds.
const QUIET_BEFORE_JUMP_S: f64 = 0.6;

/// Time after a jump's landing before the next step, seconds.
const QUIET_AFTER_JUMP_S: f64 = 0.3;

/// Time ahead at which the gait of a due step is read, seconds: about the middle of its swing.
const GAIT_AHEAD_S: f64 = 0.2;

/// Time without a landing after which the side of the movement picks the next foot, seconds.
const RESTED_S: f64 = 0.3;

/// Time ahead at which the direction of the next movement is read, seconds.
const LEADING_AHEAD_S: f64 = 0.4;

/// Height by which heel, ball and toes clear the ground in the middle of a swing, metres.
const LEAST_CLEARANCE: f32 = 0.008;

/// Timing of the steps of a timeline.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum StepTiming {
    /// Steps as frequent as the speed of their own time asks for.
    #[default]
    Ordinary,
    /// Steps as frequent as the fastest movement of the next moments asks for. Abrupt starts and
    /// turns then leave no foot behind, which would pull the pelvis down.
    Quick,
}

/// A jump from a stand with both feet. Times are in seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jump {
    pub(super) takeoff: f64,
    pub(super) landing: f64,
    /// Descent of the pelvis before takeoff, metres.
    pub(super) crouch: f64,
}

/// Inputs of the footstep plan.
pub(super) struct StepPlanner<'a> {
    pub(super) gestures: &'a Gestures,
    pub(super) path: &'a GroundPath,
    pub(super) jumps: &'a [Jump],
    pub(super) stature: Stature,
    pub(super) soles: &'a [Sole; 2],
    /// Half the distance of the hip joints, metres.
    pub(super) half_width: f64,
    /// Factor on the frequency of steps: a person's habit.
    pub(super) tempo: f64,
    /// Foot of the first step.
    pub(super) first: Side,
    /// Timing of the steps.
    pub(super) timing: StepTiming,
}

impl StepPlanner<'_> {
    fn ground_pose(&self, t: f64) -> GroundPose {
        self.path.at(self.gestures, t)
    }

    fn speed(&self, t: f64) -> f64 {
        self.gestures.at(Channel::Speed, t)
    }

    fn gait(&self, t: f64) -> Gait {
        let turn_rate = self.gestures.at(Channel::TurnRate, t);
        let mut gait = self.stature.gait(self.speed(t).abs(), turn_rate);
        // Steps to the side are short, so that fast ones must be frequent.
        let strafe = self.gestures.at(Channel::Strafe, t).abs();
        let stride_hz = gait.stride_hz.max(strafe / SIDE_STRIDE).min(MOST_STRIDE_HZ);
        gait.stride_hz = stride_hz * self.tempo;
        gait
    }

    /// Footprint of a foot that stands in its neutral place below the body of time `t`.
    fn home(&self, side: Side, t: f64) -> Footprint {
        let ground_pose = self.ground_pose(t);
        let sign = f64::from(side.sign());
        let left = sign * self.half_width * self.gait(t).width;
        Footprint {
            position: ground_pose.offset(
                left,
                -ANKLE_BEHIND - ANKLE_TRAILING_S * self.speed(t).min(TRAILING_SPEED),
            ),
            heading: ground_pose.heading + sign * TOE_OUT,
        }
    }

    /// Plans the swings of both feet until `seconds`, left foot first in the array.
    pub(super) fn plan(&self, seconds: f64) -> [Foot; 2] {
        let mut feet = Side::BOTH.map(|side| Foot {
            first: self.home(side, 0.0),
            swings: Vec::new(),
        });
        let (mut t, mut turn, mut jumps) = (0.0, self.first, self.jumps.iter().peekable());
        while t < seconds {
            if let Some(jump) = jumps.next_if(|j| t + QUIET_BEFORE_JUMP_S > j.takeoff) {
                for side in Side::BOTH {
                    self.leap(&mut feet[side.index()], side, jump);
                }
                t = jump.landing + QUIET_AFTER_JUMP_S;
                continue;
            }
            match self.due_step(&feet, turn, t) {
                Some((side, gait)) => {
                    let swing = self.swing(&feet[side.index()], side, t, gait);
                    feet[side.index()].swings.push(swing);
                    turn = side.other();
                    // A stride is two steps.
                    t += 0.5 / gait.stride_hz;
                }
                None => t += CHECK_S,
            }
        }
        feet
    }

    /// Foot that has to step at time `t`, with the gait of its step; none while both may stand.
    ///
    /// Feet alternate. After a rest, the foot on the side of the next movement comes first.
    fn due_step(&self, feet: &[Foot; 2], turn: Side, t: f64) -> Option<(Side, Gait)> {
        let rested = feet.iter().all(|f| f.last_landing() < t - RESTED_S);
        let leading = if rested {
            self.leading(t).unwrap_or(turn)
        } else {
            turn
        };
        let gait = self.coming_gait(t + GAIT_AHEAD_S);
        [leading, leading.other()]
            .into_iter()
            .find(|&side| self.is_due(&feet[side.index()], side, t, gait))
            .map(|side| (side, gait))
    }

    /// Gait of a step that begins at `t`, by the timing of the steps.
    fn coming_gait(&self, t: f64) -> Gait {
        let later: &[f64] = match self.timing {
            StepTiming::Ordinary => &[],
            StepTiming::Quick => &QUICK_AHEAD_S,
        };
        let more_frequent = |a: Gait, b: Gait| if b.stride_hz > a.stride_hz { b } else { a };
        (later.iter().map(|ahead| self.gait(t + ahead))).fold(self.gait(t), more_frequent)
    }

    /// Side towards which the character is about to step or turn, if it is.
    fn leading(&self, t: f64) -> Option<Side> {
        let sideways = self.gestures.at(Channel::Strafe, t + LEADING_AHEAD_S);
        let turning = self.gestures.at(Channel::TurnRate, t + LEADING_AHEAD_S);
        let to_left = if sideways.abs() > 0.05 { sideways } else { turning };
        (to_left.abs() > 0.05).then_some(if to_left > 0.0 { Side::Left } else { Side::Right })
    }

    /// Returns true if a foot is too far from its home position in the stance after a step at `t`.
    fn is_due(&self, foot: &Foot, side: Side, t: f64, gait: Gait) -> bool {
        if t < foot.last_landing() + LEAST_STANCE_S {
            return false;
        }
        let (now, wanted) = (foot.last_footprint(), self.home(side, middle_of_stance(t, gait)));
        let distance = now.position.distance(wanted.position);
        distance > STEP_DISTANCE || (now.heading - wanted.heading).abs() > STEP_ANGLE
    }

    /// Swing of one step that begins at time `lift`.
    fn swing(&self, foot: &Foot, side: Side, lift: f64, gait: Gait) -> Swing {
        // The foot lands where it is in its neutral place in the middle of the coming stance.
        let (from, to) = (
            foot.last_footprint(),
            self.home(side, middle_of_stance(lift, gait)),
        );
        // A first step follows a rest of any length: the roll over the heel is that of a usual
        // stance.
        let stance = (lift - foot.last_landing()).min(gait.duty / gait.stride_hz);
        let swing = (1.0 - gait.duty) / gait.stride_hz;
        let forward = glam::DVec2::new(to.heading.sin(), to.heading.cos());
        let ahead = (to.position - from.position).dot(forward);
        // Long steps roll further over heel and toes than short ones; 1.2 m counts as long.
        let stride = (ahead / 1.2).clamp(0.0, 1.0);
        let land = lift + swing;
        let is_run = gait.duty < 0.5;
        // Share of the stance after which the heel rises, share of the swing at which it is
        // highest, and pitches of the sole at toe-off and touch-down, radians.
        let (push, peak, toe_off, touch_down) = match is_run {
            true => (0.65, 0.06, 0.4 + stride, 0.12),
            false => (0.42, 0.1, 0.1 + 0.85 * stride, 0.33 * stride),
        };
        let turned = (to.heading - from.heading).abs();
        self.cleared(
            side,
            Swing {
                heel_off: lift - (push * stance).min(0.3),
                lift,
                peak: lift + peak * swing,
                land,
                flat: land + (0.2 * gait.duty / gait.stride_hz).min(0.13),
                from,
                to,
                leave: if is_run {
                    brief_transition(lift)
                } else {
                    Interval::new(lift, lift + 0.1 * swing)
                },
                arrive: if is_run {
                    brief_transition(land)
                } else {
                    Interval::new(land - 0.3 * swing, land)
                },
                easing: if is_run {
                    Easing {
                        ease_in: 0.28,
                        ease_out: 0.28,
                    }
                } else {
                    Easing {
                        ease_in: 0.36,
                        ease_out: 0.33,
                    }
                },
                height: if is_run {
                    (0.07 * self.speed(lift) - 0.1).max(0.05)
                } else {
                    0.02
                },
                detour: f64::from(side.sign()) * (0.08 * turned).min(0.1),
                toe_off,
                touch_down,
            },
        )
    }

    /// Adds the swing of one foot in a jump.
    fn leap(&self, foot: &mut Foot, side: Side, jump: &Jump) {
        let (from, flight) = (foot.last_footprint(), jump.landing - jump.takeoff);
        let swing = Swing {
            heel_off: jump.takeoff - 0.22,
            lift: jump.takeoff,
            peak: jump.takeoff + 0.2 * flight,
            land: jump.landing,
            flat: jump.landing + 0.1,
            from,
            to: self.home(side, jump.landing),
            leave: brief_transition(jump.takeoff),
            arrive: brief_transition(jump.landing),
            easing: Easing {
                ease_in: 0.14,
                ease_out: 0.14,
            },
            // In free fall the body rises by g t²/8; the feet rise by 90 % of that.
            height: 0.9 * super::gait::GRAVITY * flight * flight / 8.0,
            detour: 0.0,
            toe_off: 0.75,
            touch_down: 0.0,
        };
        foot.swings.push(self.cleared(side, swing));
    }

    /// Raises the arc of a swing until heel, ball and toes clear the ground.
    fn cleared(&self, side: Side, mut swing: Swing) -> Swing {
        let sole = &self.soles[side.index()];
        // At most 20 cm higher. The first and last 15 % are left out: there the foot is on the
        // ground or close to it whatever the arc.
        for _ in 0..20 {
            let foot = Foot {
                first: swing.from,
                swings: vec![swing],
            };
            let at = |i: usize| swing.lift + (swing.land - swing.lift) * (0.15 + 0.7 * i as f64 / 15.0);
            let lowest = (0..16)
                .map(|i| foot.at(at(i), sole).clearance)
                .fold(f32::INFINITY, f32::min);
            if lowest > LEAST_CLEARANCE {
                break;
            }
            swing.height += 0.01;
        }
        swing
    }
}

/// Transition between stance and swing in runs and jumps, where legs load and unload quickly.
fn brief_transition(contact: f64) -> Interval {
    Interval::new(contact - 0.03, contact + 0.03)
}

/// Middle of the stance after a swing that begins at time `lift`, seconds.
fn middle_of_stance(lift: f64, gait: Gait) -> f64 {
    lift + (1.0 - 0.5 * gait.duty) / gait.stride_hz
}
