//! Actions in a row.

use super::{MotionError, action::Action, composer::Composer, performance::Performance, rig::Rig};
use unic_core::character::Character;

/// A character that can perform.
#[derive(Clone, Debug)]
pub struct Performer {
    rig: Rig,
}

impl Performer {
    /// Takes lengths of limbs and shapes of feet from a character.
    ///
    /// Its joints are in SMPL's order, pose zero is a T-pose, and in the bind pose it stands upright
    /// with flat feet, facing +Z, arms in any position.
    ///
    /// # Errors
    /// Another skeleton than SMPL's, no vertices on the feet, legs without length.
    pub fn new(character: &Character) -> Result<Self, MotionError> {
        Rig::new(character).map(|rig| Self { rig })
    }

    /// Size of the body and the rhythm that goes with it.
    pub fn stature(&self) -> super::Stature {
        self.rig.stature
    }
}

/// Actions in a row, and the seed of all that is left open: habits of the person, moments of
/// glances, figures of a dance.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    seed: u64,
    actions: Vec<Action>,
}

impl Timeline {
    /// Nothing to do yet.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            actions: Vec::new(),
        }
    }

    /// One more action at the end.
    pub fn then(mut self, action: Action) -> Self {
        self.actions.push(action);
        self
    }

    /// Several more at the end.
    pub fn then_all(mut self, actions: impl IntoIterator<Item = Action>) -> Self {
        self.actions.extend(actions);
        self
    }

    /// The motion of one character, from a stand to a stand, starting at the origin and facing +Z.
    pub fn perform(&self, performer: &Performer) -> Performance {
        let mut composer = Composer::new(performer.rig.stature, self.seed);
        self.actions.iter().for_each(|&action| composer.perform(action));
        Performance::new(performer.rig.clone(), composer.finish())
    }
}
