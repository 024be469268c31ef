//! Footstep plan: which foot steps when and where, so that both stay below a moving body.

use super::{
    channel::{Channel, Gestures, Side},
    foot::{Foot, Print, Swing},
    gait::{Gait, Stature},
    path::{Path, Station},
    sole::Sole,
};

/// A foot that would stand further from its place than this takes a step, metres.
const STEP_DISTANCE: f64 = 0.05;

/// Likewise for its direction, radians.
const STEP_ANGLE: f64 = 0.12;

/// Shortest time on the ground between two swings of one foot, seconds.
const LEAST_STANCE_S: f64 = 0.1;

/// Interval at which a standing character looks whether a step is due, seconds.
const LOOK_S: f64 = 1.0 / 60.0;

/// Feet point outward by this angle, radians.
const TOE_OUT: f64 = 0.1;

/// Ankles stand this far behind the pelvis, metres: the weight lies in front of the ankle.
const ANKLE_BEHIND: f64 = 0.02;

/// Further distance behind the pelvis in the middle of a stance for each m/s of speed, seconds: feet
/// leave the ground further behind the body than they land before it.
const ANKLE_TRAILING_S: f64 = 0.05;

/// Speed from which on that distance grows no further, m/s.
const TRAILING_SPEED: f64 = 2.5;

/// Longest step to the side, metres a stride: the trailing foot must not reach the leading one.
const SIDE_STRIDE: f64 = 0.34;

/// Both feet off the ground from a stand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jump {
    pub(super) takeoff: f64,
    pub(super) landing: f64,
    /// How deep the knees bend before, metres of the pelvis.
    pub(super) crouch: f64,
}

/// Everything that decides about steps.
pub(super) struct Course<'a> {
    pub(super) gestures: &'a Gestures,
    pub(super) path: &'a Path,
    pub(super) jumps: &'a [Jump],
    pub(super) stature: Stature,
    pub(super) soles: &'a [Sole; 2],
    /// Half the distance of the hip joints, metres.
    pub(super) half_width: f64,
    /// Factor on the rhythm: a person's habit.
    pub(super) tempo: f64,
    /// Which foot starts.
    pub(super) first: Side,
}

