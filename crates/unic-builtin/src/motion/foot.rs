//! One foot over time: locked to the ground, rolling over heel and ball, or swinging to the next print.

use super::{
    curve::{arc, step_between, travel},
    path::on_ground,
    sole::Sole,
};
use glam::{DVec2, Quat, Vec3};

/// Where a foot stands: the ground point below its ankle when the foot is flat, and its direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Print {
    pub(super) position: DVec2,
    /// Angle about +Y from +Z, radians.
    pub(super) heading: f64,
}

/// From one print to the next. The foot is off the ground from `lift` to `land`; its heel rises from
/// `heel_off` on, and its sole is flat again at `flat`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Swing {
    pub(super) heel_off: f64,
    pub(super) lift: f64,
    /// When the heel is highest above the toes.
    pub(super) peak: f64,
    pub(super) land: f64,
    pub(super) flat: f64,
    pub(super) from: Print,
    pub(super) to: Print,
    /// When the leg goes over from carrying weight to swinging: a leg that swings yields sooner.
    pub(super) leave: (f64, f64),
    /// And when it goes back.
    pub(super) arrive: (f64, f64),
    /// Shares of the swing in which the foot gathers speed and loses it.
    pub(super) ramps: [f64; 2],
    /// Height of the arc, metres.
    pub(super) height: f64,
    /// Sideways detour around the other foot, metres to the left of the foot's direction.
    pub(super) detour: f64,
    /// Pitch of the sole behind the ball at `peak`, radians, heel up.
    pub(super) toe_off: f64,
    /// Pitch of the sole at `land`, radians, toes up.
    pub(super) touch_down: f64,
}

/// Prints and swings of one foot, by time.
#[derive(Clone, Debug)]
pub(super) struct Foot {
    pub(super) first: Print,
    pub(super) swings: Vec<Swing>,
}

/// A foot at one time; world space, metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootPose {
    /// The ankle joint.
    pub(super) ankle: Vec3,
    /// Rotation of the foot from the bind pose.
    pub(super) foot: Quat,
    /// Rotation of the toes from the bind pose.
    pub(super) toes: Quat,
    /// Direction of the foot on the ground, radians.
    pub(super) heading: f64,
    /// Lowest point of heel, ball and toe above the ground.
    pub(super) clearance: f32,
    /// One in the air, zero on the ground, smooth between.
    pub(super) airborne: f32,
}

impl Foot {
    /// Where the foot stands, or will stand when it lands.
    pub(super) fn last_print(&self) -> Print {
        self.swings.last().map_or(self.first, |s| s.to)
    }

    /// When the foot landed last.
    pub(super) fn last_landing(&self) -> f64 {
        self.swings.last().map_or(f64::NEG_INFINITY, |s| s.land)
    }

    /// Whether any part of the foot carries weight.
    pub(super) fn is_planted(&self, t: f64) -> bool {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        begun.checked_sub(1).is_none_or(|i| self.swings[i].land <= t)
    }

    /// Direction, ground point and height of the sole, were it flat.
    pub(super) fn base(&self, t: f64) -> (Print, f64) {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        match begun.checked_sub(1) {
            None => (self.first, 0.0),
            Some(i) => self.swings[i].base(t),
        }
    }

    pub(super) fn at(&self, t: f64, sole: &Sole) -> FootPose {
        let begun = self.swings.partition_point(|s| s.lift <= t);
        let near = &self.swings[begun.saturating_sub(1)..(begun + 1).min(self.swings.len())];
        let sum = |f: fn(&Swing, f64) -> f64| near.iter().map(|s| f(s, t)).sum::<f64>();
        let (heel_up, toe_up) = (sum(Swing::heel_up), sum(Swing::toe_up));
        let roll = Roll {
            pitch: (toe_up - heel_up) as f32,
            toes: (toe_up - sum(Swing::toes_straight)) as f32,
            heel_share: sum(Swing::heel_share) as f32,
        };
        let (print, height) = self.base(t);
        FootPose {
            airborne: sum(Swing::airborne) as f32,
            ..roll.place(print, height, sole)
        }
    }
}

impl Swing {
    fn share(&self, t: f64) -> f64 {
        ((t - self.lift) / (self.land - self.lift)).clamp(0.0, 1.0)
    }

    fn base(&self, t: f64) -> (Print, f64) {
        let u = self.share(t);
        let s = travel(u, self.ramps);
        let heading = self.from.heading + (self.to.heading - self.from.heading) * s;
        let left = DVec2::new(heading.cos(), -heading.sin());
        let straight = self.from.position.lerp(self.to.position, s);
        let print = Print {
            position: straight + left * (self.detour * arc(u, self.ramps)),
            heading,
        };
        (print, self.height * arc(u, self.ramps))
    }

    fn airborne(&self, t: f64) -> f64 {
        let [leave, arrive] = [self.leave, self.arrive];
        step_between(t, leave.0, leave.1) - step_between(t, arrive.0, arrive.1)
    }

    /// Pitch of the sole, heel up.
    fn heel_up(&self, t: f64) -> f64 {
        let rise = step_between(t, self.heel_off, self.peak);
        self.toe_off * (rise - self.recovery(t))
    }

    /// Pitch of the sole, toes up.
    fn toe_up(&self, t: f64) -> f64 {
        self.touch_down * (self.recovery(t) - step_between(t, self.land, self.flat))
    }

    /// Share of the heel's pitch that the toes follow once they are off the ground.
    fn toes_straight(&self, t: f64) -> f64 {
        let middle = self.lift + 0.5 * (self.land - self.lift);
        0.7 * self.heel_up(t) * step_between(t, self.lift, middle)
    }

    fn recovery(&self, t: f64) -> f64 {
        step_between(t, self.peak, self.land)
    }

    /// One when the foot turns about its heel, zero when about its ball.
    fn heel_share(&self, t: f64) -> f64 {
        let longest = self.flat + (self.flat - self.land);
        step_between(t, self.lift, self.land) - step_between(t, self.flat, longest)
    }
}

/// How a foot is tilted over its print.
struct Roll {
    /// Of the sole, radians, toes up positive.
    pitch: f32,
    /// Of the toes, likewise.
    toes: f32,
    heel_share: f32,
}

impl Roll {
    fn place(&self, print: Print, height: f64, sole: &Sole) -> FootPose {
        let yaw = Quat::from_rotation_y(print.heading as f32);
        let tilt = Quat::from_rotation_x(-self.pitch);
        let toe_tilt = Quat::from_rotation_x(-self.toes);
        let pivot = sole.ball.lerp(sole.heel, self.heel_share.clamp(0.0, 1.0));
        let origin = on_ground(print.position, height);
        let tilted = |point: Vec3| pivot + tilt * (point - pivot);
        let ball = tilted(sole.ball);
        // The flat of the ball and the tip of the toes belong to the toes.
        let below_ball = ball - Vec3::Y * sole.ball.y;
        let tip = ball + toe_tilt * (sole.toe - sole.ball);
        let lowest = tilted(sole.heel).y.min(below_ball.y).min(tip.y);
        FootPose {
            ankle: origin + yaw * tilted(sole.ankle),
            foot: yaw * tilt,
            toes: yaw * toe_tilt,
            heading: print.heading,
            clearance: lowest + height as f32,
            airborne: 0.0,
        }
    }
}
