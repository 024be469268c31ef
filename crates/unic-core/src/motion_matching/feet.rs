//! Foot locking: a foot that stands stays where it is, and its leg follows by inverse kinematics.

use super::{
    root::horizontal,
    spring::{Moving, Spring},
};
use crate::{
    leg::{FootTarget, Leg},
    skeleton::{Pose, Skeleton},
    transform::Rigid,
};
use glam::{Vec2, Vec3};
use serde::{Deserialize, Serialize};

/// One foot's hold on the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FootHold {
    /// The toe is where the animation has it, but for an offset (x, z) in metres that decays.
    Free(Moving<Vec2>),
    /// The toe stands at this place (x, z), metres.
    Locked(Vec2),
}

/// State of one foot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootState {
    /// Hold on the ground.
    pub hold: FootHold,
    /// Height by which a foot is lifted that has to move while it stands in its frame, metres.
    lift: Moving<f32>,
    /// Toe of the animation in the last tick (x, z), metres.
    animated: Vec2,
    /// Toe of the output in the last tick (x, z), metres.
    shown: Vec2,
}

/// Limits of foot locking.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootRules {
    /// Distance of a locked toe from the animation's at which it is torn off, metres.
    pub(super) unlock_radius_m: f32,
    /// Speed of the shown toe up to which it may be locked, m/s.
    pub(super) lock_speed_m_s: f32,
    /// Height of the toe above its rest height up to which it may be locked, metres.
    pub(super) lock_height_m: f32,
    /// Spring of the offset after release.
    pub(super) spring: Spring,
    /// Spring of the lift.
    pub(super) lift_spring: Spring,
}

/// Motion of one foot in the animation, in one tick.
#[derive(Clone, Copy, Debug)]
pub(super) struct FootTick {
    pub(super) leg: Leg,
    /// Whether the foot stands in the frame that plays.
    pub(super) contact: Contact,
    /// Height of the toe joint of a flat foot, metres.
    pub(super) rest_height_m: f32,
    pub(super) dt: f32,
}

/// Whether a foot stands in the frame that plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Contact {
    Stands,
    Swings,
}

impl Default for FootState {
    fn default() -> Self {
        Self {
            hold: FootHold::Free(Moving::default()),
            lift: Moving::default(),
            animated: Vec2::ZERO,
            shown: Vec2::ZERO,
        }
    }
}

impl FootState {
    /// Starts with a toe where the animation has it.
    pub(super) fn start(toe: Vec3) -> Self {
        Self {
            animated: horizontal(toe),
            shown: horizontal(toe),
            ..Self::default()
        }
    }

    /// Returns whether all numbers are finite.
    pub(super) fn is_finite(&self) -> bool {
        let is_hold_finite = match self.hold {
            FootHold::Free(o) => o.value.is_finite() && o.rate.is_finite(),
            FootHold::Locked(at) => at.is_finite(),
        };
        let is_lift_finite = self.lift.value.is_finite() && self.lift.rate.is_finite();
        is_hold_finite && is_lift_finite && self.animated.is_finite() && self.shown.is_finite()
    }

    /// Decides where the toe is shown, and bends the leg to it. `world` holds the forward
    /// kinematics of `pose`.
    pub(super) fn advance(
        &mut self,
        tick: &FootTick,
        rules: &FootRules,
        skeleton: &Skeleton,
        pose: &mut Pose,
        world: &[Rigid],
    ) {
        let toe = world[tick.leg.toe].translation;
        self.decide(tick, rules, toe, reach(&tick.leg, world));
        let before = self.shown;
        self.animated = horizontal(toe);
        self.shown = match self.hold {
            FootHold::Free(offset) => horizontal(toe) + offset.value,
            FootHold::Locked(at) => at,
        };
        let speed = (self.shown - before).length() / tick.dt;
        self.lift = rules
            .lift_spring
            .toward(self.lift, self.wanted_lift(tick, speed), tick.dt);
        self.show(tick.leg, tick.rest_height_m, skeleton, pose, world);
    }

    /// Height to which a foot is lifted: a foot steps to its place rather than sliding there.
    fn wanted_lift(&self, tick: &FootTick, speed: f32) -> f32 {
        let seconds = match (self.hold, tick.contact) {
            (FootHold::Locked(_), _) => 0.0,
            (FootHold::Free(_), Contact::Stands) => LIFT_S,
            (FootHold::Free(_), Contact::Swings) => CLEARANCE_S,
        };
        (speed * seconds).min(MOST_LIFT_M)
    }

