//! Height of the pelvis.

use super::{BodyState, Performance};
use crate::motion::{Side, channel::Channel, curve::Track, path::on_ground};

/// Distance from hip to ankle in a stand, as a share of the leg's length: knees are never locked.
const STANDING_REACH: f64 = 0.990;

/// Largest distance from hip to ankle of a leg on the ground in a walk, as a share of its length.
const WALKING_REACH: f64 = 0.993;

/// Largest such share in a run, where knees are bent at landing and takeoff.
const RUNNING_REACH: f64 = 0.978;

/// Descent of the pelvis below its standing height in a walk at 1 m/s, metres.
const WALKING_DROP: f64 = 0.010;

/// Descent of the pelvis below its standing height in a run, metres.
const RUNNING_DROP: f64 = 0.035;

/// Half width of the filters on the height in a walk, seconds: a fraction of a step.
const WALKING_FILTER_S: f64 = 0.075;

/// Half width of the filters on the height in a run, seconds: about a step.
const RUNNING_FILTER_S: f64 = 0.30;

impl Performance {
    /// Height of the pelvis over time without the motion of flights: as high as in a stand, but no
    /// higher than the legs on the ground reach.
    pub(super) fn height_track(&self) -> Track {
        let run = |t: f64| {
            self.rig
                .stature
                .running_weight(self.script.gestures.at(Channel::Speed, t))
        };
        let wish = |t: f64| self.wished_height(&self.state(t));
        let raw = Track::sample(self.script.seconds, wish);
        // The minimum filter before the smoothing keeps the result below the limit of the legs.
        let walking = raw.clone().eroded(WALKING_FILTER_S).smoothed(WALKING_FILTER_S);
        // A run's rise and fall is that of its flights: between them the height hardly changes.
        let running = raw.eroded(RUNNING_FILTER_S).smoothed(RUNNING_FILTER_S);
        Track::sample(self.script.seconds, |t| {
            let weight = run(t);
            walking.at(t) * (1.0 - weight) + running.at(t) * weight
        })
    }

    /// Height of the pelvis joint at one time before filtering, metres.
    fn wished_height(&self, state: &BodyState) -> f64 {
        let drop = WALKING_DROP * (state.speed + 0.3 * state.turn_rate.abs()).min(1.4) * (1.0 - state.run)
            + RUNNING_DROP * state.run;
        let crouch = self.channel(Channel::Crouch, state).max(0.0);
        let standing = self.standing_height() - drop - crouch;
        // The motion of flights is added to the track later: it must leave room for that.
        let flight = self.tracks.flight.at(state.t);
        (Side::BOTH.into_iter())
            .filter(|side| self.feet[side.index()].is_planted(state.t))
            .map(|side| self.reachable(state, side) - flight)
            .fold(standing, f64::min)
    }

    /// Height of the pelvis joint in a stand, metres.
    fn standing_height(&self) -> f64 {
        let stature = &self.rig.stature;
        let ankle = self.rig.soles[0].ankle.y.min(self.rig.soles[1].ankle.y);
        STANDING_REACH * stature.leg + f64::from(ankle - self.rig.hip(Side::Left).y)
    }

    /// Largest height of the pelvis joint from which one leg reaches its ankle, metres.
    fn reachable(&self, state: &BodyState, side: Side) -> f64 {
        let i = side.index();
        let foot = self.feet[i].at(state.t, &self.rig.soles[i]);
        let hip = self.pelvis(state) * self.rig.hip(side);
        let below = on_ground(self.ground_point(state), 0.0) + hip;
        let away = f64::from((foot.ankle - below).with_y(0.0).length());
        let share = WALKING_REACH + (RUNNING_REACH - WALKING_REACH) * state.run;
        let reach = share * self.rig.stature.leg;
        // Pythagoras; zero where the ankle is out of reach at any height.
        let rise = (reach * reach - away * away).max(0.0).sqrt();
        f64::from(foot.ankle.y - hip.y) + rise
    }
}
