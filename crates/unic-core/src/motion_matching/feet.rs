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
    /// The foot was torn off the ground. It moves as [`Free`](Self::Free) and does not stand again
    /// before it has been lifted.
    Torn(Moving<Vec2>),
    /// The toe stands at this place (x, z), metres.
    Locked(Vec2),
}

/// State of one foot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FootState {
    /// Hold on the ground.
    pub hold: FootHold,
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
}

/// What the animation does with one foot in a tick.
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
            FootHold::Free(o) | FootHold::Torn(o) => o.value.is_finite() && o.rate.is_finite(),
            FootHold::Locked(at) => at.is_finite(),
        };
        is_hold_finite && self.animated.is_finite() && self.shown.is_finite()
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
        self.animated = horizontal(toe);
        self.shown = match self.hold {
            FootHold::Free(offset) | FootHold::Torn(offset) => horizontal(toe) + offset.value,
            FootHold::Locked(at) => at,
        };
        self.show(tick.leg, tick.rest_height_m, skeleton, pose, world);
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
        let lift = (rest_height_m - toe.y).max(0.0);
        let shift = Vec3::new(shift.x, lift, shift.y);
        let target = FootTarget {
            ankle: ankle + shift,
            toe: toe + shift,
        };
        leg.reach(skeleton, pose, world, target);
    }

    /// Advances the hold. `reach` is where the toe may be: its centre and radius.
    fn decide(&mut self, tick: &FootTick, rules: &FootRules, toe: Vec3, reach: (Vec3, f32)) {
        let velocity = (horizontal(toe) - self.animated) * (1.0 / tick.dt);
        match self.hold {
            FootHold::Locked(at) => {
                let offset = at - horizontal(toe);
                let target = Vec3::new(at.x, toe.y.max(tick.rest_height_m), at.y);
                let is_torn = offset.length() > rules.unlock_radius_m || target.distance(reach.0) > reach.1;
                // The shown toe leaves at rest, so the offset moves against the animation.
                let released = Moving {
                    value: at - self.animated,
                    rate: -velocity,
                };
                let released = rules.spring.decay(released, tick.dt);
                match (tick.contact, is_torn) {
                    (Contact::Swings, _) => self.hold = FootHold::Free(released),
                    (Contact::Stands, true) => self.hold = FootHold::Torn(released),
                    (Contact::Stands, false) => {}
                }
            }
            FootHold::Torn(offset) => {
                let offset = rules.spring.decay(offset, tick.dt);
                self.hold = match tick.contact {
                    Contact::Stands => FootHold::Torn(offset),
                    Contact::Swings => FootHold::Free(offset),
                };
            }
            FootHold::Free(offset) => {
                let offset = rules.spring.decay(offset, tick.dt);
                let at = horizontal(toe) + offset.value;
                let is_slow = (at - self.shown).length() < rules.lock_speed_m_s * tick.dt;
                let is_low = toe.y - tick.rest_height_m < rules.lock_height_m;
                self.hold = match tick.contact {
                    // Locked where it was shown last, so that it stands from this tick on.
                    Contact::Stands if is_slow && is_low => FootHold::Locked(self.shown),
                    _ => FootHold::Free(offset),
                };
            }
        }
    }
}

/// Returns where the toe may be with the foot turned as it is: the centre and radius of a sphere.
fn reach(leg: &Leg, world: &[Rigid]) -> (Vec3, f32) {
    let [hip, knee, ankle, toe] = [leg.hip, leg.knee, leg.ankle, leg.toe].map(|j| world[j].translation);
    // Just below the length to which the solver stretches a leg.
    let length = (knee.distance(hip) + ankle.distance(knee)) * 0.998;
    (hip + (toe - ankle), length)
}
