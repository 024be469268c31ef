//! Foot locking: standing feet neither slide nor sink.
//!
//! The ball of a foot (SMPL's foot joint) stands while it is slow and low. During each such phase
//! it is held at its mean position, on the ground. Between phases the correction fades out, so that
//! swings do not change. The leg follows by inverse kinematics, and the toes are laid on the
//! ground.

mod contacts;
mod flat;
mod foot;
mod held;
mod pelvis;
mod phases;

pub use contacts::FootMeasure;

use crate::motion::FootSlide;
use contacts::Contacts;
use flat::level_foot;
use foot::feet_of;
pub use foot::legs_of;
use phases::ground_height;
use unic_core::{character::Character, clip::Clip};

/// Moves a clip vertically so that its standing feet are on y = 0, and holds those feet.
///
/// Adds a note. Clips of characters whose feet are not identified do not change.
pub(crate) fn hold(clip: &mut Clip, character: &Character, notes: &mut Vec<String>) -> Option<FootSlide> {
    let Some(feet) = feet_of(character) else {
        notes.push("the character has no joints named as feet: feet are not held".into());
        return None;
    };
    // Level feet first: the height of the ground depends on their soles.
    feet.iter()
        .for_each(|foot| level_foot(clip, &character.skeleton, foot));
    let ground = ground_height(clip, &character.skeleton, &feet);
    clip.poses.iter_mut().for_each(|p| p.trans.y -= ground);
    clip.ground_height = 0.0;
    let contacts = Contacts::find(clip, &character.skeleton, feet);
    let before = contacts.measure(clip, &character.skeleton);
    contacts.hold(clip, &character.skeleton);
    let after = contacts.measure(clip, &character.skeleton);
    notes.push(format!(
        "feet held where they stand ({:.1} s of both): they slid at {:.3} m/s, now {:.3} m/s",
        before.standing_seconds, before.slide, after.slide
    ));
    Some(FootSlide { before, after })
}

/// Measures how far the standing feet of a clip slide and sink.
///
/// The phases in which feet stand are those of `reference`, the same motion frame by frame, such as
/// the clip before a correction. Returns `None` for characters whose feet are not identified.
pub fn measure_feet(clip: &Clip, reference: &Clip, character: &Character) -> Option<FootMeasure> {
    let feet = feet_of(character)?;
    let contacts = Contacts::find(reference, &character.skeleton, feet);
    Some(contacts.measure(clip, &character.skeleton))
}
