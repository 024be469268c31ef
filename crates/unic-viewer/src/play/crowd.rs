//! Characters that follow the first one.

use glam::Vec2;
use unic_core::motion_matching::{Command, Facing, RootFrame};

/// Distance between characters, metres.
const SPACING_M: f32 = 1.5;
/// Speed asked for by distance from one's place, 1/s.
const RATE: f32 = 1.2;
/// Distance from one's place that is near enough, metres.
const NEAR_M: f32 = 0.25;
/// Largest speed of a follower, m/s.
const TOP_SPEED_M_S: f32 = 2.6;

/// Place of a character of a crowd relative to the first one, (x, z) metres: rows behind it.
pub(super) fn place(character: usize) -> Vec2 {
    // Row r has 2 r + 1 characters: a wedge, with the first one at its tip.
    let row = (character as f32).sqrt().floor();
    let column = character as f32 - row * row - row;
    Vec2::new(column, -row) * SPACING_M
}

/// Command to a follower, from the command and the root of the first character.
pub(super) fn follow(leader: RootFrame, command: &Command, follower: RootFrame, place: Vec2) -> Command {
    let way = leader.position + place - follower.position;
    let beyond = way.normalize_or_zero() * (way.length() - NEAR_M).max(0.0);
    let velocity = (command.velocity + beyond * RATE).clamp_length_max(TOP_SPEED_M_S);
    match command.facing {
        Facing::Yaw(yaw) => Command {
            velocity,
            facing: Facing::Yaw(yaw),
        },
        Facing::Travel => Command::travel(velocity),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_apart_and_behind_the_first_character() {
        let places: Vec<Vec2> = (0..25).map(place).collect();
        assert_eq!(places[0], Vec2::ZERO);
        for (i, a) in places.iter().enumerate() {
            assert!(a.y <= 0.0);
            for b in &places[..i] {
                assert!(a.distance(*b) > 0.99 * SPACING_M, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_follower_in_its_place_has_the_command_of_the_first_one() {
        let at = |position| RootFrame { position, yaw: 0.0 };
        let command = Command::travel(Vec2::new(0.0, 1.0));
        let place = place(3);
        let same = follow(at(Vec2::ONE), &command, at(Vec2::ONE + place), place);
        assert_eq!(same, command);
        let late = follow(at(Vec2::ONE), &command, at(place), place);
        assert!(late.velocity.x > 0.0 && late.velocity.y > 1.0, "{late:?}");
    }
}
