//! Motion of one foot: locked to the ground, rolling over heel and ball, or swinging.

use super::{
    channel::Interval,
    curve::{Easing, arc, step_between, travel},
    path::on_ground,
    sole::Sole,
};
use glam::{DVec2, Quat, Vec3};

/// Place and direction of a foot that stands flat on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Footprint {
    /// Ground point below the ankle (world x, z), metres.
    pub(super) position: DVec2,
    /// Angle about +Y from +Z, radians.
    pub(super) heading: f64,
}

/// Footprint raised above the ground: the place of a foot whose sole is level.
#[derive(Clone, Copy, Debug)]
pub(super) struct RaisedFootprint {
    pub(super) footprint: Footprint,
    /// Height of the sole above the ground, metres.
    pub(super) height: f64,
}

/// Movement of a foot from one footprint to the next. Times are in seconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swing {
    /// Time at which the heel begins to rise.
    pub(super) heel_off: f64,
    /// Time at which the foot leaves the ground.
    pub(super) lift: f64,
    /// Time at which the heel is highest above the toes.
    pub(super) peak: f64,
    /// Time at which the foot touches the ground again.
    pub(super) land: f64,
    /// Time at which the sole is flat on the ground again.
    pub(super) flat: f64,
    pub(super) from: Footprint,
    pub(super) to: Footprint,
    /// Transition of the leg from stance to swing, see [`FootPose::airborne`].
    pub(super) leave: Interval,
    /// Transition of the leg from swing to stance.
    pub(super) arrive: Interval,
    /// Shares of the swing in which the foot speeds up and slows down.
    pub(super) easing: Easing,
    /// Height of the arc, metres.
    pub(super) height: f64,
    /// Sideways detour around the other foot, metres to the left of the foot's direction.
    pub(super) detour: f64,
    /// Pitch of the sole behind the ball at `peak`, radians, heel up.
    pub(super) toe_off: f64,
    /// Pitch of the sole at `land`, radians, toes up.
    pub(super) touch_down: f64,
}

/// Footprints and swings of one foot, by time.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    /// Footprint before the first swing.
    pub(super) first: Footprint,
    pub(super) swings: Vec<Swing>,
}

/// Pose of a foot at one time; world space, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootPose {
    /// Position of the ankle joint.
    pub(super) ankle: Vec3,
    /// Rotation of the foot from the bind pose.
    pub(super) foot: Quat,
    /// Rotation of the toes from the bind pose.
    pub(super) toes: Quat,
    /// Direction of the foot on the ground, radians.
    pub(super) heading: f64,
    /// Height of the lowest point of heel, ball and toe above the ground.
    pub(super) clearance: f32,
    /// One in the swing phase, zero in the stance phase, smooth between. A swinging leg bends
    /// sooner.
    pub(super) airborne: f32,
}

impl Foot {
    /// Footprint on which the foot stands, or will stand after the last swing.
    pub(super) fn last_footprint(&self) -> Footprint {
        self.swings.last().map_or(self.first, |s| s.to)
    }

    /// Time of the last landing, seconds.
    pub(super) fn last_landing(&self) -> f64 {
        // A foot that has never swung landed long ago, in every comparison.
        self.swings.last().map_or(f64::NEG_INFINITY, |s| s.land)
    }

    /// Returns true while any part of the foot carries weight.
    pub(super) fn is_planted(&self, t: f64) -> bool {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        begun.checked_sub(1).is_none_or(|i| self.swings[i].land <= t)
    }

    /// Place of the foot at a time, before it tilts about heel or ball.
    pub(super) fn base(&self, t: f64) -> RaisedFootprint {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        match begun.checked_sub(1) {
            None => RaisedFootprint {
                footprint: self.first,
                height: 0.0,
            },
            Some(i) => self.swings[i].base(t),
        }
    }

    /// Pose of the foot at a time in seconds.
    pub(super) fn at(&self, t: f64, sole: &Sole) -> FootPose {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        // The swing before still flattens the sole while the next one already raises the heel; all
        // other swings contribute zero.
        let near = &self.swings[begun.saturating_sub(1)..(begun + 1).min(self.swings.len())];
        let sum = |f: fn(&Swing, f64) -> f64| near.iter().map(|s| f(s, t)).sum::<f64>();
        let (heel_up, toe_up) = (sum(Swing::heel_up), sum(Swing::toe_up));
        let tilt = SoleTilt {
            pitch: (toe_up - heel_up) as f32,
            toes: (toe_up - sum(Swing::toes_straight)) as f32,
            heel_share: sum(Swing::heel_share) as f32,
        };
        FootPose {
            airborne: sum(Swing::airborne) as f32,
            ..tilt.place(self.base(t), sole)
        }
    }
}

