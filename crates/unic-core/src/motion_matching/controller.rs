//! Controller: plays the frames of a database such that a character follows commands.

mod movement;
mod posing;
mod report;
mod selection;

pub use report::{Clamping, ControllerError, SearchOutcome, StepReport};

use super::{
    command::Command,
    database::Database,
    features::Feature,
    feet::{FootHold, FootState},
    index::SearchScratch,
    root::RootFrame,
    search::TagFilter,
    settings::ControllerSettings,
    state::ControllerState,
};
use crate::{skeleton::Pose, transform::Rigid};
use std::sync::Arc;

/// Character under control: a database that is shared, a state, and buffers.
///
/// A step is a tick of 1 / fps seconds of the database and allocates nothing.
#[derive(Clone, Debug)]
pub struct Controller {
    database: Arc<Database>,
    settings: ControllerSettings,
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

impl Controller {
    /// Makes a controller, with the character at the origin, facing +Z.
    pub fn new(database: Arc<Database>, settings: ControllerSettings) -> Self {
        let root = RootFrame::default();
        let state = ControllerState::start(&database, TagFilter::default(), root, past_frames(&database));
        let mut controller = Self {
            database,
            settings,
            state,
            scratch: Scratch::default(),
        };
        controller.allocate();
        controller.reset(root);
        controller
    }

    /// Puts the character at rest, in the frame that suits standing best. The tags stay.
    pub fn reset(&mut self, root: RootFrame) {
        let past = past_frames(&self.database);
        self.state = ControllerState::start(&self.database, self.state.tags, root, past);
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

    /// Restricts the frames that are played to those with these tags. The next step searches.
    ///
    /// # Errors
    /// Tags that no frame where a search may end has. The tags stay as they were.
    pub fn set_tags(&mut self, tags: TagFilter) -> Result<(), ControllerError> {
        if !self.database.has_searchable(tags) {
            return Err(ControllerError::NoFrames);
        }
        self.state.set_tags(tags);
        Ok(())
    }

    /// State after the last step.
    pub fn state(&self) -> &ControllerState {
        &self.state
    }

    /// Replaces the state by a saved one. Later steps give the same bytes as they gave after it, if
    /// the settings are the same.
    ///
    /// # Errors
    /// A state of another database, or with tags that no frame has. The current state stays.
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

/// Number of past roots that the features of a database look at.
fn past_frames(database: &Database) -> usize {
    let earliest = |feature: &Feature| feature.seconds().iter().copied().fold(0.0, f32::min);
    let earliest = database.offsets().map(|(_, f)| earliest(f)).fold(0.0, f32::min);
    database.frames_in(-earliest)
}
