//! Sequences of actions, and characters that perform them.

use super::{
    PerformerError, action::Action, composer::Composer, footsteps::StepTiming, performance::Performance,
    rig::Rig,
};
use unic_core::character::Character;

/// A character that can perform.
#[derive(Clone, Debug)]
pub struct Performer {
    rig: Rig,
}

impl Performer {
    /// Measures the limbs and feet of a character.
    ///
    /// The character's joints are in SMPL's order and its pose zero is a T-pose. In the bind pose
    /// it stands upright with flat feet, facing +Z, with its arms in any position.
    ///
    /// # Errors
    /// [`PerformerError::Joints`] and [`PerformerError::Parent`] for a skeleton that is not SMPL's,
    /// [`PerformerError::NoFeet`] without vertices on the feet, [`PerformerError::NoLegs`] for a body or
    /// legs of almost no length.
    pub fn new(character: &Character) -> Result<Self, PerformerError> {
        Rig::new(character).map(|rig| Self { rig })
    }

    /// Height and leg length of the body, which set the rhythm of its steps.
    pub fn stature(&self) -> super::Stature {
        self.rig.stature
    }
}

/// Sequence of actions, with the seed of everything that the actions leave open: habits of the
/// person, times of glances, figures of a dance.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    seed: u64,
    actions: Vec<Action>,
    timing: StepTiming,
}

impl Timeline {
    /// Timeline without actions.
    pub fn new(seed: u64) -> Self {
        Self {
            seed,
            actions: Vec::new(),
            timing: StepTiming::Ordinary,
        }
    }

    /// Makes steps as frequent as the fastest movement of the next moments asks for. Use it for
    /// abrupt starts and turns, in which a foot that is left behind would pull the pelvis down.
    pub fn with_quick_steps(mut self) -> Self {
        self.timing = StepTiming::Quick;
        self
    }

    /// Appends an action.
    pub fn then(mut self, action: Action) -> Self {
        self.actions.push(action);
        self
    }

    /// Appends several actions.
    pub fn then_all(mut self, actions: impl IntoIterator<Item = Action>) -> Self {
        self.actions.extend(actions);
        self
    }

    /// Performs the actions with one character, from a stand to a stand.
    ///
    /// The character starts at the origin and faces +Z.
    pub fn perform(&self, performer: &Performer) -> Performance {
        let mut composer = Composer::new(performer.rig.stature, self.seed, self.timing);
        self.actions.iter().for_each(|&action| composer.perform(action));
        Performance::new(performer.rig.clone(), composer.finish())
    }
}
