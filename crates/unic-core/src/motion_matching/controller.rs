//! Controller: plays the frames of a database such that a character follows commands.

use super::{
    command::{Command, Facing},
    database::Database,
    features::Feature,
    feet::{Contact, FootHold, FootState, FootTick},
    index::SearchScratch,
    inertia::Velocities,
    root::{RootFrame, wrapped, yaw_of},
    search::{Continuing, Match, Query, TagFilter},
    settings::ControllerSettings,
    state::ControllerState,
};
use crate::{skeleton::Pose, transform::Rigid};
use glam::Quat;
use std::sync::Arc;
use thiserror::Error;

/// Character under control: a database that is shared, a state, and buffers.
///
/// A step is a tick of 1 / fps seconds of the database and allocates nothing.
#[derive(Clone, Debug)]
pub struct Controller {
    database: Arc<Database>,
    settings: ControllerSettings,
    tags: TagFilter,
    state: ControllerState,
    scratch: Scratch,
}

/// Buffers that can be rebuilt.
#[derive(Clone, Debug, Default)]
struct Scratch {
    features: Vec<f32>,
    future: Vec<RootFrame>,
    search: SearchScratch,
    pose: Pose,
    world: Vec<Rigid>,
}

/// Events of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StepReport {
    /// What the search did.
    pub search: SearchOutcome,
    /// Distance by which the root was moved towards the object beside its own motion, metres.
    pub adjusted_m: f32,
    /// Whether the distance to the object was at its limit.
    pub clamping: Clamping,
}

/// What a step's search did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum SearchOutcome {
    /// No search was due.
    #[default]
    NotDue,
    /// The frame that plays went on.
    Continued,
    /// Another frame plays now.
    Switched,
}

/// Whether the root was moved onto the limit of its distance to the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Clamping {
    /// It was within the limits.
    #[default]
    Within,
    /// It was moved.
    Clamped,
}

/// Error of a controller.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ControllerError {
    /// A saved state of another database.
    #[error("controller: expected {expected} as {what} of the state, found {found}")]
    State {
        /// Name of the number.
        what: &'static str,
        /// Number of the database.
        expected: usize,
        /// Number of the state.
        found: usize,
    },
    /// A state or a command with a number that is not finite.
    #[error("controller: expected finite numbers, found one that is not")]
    NotFinite,
    /// Tags that no frame has.
    #[error("controller: expected a frame with these tags, found none")]
    NoFrames,
}

impl Controller {
    /// Makes a controller, with the character at the origin, facing +Z.
    pub fn new(database: Arc<Database>, settings: ControllerSettings) -> Self {
        let root = RootFrame::default();
        let state = ControllerState::start(&database, 0, root, past_frames(&database));
        let mut controller = Self {
            database,
            settings,
            tags: TagFilter::default(),
            state,
            scratch: Scratch::default(),
        };
        controller.allocate();
        controller.reset(root);
        controller
    }

    /// Puts the character at rest, in the frame that suits standing best.
    pub fn reset(&mut self, root: RootFrame) {
        self.state = ControllerState::start(&self.database, 0, root, past_frames(&self.database));
        // Twice: the second search starts from a pose that stands.
        for _ in 0..2 {
            self.fill_query(&Command::STAND);
            if let Some(found) = self.search(None) {
                self.state.frame = found.frame;
            }
        }
        self.rebuild();
        let legs = self.database.settings.legs;
        let toes = legs.map(|leg| self.scratch.world[leg.toe].translation);
        self.state.feet = toes.map(FootState::start);
    }

    /// Database that is played.
    pub fn database(&self) -> &Arc<Database> {
        &self.database
    }

    /// Settings.
    pub fn settings(&self) -> &ControllerSettings {
        &self.settings
    }

    /// Replaces the settings from the next step on.
    pub fn set_settings(&mut self, settings: ControllerSettings) {
        self.settings = settings;
    }

    /// Restricts searches to frames with these tags from the next search on.
    ///
    /// # Errors
    /// Tags that no frame where a search may end has. The tags stay as they were.
    pub fn set_tags(&mut self, tags: TagFilter) -> Result<(), ControllerError> {
        let database = &self.database;
        let has =
            |frame: usize| database.index.is_searchable(frame) && tags.accepts(database.frames.tags[frame]);
        if !(0..database.len()).any(has) {
            return Err(ControllerError::NoFrames);
        }
        self.tags = tags;
        Ok(())
    }

    /// State after the last step.
    pub fn state(&self) -> &ControllerState {
        &self.state
    }

    /// Replaces the state by a saved one. Later steps give the same bytes as they gave after it.
    ///
    /// # Errors
    /// A state of another database. The current state stays.
    pub fn restore(&mut self, state: ControllerState) -> Result<(), ControllerError> {
        state.check(&self.database, past_frames(&self.database))?;
        self.state = state;
        self.rebuild();
        self.show_feet();
        Ok(())
    }

    /// Pose of the character as shown, in world space above ground height 0.
    pub fn pose(&self) -> &Pose {
        &self.scratch.pose
    }

