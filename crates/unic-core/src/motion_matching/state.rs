//! State of a controller.

use super::{
    command::Command, controller::ControllerError, database::Database, feet::FootState, inertia::PoseOffset,
    object::SimulatedObject, root::RootFrame, search::TagFilter,
};
use serde::{Deserialize, Serialize};

/// Everything that the next step of a controller depends on beside its database and its settings.
///
/// A state that is saved and restored continues with the same bytes, if the controller has the same
/// database and [`ControllerSettings`](super::ControllerSettings).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ControllerState {
    /// Frame of the database that plays.
    pub(super) frame: usize,
    /// Tags of the frames that are played.
    pub(super) tags: TagFilter,
    /// Ticks since the last search.
    pub(super) ticks_since_search: u32,
    /// Command of the last tick.
    pub(super) command: Command,
    /// Command of the last search.
    pub(super) searched_command: Command,
    /// Rate at which the commands turn, rad/s.
    pub(super) turn_rate: f32,
    /// Object that the character follows.
    pub(super) object: SimulatedObject,
    /// Root frame of the character as shown.
    pub(super) root: RootFrame,
    /// Root frames of the last ticks, the oldest first, for features of the past.
    pub(super) past: Vec<RootFrame>,
    /// Difference between the output and the frame that plays.
    pub(super) offset: PoseOffset,
    /// Left and right foot.
    pub(super) feet: [FootState; 2],
}

/// Ticks since the last search with which the next step searches, whatever the interval.
const DUE: u32 = u32::MAX;

impl ControllerState {
    /// Starts at the first frame, at rest.
    pub(super) fn start(database: &Database, tags: TagFilter, root: RootFrame, past: usize) -> Self {
        Self {
            frame: 0,
            tags,
            ticks_since_search: DUE,
            command: Command::STAND,
            searched_command: Command::STAND,
            turn_rate: 0.0,
            object: SimulatedObject::at_rest(root),
            root,
            past: vec![root; past],
            offset: PoseOffset::none(database.skeleton().len()),
            feet: Default::default(),
        }
    }

    /// Replaces the tags. The next step searches.
    pub(super) fn set_tags(&mut self, tags: TagFilter) {
        self.tags = tags;
        self.ticks_since_search = DUE;
    }

    /// Checks a state that comes from a file.
    pub(super) fn check(&self, database: &Database, past: usize) -> Result<(), ControllerError> {
        let differs = |what, expected, found| ControllerError::State {
            what,
            expected,
            found,
        };
        if self.frame >= database.len() {
            return Err(differs("frame below", database.len(), self.frame));
        }
        if self.offset.joints.len() != database.skeleton().len() {
            let (expected, found) = (database.skeleton().len(), self.offset.joints.len());
            return Err(differs("joints", expected, found));
        }
        if self.past.len() != past {
            return Err(differs("past roots", past, self.past.len()));
        }
        if !database.has_searchable(self.tags) {
            return Err(ControllerError::NoFrames);
        }
        match self.is_finite() {
            true => Ok(()),
            false => Err(ControllerError::NotFinite),
        }
    }

    fn is_finite(&self) -> bool {
        let is_root = |r: &RootFrame| r.position.is_finite() && r.yaw.is_finite();
        let motion = &self.object.motion;
        let numbers = [
            self.turn_rate,
            self.object.yaw.value,
            self.object.yaw.rate,
            self.object.goal_yaw,
        ];
        self.command.is_finite()
            && self.searched_command.is_finite()
            && is_root(&self.root)
            && self.past.iter().all(is_root)
            && [motion.position, motion.velocity, motion.acceleration]
                .iter()
                .all(|v| v.is_finite())
            && numbers.iter().all(|x| x.is_finite())
            && self.offset.is_finite()
            && self.feet.iter().all(FootState::is_finite)
    }

    /// Frame of the database that plays.
    pub fn frame(&self) -> usize {
        self.frame
    }

    /// Root frame of the character as shown.
    pub fn root(&self) -> RootFrame {
        self.root
    }

    /// Object that the character follows.
    pub fn object(&self) -> &SimulatedObject {
        &self.object
    }

    /// Left and right foot.
    pub fn feet(&self) -> &[FootState; 2] {
        &self.feet
    }
}
