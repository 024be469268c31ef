//! The vocabulary of motion.

use super::channel::Side;

/// How both arms, or one, are raised.
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

/// One thing to do. Standing actions first bring the character to a stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Standing: breath, shifts of weight, glances.
    Idle {
        /// How long.
        seconds: f32,
    },
    /// Walking or running, whichever suits the speed.
    Travel {
        /// m/s along the heading, 0 to 6.
        speed: f32,
        /// rad/s, positive to the left.
        turn_rate: f32,
        /// How long, the change of speed included.
        seconds: f32,
    },
    /// Travelling in curves to alternate sides.
    Slalom {
        /// m/s.
        speed: f32,
        /// Largest turning rate, rad/s.
        turn_rate: f32,
        /// From one left turn to the next, seconds.
        period: f32,
        /// How long.
        seconds: f32,
    },
    /// To a stand.
    Stop {
        /// Duration of the braking.
        seconds: f32,
    },
    /// Turning on the spot.
    TurnOnSpot {
        /// Radians, positive to the left.
        angle: f32,
    },
    /// Down and up again.
    Squat {
        /// Descent of the pelvis, share of the leg's length, 0 to 0.6.
        depth: f32,
    },
    /// Straight up from both feet.
    Jump {
        /// Rise of the pelvis in flight, metres, 0 to 0.6.
        height: f32,
    },
    /// Chest and head turned against the feet, to one side and to the other.
    Twist {
        /// Radians to each side.
        angle: f32,
    },
    /// Trunk bent to one side and to the other.
    SideBend {
        /// Radians to each side.
        angle: f32,
    },
    /// Trunk bent forward and up again.
    Bow {
        /// Radians.
        angle: f32,
    },
    /// Arms raised, held and lowered.
    RaiseArms(ArmRaise),
    /// Figures to a beat: steps to the side, swaying hips, arms.
    Dance {
        /// How long.
        seconds: f32,
        /// Rhythm.
        beats_per_minute: f32,
    },
}