    /// Normalised features of the last search.
    pub fn query(&self) -> &[f32] {
        &self.scratch.features
    }

    /// Advances by a tick.
    ///
    /// # Errors
    /// A command that is not finite. The state stays as it was.
    pub fn step(&mut self, command: &Command) -> Result<StepReport, ControllerError> {
        if !command.is_finite() {
            return Err(ControllerError::NotFinite);
        }
        self.follow_turn(command);
        let search = self.search_if_due(command);
        self.state.command = *command;
        let dt = 1.0 / self.database.fps;
        let springs = self.settings.object_springs();
        self.state.object.advance(&springs, command, dt);
        let (adjusted_m, clamping) = self.advance_root(dt);
        self.state.offset.decay(&self.settings.offset_springs(), dt);
        self.rebuild();
        self.advance_feet(dt);
        Ok(StepReport {
            search,
            adjusted_m,
            clamping,
        })
    }

    /// Estimates the rate at which the commands turn.
    fn follow_turn(&mut self, command: &Command) {
        let (before, after) = (self.state.command.velocity, command.velocity);
        let has_direction = before.length().min(after.length()) > 0.1;
        let angle = wrapped(yaw_of(after) - yaw_of(before));
        self.state.turn_rate = match has_direction && angle.abs() < STEADY_TURN_RAD {
            true => {
                let rate = angle * self.database.fps;
                self.state.turn_rate + (rate - self.state.turn_rate) * TURN_BLEND
            }
            // A new direction is not a turn that goes on.
            false => 0.0,
        };
    }