impl Swing {
    /// Share of the time in the air that has passed, 0 to 1.
    fn share(&self, t: f64) -> f64 {
        ((t - self.lift) / (self.land - self.lift)).clamp(0.0, 1.0)
    }

    fn base(&self, t: f64) -> RaisedFootprint {
        let u = self.share(t);
        let s = travel(u, self.easing);
        let heading = self.from.heading + (self.to.heading - self.from.heading) * s;
        let left = DVec2::new(heading.cos(), -heading.sin());
        let straight = self.from.position.lerp(self.to.position, s);
        RaisedFootprint {
            footprint: Footprint {
                position: straight + left * (self.detour * arc(u, self.easing)),
                heading,
            },
            height: self.height * arc(u, self.easing),
        }
    }

    fn airborne(&self, t: f64) -> f64 {
        let [leave, arrive] = [self.leave, self.arrive];
        step_between(t, leave.start, leave.end) - step_between(t, arrive.start, arrive.end)
    }

    /// Pitch of the sole about the ball, radians, heel up.
    fn heel_up(&self, t: f64) -> f64 {
        let rise = step_between(t, self.heel_off, self.peak);
        self.toe_off * (rise - self.recovery(t))
    }

    /// Pitch of the sole about the heel, radians, toes up.
    fn toe_up(&self, t: f64) -> f64 {
        self.touch_down * (self.recovery(t) - step_between(t, self.land, self.flat))
    }

    /// Pitch of the toes, radians: on the ground they stay flat, in the air they follow 70 % of the
    /// heel's pitch.
    fn toes_straight(&self, t: f64) -> f64 {
        let middle = self.lift + 0.5 * (self.land - self.lift);
        0.7 * self.heel_up(t) * step_between(t, self.lift, middle)
    }

    /// Progress from the toe-off pitch at `peak` (0) to the touch-down pitch at `land` (1).
    fn recovery(&self, t: f64) -> f64 {
        step_between(t, self.peak, self.land)
    }

    /// Position of the pivot: one at the heel, zero at the ball.
    fn heel_share(&self, t: f64) -> f64 {
        // Only after the sole is flat may the pivot move back to the ball without moving the foot.
        let longest = self.flat + (self.flat - self.land);
        step_between(t, self.lift, self.land) - step_between(t, self.flat, longest)
    }
}

/// Tilt of a foot over its footprint.
struct SoleTilt {
    /// Pitch of the sole, radians, toes up positive.
    pitch: f32,
    /// Pitch of the toes, radians, toes up positive.
    toes: f32,
    /// Position of the pivot: one at the heel, zero at the ball.
    heel_share: f32,
}

impl SoleTilt {
    /// Pose of the foot, tilted about its pivot.
    fn place(&self, base: RaisedFootprint, sole: &Sole) -> FootPose {
        let RaisedFootprint { footprint, height } = base;
        let yaw = Quat::from_rotation_y(footprint.heading as f32);
        let tilt = Quat::from_rotation_x(-self.pitch);
        let toe_tilt = Quat::from_rotation_x(-self.toes);
        let pivot = sole.ball.lerp(sole.heel, self.heel_share.clamp(0.0, 1.0));
        let origin = on_ground(footprint.position, height);
        let tilted = |point: Vec3| pivot + tilt * (point - pivot);
        let ball = tilted(sole.ball);
        // The ground contacts under the ball and at the toe tip move with the toes, not with the
        // foot.
        let below_ball = ball - Vec3::Y * sole.ball.y;
        let tip = ball + toe_tilt * (sole.toe - sole.ball);
        let lowest = tilted(sole.heel).y.min(below_ball.y).min(tip.y);
        FootPose {
            ankle: origin + yaw * tilted(sole.ankle),
            foot: yaw * tilt,
            toes: yaw * toe_tilt,
            heading: footprint.heading,
            clearance: lowest + height as f32,
            airborne: 0.0,
        }
    }
}