    /// Bends a leg such that its toe is where it was decided to be, and not below the ground.
    pub(super) fn show(
        &self,
        leg: Leg,
        rest_height_m: f32,
        skeleton: &Skeleton,
        pose: &mut Pose,
        world: &[Rigid],
    ) {
        let (ankle, toe) = (world[leg.ankle].translation, world[leg.toe].translation);
        let shift = self.shown - horizontal(toe);
        let height = toe.y.max(rest_height_m + self.lift.value.max(0.0));
        let shift = Vec3::new(shift.x, height - toe.y, shift.y);
        // A leg that is almost straight moves its knee far for a small shift of the foot.
        let shift = match self.hold {
            FootHold::Free(_) => softened(&leg, world, shift),
            FootHold::Locked(_) => shift,
        };
        let target = FootTarget {
            ankle: ankle + shift,
            toe: toe + shift,
        };
        leg.reach(skeleton, pose, world, target);
    }

    /// Advances the hold. `reach` is where the toe may be: its centre and radius.
    fn decide(&mut self, tick: &FootTick, rules: &FootRules, toe: Vec3, reach: (Vec3, f32)) {
        self.hold = match self.hold {
            FootHold::Locked(at) => {
                let target = Vec3::new(at.x, toe.y.max(tick.rest_height_m), at.y);
                let is_near = at.distance(horizontal(toe)) < rules.unlock_radius_m;
                match tick.contact {
                    Contact::Stands if is_near && target.distance(reach.0) < reach.1 => FootHold::Locked(at),
                    _ => FootHold::Free(self.released(tick, rules, at, toe)),
                }
            }
            FootHold::Free(offset) => {
                let offset = rules.spring.decay(offset, tick.dt);
                let at = horizontal(toe) + offset.value;
                let is_slow = at.distance(self.shown) < rules.lock_speed_m_s * tick.dt;
                let is_low = toe.y.max(tick.rest_height_m + self.lift.value) - tick.rest_height_m
                    < rules.lock_height_m;
                match tick.contact {
                    // Locked where it was shown last, so that it stands from this tick on.
                    Contact::Stands if is_slow && is_low => FootHold::Locked(self.shown),
                    _ => FootHold::Free(offset),
                }
            }
        };
    }

    /// Offset of a foot that leaves its place in this tick. The shown toe leaves at rest, so the
    /// offset moves against the animation.
    fn released(&self, tick: &FootTick, rules: &FootRules, at: Vec2, toe: Vec3) -> Moving<Vec2> {
        let velocity = (horizontal(toe) - self.animated) * (1.0 / tick.dt);
        let offset = Moving {
            value: at - self.animated,
            rate: -velocity,
        };
        rules.spring.decay(offset, tick.dt)
    }
}

/// Lift by the speed of a foot that stands in its frame, seconds.
const LIFT_S: f32 = 0.08;
/// Least height by the speed of a swinging foot, seconds: people clear the ground by one to two
/// centimetres. The blend of two steps is lower than both.
const CLEARANCE_S: f32 = 0.015;
/// Largest lift, metres.
const MOST_LIFT_M: f32 = 0.05;

/// Shortens a shift of the foot that stretches the leg: its length approaches the straight leg's
/// smoothly. Legs that the animation stretches farther stay as they are.
fn softened(leg: &Leg, world: &[Rigid], shift: Vec3) -> Vec3 {
    let [hip, knee, ankle] = [leg.hip, leg.knee, leg.ankle].map(|j| world[j].translation);
    let straight = (knee.distance(hip) + ankle.distance(knee)) * MOST_STRETCH;
    let free = ankle.distance(hip).max(straight * FREE_STRETCH);
    let wanted = ankle + shift - hip;
    let (length, room) = (wanted.length(), straight - free);
    if length <= free || room <= 0.0 {
        return shift;
    }
    let soft = free + room * (1.0 - (-(length - free) / room).exp());
    hip + wanted * (soft / length) - ankle
}

/// Share of its length to which a leg is stretched at most.
const MOST_STRETCH: f32 = 0.995;
/// Share of that length up to which a foot is shifted freely.
const FREE_STRETCH: f32 = 0.96;

/// Returns where the toe may be with the foot turned as it is: the centre and radius of a sphere.
fn reach(leg: &Leg, world: &[Rigid]) -> (Vec3, f32) {
    let [hip, knee, ankle, toe] = [leg.hip, leg.knee, leg.ankle, leg.toe].map(|j| world[j].translation);
    let length = (knee.distance(hip) + ankle.distance(knee)) * MOST_STRETCH;
    (hip + (toe - ankle), length)
}