impl Course<'_> {
    pub(super) fn station(&self, t: f64) -> Station {
        self.path.at(self.gestures, t)
    }

    fn speed(&self, t: f64) -> f64 {
        self.gestures.at(Channel::Speed, t)
    }

    fn gait(&self, t: f64) -> Gait {
        let turn_rate = self.gestures.at(Channel::TurnRate, t);
        let mut gait = self.stature.gait(self.speed(t), turn_rate);
        let strafe = self.gestures.at(Channel::Strafe, t).abs();
        gait.stride_hz = gait.stride_hz.max(strafe / SIDE_STRIDE) * self.tempo;
        gait
    }

    /// Where a foot belongs while the body is where it is at time `t`.
    fn home(&self, side: Side, t: f64) -> Print {
        let station = self.station(t);
        let sign = f64::from(side.sign());
        let left = sign * self.half_width * self.gait(t).width;
        Print {
            position: station.offset(
                left,
                -ANKLE_BEHIND - ANKLE_TRAILING_S * self.speed(t).min(TRAILING_SPEED),
            ),
            heading: station.heading + sign * TOE_OUT,
        }
    }

    /// Swings of both feet until `seconds`, left foot first in the array.
    pub(super) fn plan(&self, seconds: f64) -> [Foot; 2] {
        let mut feet = Side::BOTH.map(|side| Foot {
            first: self.home(side, 0.0),
            swings: Vec::new(),
        });
        let (mut t, mut turn, mut jumps) = (0.0, self.first, self.jumps.iter().peekable());
        while t < seconds {
            if let Some(jump) = jumps.next_if(|j| t + 0.6 > j.takeoff) {
                for side in Side::BOTH {
                    self.leap(&mut feet[side.index()], side, jump);
                }
                t = jump.landing + 0.3;
                continue;
            }
            match self.stepping(&feet, turn, t) {
                Some((side, gait)) => {
                    let swing = self.swing(&feet[side.index()], side, t, gait);
                    feet[side.index()].swings.push(swing);
                    turn = side.other();
                    t += 0.5 / gait.stride_hz;
                }
                None => t += LOOK_S,
            }
        }
        feet
    }

    /// The foot that has to step at `t`, if one has: the one whose turn it is, or after a rest the
    /// one on the side of the movement.
    fn stepping(&self, feet: &[Foot; 2], turn: Side, t: f64) -> Option<(Side, Gait)> {
        let rested = feet.iter().all(|f| f.last_landing() < t - 0.3);
        let leading = if rested {
            self.leading(t).unwrap_or(turn)
        } else {
            turn
        };
        let gait = self.gait(t + 0.2);
        [leading, leading.other()]
            .into_iter()
            .find(|&side| self.is_due(&feet[side.index()], side, t, gait))
            .map(|side| (side, gait))
    }

    fn leading(&self, t: f64) -> Option<Side> {
        let sideways = self.gestures.at(Channel::Strafe, t + 0.4);
        let turning = self.gestures.at(Channel::TurnRate, t + 0.4);
        let to_left = if sideways.abs() > 0.05 { sideways } else { turning };
        (to_left.abs() > 0.05).then_some(if to_left > 0.0 { Side::Left } else { Side::Right })
    }

    fn is_due(&self, foot: &Foot, side: Side, t: f64, gait: Gait) -> bool {
        if t < foot.last_landing() + LEAST_STANCE_S {
            return false;
        }
        let (now, wanted) = (foot.last_print(), self.home(side, middle_of_stance(t, gait)));
        let distance = now.position.distance(wanted.position);
        distance > STEP_DISTANCE || (now.heading - wanted.heading).abs() > STEP_ANGLE
    }

    fn swing(&self, foot: &Foot, side: Side, lift: f64, gait: Gait) -> Swing {
        let (from, to) = (foot.last_print(), self.home(side, middle_of_stance(lift, gait)));
        let stance = (lift - foot.last_landing()).min(gait.duty / gait.stride_hz);
        let swing = (1.0 - gait.duty) / gait.stride_hz;
        let forward = glam::DVec2::new(to.heading.sin(), to.heading.cos());
        let ahead = (to.position - from.position).dot(forward);
        let stride = (ahead / 1.2).clamp(0.0, 1.0);
        let land = lift + swing;
        let is_run = gait.duty < 0.5;
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
                    fast(lift)
                } else {
                    (lift, lift + 0.1 * swing)
                },
                arrive: if is_run {
                    fast(land)
                } else {
                    (land - 0.3 * swing, land)
                },
                ramps: if is_run { [0.28, 0.28] } else { [0.36, 0.33] },
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

    fn leap(&self, foot: &mut Foot, side: Side, jump: &Jump) {
        let (from, flight) = (foot.last_print(), jump.landing - jump.takeoff);
        let swing = Swing {
            heel_off: jump.takeoff - 0.22,
            lift: jump.takeoff,
            peak: jump.takeoff + 0.2 * flight,
            land: jump.landing,
            flat: jump.landing + 0.1,
            from,
            to: self.home(side, jump.landing),
            leave: fast(jump.takeoff),
            arrive: fast(jump.landing),
            ramps: [0.14, 0.14],
            height: 0.9 * super::gait::GRAVITY * flight * flight / 8.0,
            detour: 0.0,
            toe_off: 0.75,
            touch_down: 0.0,
        };
        foot.swings.push(self.cleared(side, swing));
    }

    /// The swing with its arc raised until heel, ball and toes clear the ground.
    fn cleared(&self, side: Side, mut swing: Swing) -> Swing {
        let sole = &self.soles[side.index()];
        for _ in 0..20 {
            let foot = Foot {
                first: swing.from,
                swings: vec![swing],
            };
            let at = |i: usize| swing.lift + (swing.land - swing.lift) * (0.15 + 0.7 * i as f64 / 15.0);
            let lowest = (0..16)
                .map(|i| foot.at(at(i), sole).clearance)
                .fold(f32::INFINITY, f32::min);
            if lowest > 0.008 {
                break;
            }
            swing.height += 0.01;
        }
        swing
    }
}

/// The moment around which a leg in a hurry takes up its weight, or gives it up, seconds.
fn fast(contact: f64) -> (f64, f64) {
    (contact - 0.03, contact + 0.03)
}

/// Middle of the stance that follows a swing from `lift` on.
fn middle_of_stance(lift: f64, gait: Gait) -> f64 {
    lift + (1.0 - 0.5 * gait.duty) / gait.stride_hz
}
