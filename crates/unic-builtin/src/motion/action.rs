//! The vocabulary of motion.

use super::Side;

/// Pose to which one or both arms are raised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ArmRaise {
    /// Both to the front, to shoulder height.
    Forward,
    /// Both to the sides, to shoulder height.
    Sideways,
    /// Both to the front and on until they point up.
    Overhead,
    /// Both to the sides and on until they point up.
    Star,
    /// One arm up, the hand waving.
    Wave(Side),
    /// Hands to the hips.
    Akimbo,
}

/// One instruction of a [`Timeline`](super::Timeline), performed after the one before it.
///
/// All actions but [`Action::Travel`] and [`Action::Slalom`] first bring the character to a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Standing: breath, shifts of weight, glances.
    Idle {
        /// Duration, seconds.
        seconds: f32,
    },
    /// Walking or running, whichever suits the speed.
    Travel {
        /// Speed along the heading, m/s, 0 to 6.
        speed: f32,
        /// Turning rate, rad/s, positive to the left.
        turn_rate: f32,
        /// Duration including the change of speed, seconds.
        seconds: f32,
    },
    /// Travelling in curves to alternate sides.
    Slalom {
        /// Speed along the heading, m/s, 0 to 6.
        speed: f32,
        /// Largest turning rate, rad/s.
        turn_rate: f32,
        /// Time between two left turns, seconds.
        period: f32,
        /// Duration, seconds.
        seconds: f32,
    },
    /// Braking to a stand.
    Stop {
        /// Duration of the braking, seconds.
        seconds: f32,
    },
    /// Walking to places at random, as after the pointer of a player: in all directions, with sharp
    /// turns and short stands.
    Wander {
        /// Duration, seconds.
        seconds: f32,
    },
    /// Turning on the spot.
    TurnOnSpot {
        /// Change of heading, radians, positive to the left.
        angle: f32,
    },
    /// Squat: the pelvis goes down and up again.
    Squat {
        /// Descent of the pelvis as a share of the leg's length, 0 to 0.6.
        depth: f32,
    },
    /// Jump straight up from both feet.
    Jump {
        /// Rise of the pelvis in flight, metres, 0 to 0.6.
        height: f32,
    },
    /// Chest and head turned against the feet, to one side and to the other.
    Twist {
        /// Largest angle to each side, radians.
        angle: f32,
    },
    /// Trunk bent to one side and to the other.
    SideBend {
        /// Largest angle to each side, radians.
        angle: f32,
    },
    /// Trunk bent forward and up again.
    Bow {
        /// Largest forward lean of the trunk, radians.
        angle: f32,
    },
    /// Arms raised, held and lowered.
    RaiseArms(ArmRaise),
    /// Dance figures to a beat: steps to the side, swaying hips, turns and arm movements.
    Dance {
        /// Duration, seconds.
        seconds: f32,
        /// Tempo, beats a minute, limited to 48 to 150.
        beats_per_minute: f32,
    },
}
