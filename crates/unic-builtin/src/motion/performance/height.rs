//! How high the pelvis rides.

use super::{Performance, State};
use crate::motion::{
    channel::{Channel, Side},
    curve::Track,
    path::on_ground,
};

/// Share of the straight leg that a standing leg spans: knees are never locked.
const STANDING_REACH: f64 = 0.990;

/// The most that a leg on the ground spans in a walk.
const WALKING_REACH: f64 = 0.993;

/// The most that it spans in a run, where knees land and leave bent.
const RUNNING_REACH: f64 = 0.978;

/// The pelvis sinks this much below standing height for a walk at 1 m/s, metres.
const WALKING_DROP: f64 = 0.010;

/// Likewise for a run.
const RUNNING_DROP: f64 = 0.035;

impl Performance {
    /// Height of the pelvis that the steps allow: as high as for standing, no higher than the legs
    /// on the ground reach.
    pub(super) fn height_track(&self) -> Track {
        let run = |t: f64| {
            self.rig
                .stature
                .running_weight(self.script.gestures.at(Channel::Speed, t))
        };
        let wish = |t: f64| self.wished_height(&self.state(t));
        let raw = Track::sample(self.script.seconds, wish);
        let walking = raw.clone().eroded(0.075).smoothed(0.075);
        // A run's rise and fall is that of its flights: between them the height hardly changes.
        let running = raw.eroded(0.30).smoothed(0.30);
        Track::sample(self.script.seconds, |t| {
            let weight = run(t);
            walking.at(t) * (1.0 - weight) + running.at(t) * weight
        })
    }

    fn wished_height(&self, state: &State) -> f64 {
        let drop = WALKING_DROP * (state.speed + 0.3 * state.turn_rate.abs()).min(1.4) * (1.0 - state.run)
            + RUNNING_DROP * state.run;
        let crouch = self.channel(Channel::Crouch, state).max(0.0);
        let standing = self.standing_height() - drop - crouch;
        let flight = self.tracks.flight.at(state.t);
        (Side::BOTH.into_iter())
            .filter(|side| self.feet[side.index()].is_planted(state.t))
            .map(|side| self.reachable(state, side) - flight)
            .fold(standing, f64::min)
    }

    fn standing_height(&self) -> f64 {
        let stature = &self.rig.stature;
        let ankle = self.rig.soles[0].ankle.y.min(self.rig.soles[1].ankle.y);
        STANDING_REACH * stature.leg + f64::from(ankle - self.rig.hip(Side::Left).y)
    }

    /// Highest pelvis from which one leg reaches its ankle.
    fn reachable(&self, state: &State, side: Side) -> f64 {
        let i = side.index();
        let foot = self.feet[i].at(state.t, &self.rig.soles[i]);
        let hip = self.pelvis(state) * self.rig.hip(side);
        let below = on_ground(self.ground_point(state), 0.0) + hip;
        let away = f64::from((foot.ankle - below).with_y(0.0).length());
        let share = WALKING_REACH + (RUNNING_REACH - WALKING_REACH) * state.run;
        let reach = share * self.rig.stature.leg;
        let rise = (reach * reach - away * away).max(0.0).sqrt();
        f64::from(foot.ankle.y - hip.y) + rise
    }
}
