//! Choice of the frame that plays.

use super::{Controller, SearchOutcome};
use crate::motion_matching::{
    command::{Command, Facing},
    database::Database,
    root::{RootFrame, wrapped, yaw_of},
    search::{Continuing, Match, Query},
    state::ControllerState,
};
use std::sync::Arc;

/// Largest rate of a steady turn of the commands, rad/s. A faster one is a new direction.
const STEADY_TURN_RAD_S: f32 = 6.0;
/// Time constant of the estimate of the turn rate, seconds.
const TURN_TIME_S: f32 = 0.0935;

impl Controller {
    /// Estimates the rate at which the commands turn.
    pub(super) fn follow_turn(&mut self, command: &Command) {
        let (before, after) = (self.state.command.velocity, command.velocity);
        let has_direction = before.length().min(after.length()) > 0.1;
        let rate = wrapped(yaw_of(after) - yaw_of(before)) * self.database.fps;
        self.state.turn_rate = match has_direction && rate.abs() < STEADY_TURN_RAD_S {
            true => {
                let share = 1.0 - (-1.0 / (TURN_TIME_S * self.database.fps)).exp();
                self.state.turn_rate + (rate - self.state.turn_rate) * share
            }
            // A new direction is not a turn that goes on.
            false => 0.0,
        };
    }

    pub(super) fn search_if_due(&mut self, command: &Command) -> SearchOutcome {
        let database = Arc::clone(&self.database);
        let state = &self.state;
        let goes_on = self.goes_on();
        let is_due = state.ticks_since_search >= database.frames_in(self.settings.search_interval_s) as u32;
        if goes_on && !is_due && !self.is_forced(command) {
            self.state.ticks_since_search += 1;
            self.state.frame += 1;
            return SearchOutcome::NotDue;
        }
        self.fill_query(command);
        let continuing = goes_on.then_some(Continuing {
            frame: self.state.frame,
            bias: self.settings.continuing_bias,
        });
        let found = self.search(continuing);
        self.state.ticks_since_search = 1;
        self.state.searched_command = *command;
        let outcome = match found {
            Some(found) if found.frame != self.state.frame => {
                let (from, to) = (self.state.frame, found.frame);
                self.state.offset.switch(&database, &self.state.root, from, to);
                self.state.frame = to;
                SearchOutcome::Switched
            }
            _ => SearchOutcome::Continued,
        };
        // Without any match a clip's last frame is held.
        let end = database.clip_of(self.state.frame).end();
        self.state.frame = (self.state.frame + 1).min(end - 1);
        outcome
    }

    /// Returns whether the clip has a next frame that the tags accept.
    fn goes_on(&self) -> bool {
        let next = self.state.frame + 1;
        next < self.database.clip_of(self.state.frame).end()
            && self.state.tags.accepts(self.database.tags(next))
    }

    /// Has the command changed much since the last search?
    fn is_forced(&self, command: &Command) -> bool {
        let last = &self.state.searched_command;
        let has_turned = match (command.facing, last.facing) {
            (Facing::Yaw(now), Facing::Yaw(last)) => {
                wrapped(now - last).abs() > self.settings.forcing_yaw_rad
            }
            (Facing::Travel, Facing::Travel) => false,
            (Facing::Yaw(_), Facing::Travel) | (Facing::Travel, Facing::Yaw(_)) => true,
        };
        let velocity = (command.velocity - last.velocity).length();
        has_turned || velocity > self.settings.forcing_velocity_m_s
    }

    /// Writes the features of the frame that plays and of the trajectory that is asked for.
    pub(super) fn fill_query(&mut self, command: &Command) {
        let Self {
            database,
            state,
            scratch,
            ..
        } = self;
        let springs = self.settings.object_springs();
        let dt = 1.0 / database.fps;
        (state.object).predict(&springs, command, state.turn_rate, dt, &mut scratch.future);
        scratch.features.clear();
        scratch.features.extend(database.index.row(state.frame));
        for (first, feature) in database.offsets() {
            let out = &mut scratch.features[first..first + feature.len()];
            if feature.joint().is_some() {
                continue;
            }
            let at = |seconds: f32| root_at(database, state, &scratch.future, seconds);
            feature.write_trajectory(&state.root, at, out);
            let (means, scales) = (&database.scale.means[first..], &database.scale.scales[first..]);
            for ((x, mean), scale) in out.iter_mut().zip(means).zip(scales) {
                *x = (*x - mean) * scale;
            }
        }
    }

    pub(super) fn search(&mut self, continuing: Option<Continuing>) -> Option<Match> {
        let around = self.database.frames_in(self.settings.window_s);
        let frame = self.state.frame;
        let query = Query {
            features: &self.scratch.features,
            tags: self.state.tags,
            // Without a frame that goes on, the clip's end is left out by the index.
            window: match continuing {
                Some(_) => frame.saturating_sub(around)..frame + around + 1,
                None => 0..0,
            },
            continuing,
        };
        self.database.search(&query, &mut self.scratch.search)
    }
}

/// Root frame of the query at a time from now, seconds.
fn root_at(database: &Database, state: &ControllerState, future: &[RootFrame], seconds: f32) -> RootFrame {
    let frames = database.frames_in(seconds.abs());
    match seconds < 0.0 && frames > 0 {
        true => state.past[state.past.len().saturating_sub(frames)],
        false => future[frames.min(future.len() - 1)],
    }
}
