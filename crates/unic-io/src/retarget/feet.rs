//! Feet that stand neither slide nor sink.
//!
//! The ball of a foot (SMPL's foot joint) stands while it is slow and low. Through each such phase
//! it is held where it is on average, on the ground; between phases the correction fades, so that
//! swings stay as they are. The leg follows by inverse kinematics, and the toes lie on the ground.

mod contacts;
mod flat;
mod foot;
mod held;
mod pelvis;
mod phases;

use contacts::Contacts;
use flat::level;
use foot::feet_of;
use phases::ground_height;
use unic_core::{character::Character, clip::Clip};

/// Time in which a correction fades in and out, seconds: much less than a swing.
const FADE: f32 = 0.15;

/// How well feet stand.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FootMeasure {
    /// Seconds that a foot stands, both feet together.
    pub standing_seconds: f32,
    /// Mean horizontal speed of standing balls of the foot, m/s.
    pub slide: f32,
    /// Largest depth of a ball of the foot below its height on the ground, metres.
    pub deepest: f32,
    /// Mean distance of standing balls from their height on the ground, metres.
    pub height_error: f32,
}

/// Re-seats a clip on the ground that its standing feet are on, y = 0, and holds those feet.
/// Says what it did; characters without named feet stay as they are.
pub(crate) fn hold(clip: &mut Clip, character: &Character, notes: &mut Vec<String>) {
    let Some(feet) = feet_of(character) else {
        notes.push("the character has no joints named as feet: feet are not held".into());
        return;
    };
    feet.iter()
        .for_each(|foot| level(clip, &character.skeleton, foot));
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
}

/// How well the feet of a clip stand, in the phases that `reference` tells: the same motion, perhaps
/// before something was done to it, frame by frame. `None` for characters without named feet.
pub fn measure_feet(clip: &Clip, reference: &Clip, character: &Character) -> Option<FootMeasure> {
    let feet = feet_of(character)?;
    let contacts = Contacts::find(reference, &character.skeleton, feet);
    Some(contacts.measure(clip, &character.skeleton))
}