    fn search_if_due(&mut self, command: &Command) -> SearchOutcome {
        let database = Arc::clone(&self.database);
        let state = &self.state;
        let is_at_end = state.frame + 1 >= database.clip_of(state.frame).end();
        let is_due = state.ticks_since_search >= database.frames_in(self.settings.search_interval_s) as u32;
        if !(is_at_end || is_due || self.is_forced(command)) {
            self.state.ticks_since_search += 1;
            self.state.frame += 1;
            return SearchOutcome::NotDue;
        }
        self.fill_query(command);
        let continuing = (!is_at_end).then_some(Continuing {
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

    /// Has the command changed much since the last search?
    fn is_forced(&self, command: &Command) -> bool {
        let last = &self.state.searched_command;
        let yaw = |c: &Command| match c.facing {
            Facing::Yaw(yaw) => yaw,
            Facing::Travel => 0.0,
        };
        let velocity = (command.velocity - last.velocity).length();
        let turn = wrapped(yaw(command) - yaw(last)).abs();
        velocity > self.settings.forcing_velocity_m_s || turn > self.settings.forcing_yaw_rad
    }

    /// Writes the features of the frame that plays and of the trajectory that is asked for.
    fn fill_query(&mut self, command: &Command) {
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

    fn search(&mut self, continuing: Option<Continuing>) -> Option<Match> {
        let around = self.database.frames_in(self.settings.window_s);
        let frame = self.state.frame;
        let query = Query {
            features: &self.scratch.features,
            tags: self.tags,
            // Without a frame that goes on, the clip's end is left out by the index.
            window: match continuing {
                Some(_) => frame.saturating_sub(around)..frame + around + 1,
                None => 0..0,
            },
            continuing,
        };
        self.database.search(&query, &mut self.scratch.search)
    }

    /// Moves the root by the motion of the frame, then towards the object. Returns the distance of
    /// the adjustment, metres.
    fn advance_root(&mut self, dt: f32) -> (f32, Clamping) {
        let (database, state) = (&self.database, &mut self.state);
        // Up to the frame that plays, from the one before it.
        let data = Velocities::of(
            database,
            state
                .frame
                .saturating_sub(1)
                .max(database.clip_of(state.frame).first),
        );
        let velocity = state.root.to_world(data.root) + state.offset.velocity.value;
        let yaw_rate = data.yaw_rate + state.offset.yaw_rate.value;
        // The oldest root makes room for the newest one.
        if let [first, ..] = state.past.as_mut_slice() {
            *first = state.root;
            state.past.rotate_left(1);
        }
        state.root.position += velocity * dt;
        state.root.yaw = wrapped(state.root.yaw + yaw_rate * dt);
        let speed = velocity.length();
        let adjusted = self.adjust(speed, yaw_rate.abs(), dt);
        (adjusted, self.clamp())
    }

    /// Moves the root towards the object. Returns the distance, metres.
    fn adjust(&mut self, speed: f32, yaw_rate: f32, dt: f32) -> f32 {
        let (settings, state) = (&self.settings, &mut self.state);
        let share = |half_life: f32| 1.0 - (-std::f32::consts::LN_2 * dt / half_life.max(1e-3)).exp();
        let object = state.object.root();
        let way = (object.position - state.root.position) * share(settings.adjustment_half_life_s);
        let way = way.clamp_length_max(settings.adjustment_ratio * speed * dt);
        state.root.position += way;
        let turn = wrapped(object.yaw - state.root.yaw) * share(settings.yaw_adjustment_half_life_s);
        let most = settings.yaw_adjustment_ratio * yaw_rate + settings.yaw_adjustment_rad_m * speed;
        state.root.yaw = wrapped(state.root.yaw + turn.max(-most * dt).min(most * dt));
        way.length()
    }

    /// Keeps the root within its limits around the object.
    fn clamp(&mut self) -> Clamping {
        let (settings, state) = (&self.settings, &mut self.state);
        let object = state.object.root();
        let away = state.root.position - object.position;
        let turned = wrapped(state.root.yaw - object.yaw);
        state.root.position = object.position + away.clamp_length_max(settings.clamp_m);
        state.root.yaw = wrapped(object.yaw + turned.clamp(-settings.clamp_rad, settings.clamp_rad));
        match away.length() > settings.clamp_m || turned.abs() > settings.clamp_rad {
            true => Clamping::Clamped,
            false => Clamping::Within,
        }
    }

    /// Makes the pose of the frame that plays with its offset, and its forward kinematics.
    fn rebuild(&mut self) {
        let (database, state, scratch) = (&self.database, &self.state, &mut self.scratch);
        let skeleton = &database.skeleton;
        let root_joint = skeleton.root();
        let rotations = database.rotations(state.frame).iter().zip(&state.offset.joints);
        scratch.pose.local.clear();
        (scratch.pose.local).extend(
            rotations
                .map(|(rotation, offset)| (Quat::from_scaled_axis(offset.value) * *rotation).normalize()),
        );
        let local = &mut scratch.pose.local[root_joint];
        *local = (state.root.rotation() * *local).normalize();
        let hips = database.hips(state.frame) + state.offset.hips.value;
        scratch.pose.trans = state.root.world_from_root().point(hips) - skeleton.joints()[root_joint];
        skeleton.forward_kinematics(&scratch.pose, &mut scratch.world);
    }

    fn advance_feet(&mut self, dt: f32) {
        let Self {
            database,
            state,
            scratch,
            ..
        } = self;
        let rules = self.settings.foot_rules();
        let contacts = database.contacts(state.frame);
        for (side, foot) in state.feet.iter_mut().enumerate() {
            let tick = FootTick {
                leg: database.settings.legs[side],
                contact: if contacts[side] {
                    Contact::Stands
                } else {
                    Contact::Swings
                },
                rest_height_m: database.settings.toe_heights_m[side],
                dt,
            };
            foot.advance(
                &tick,
                &rules,
                &database.skeleton,
                &mut scratch.pose,
                &scratch.world,
            );
        }
    }

    /// Bends the legs to the feet of a restored state.
    fn show_feet(&mut self) {
        for (side, foot) in self.state.feet.iter().enumerate() {
            let leg = self.database.settings.legs[side];
            let rest = self.database.settings.toe_heights_m[side];
            foot.show(
                leg,
                rest,
                &self.database.skeleton,
                &mut self.scratch.pose,
                &self.scratch.world,
            );
        }
    }

    /// Gives the buffers their final sizes, so that steps allocate nothing.
    fn allocate(&mut self) {
        let seconds = |feature: &Feature| feature.seconds().iter().copied().fold(0.0, f32::max);
        let farthest = self
            .database
            .offsets()
            .map(|(_, f)| seconds(f))
            .fold(0.0, f32::max);
        let ticks = self.database.frames_in(farthest) + 1;
        self.scratch.future = vec![RootFrame::default(); ticks];
        self.scratch.features = Vec::with_capacity(self.database.index.dimensions());
    }

    /// Whether the toes are locked: left and right.
    pub fn locked_feet(&self) -> [bool; 2] {
        let is_locked = |foot: &FootState| matches!(foot.hold, FootHold::Locked(_));
        [&self.state.feet[0], &self.state.feet[1]].map(is_locked)
    }

    /// Predicted root frames of the object in the next ticks, as of the last search.
    pub fn future(&self) -> &[RootFrame] {
        &self.scratch.future
    }
}

/// Largest angle between two commands of a steady turn, radians a tick.
const STEADY_TURN_RAD: f32 = 0.2;
/// Share of the newest tick in the estimate of the turn rate.
const TURN_BLEND: f32 = 0.3;

/// Number of past roots that the features of a database look at.
fn past_frames(database: &Database) -> usize {
    let earliest = |feature: &Feature| feature.seconds().iter().copied().fold(0.0, f32::min);
    let earliest = database.offsets().map(|(_, f)| earliest(f)).fold(0.0, f32::min);
    database.frames_in(-earliest)
}

/// Root frame of the query at a time from now, seconds.
fn root_at(database: &Database, state: &ControllerState, future: &[RootFrame], seconds: f32) -> RootFrame {
    let frames = database.frames_in(seconds.abs());
    match seconds < 0.0 && frames > 0 {
        true => state.past[state.past.len().saturating_sub(frames)],
        false => future[frames.min(future.len() - 1)],
    }
}
