//! Scripted inputs.

use glam::Vec2;
use rand::{RngExt, SeedableRng, rngs::ChaCha8Rng};
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use unic_core::motion_matching::{
    Command, MouseButtons, MouseControl, RootFrame, SimulatedObject, direction_of,
};

/// Time before the first input, seconds.
const STAND_S: f32 = 1.0;
/// Speed of the scripts, m/s: a walk.
const SPEED_M_S: f32 = 1.4;
/// Radius of the circles, metres.
const RADIUS_M: f32 = 2.0;
/// Side of the square, metres.
const SIDE_M: f32 = 4.0;
/// Largest angle of the slalom to each side, radians.
const SLALOM_RAD: f32 = 0.8;
/// Period of the slalom, seconds.
const SLALOM_S: f32 = 4.0;
/// Time between two reversals, and between two starts or stops, seconds.
const STEP_S: f32 = 3.0;
/// Largest speed of the mouse control, m/s.
const MOUSE_SPEED_M_S: f32 = 2.0;
/// Time that the random mouse stays at a place, seconds.
const MOUSE_S: std::ops::Range<f32> = 1.0..2.5;
/// Distance of the random mouse from the character, metres.
const MOUSE_M: std::ops::Range<f32> = 0.6..4.0;

/// Time that the random stick stays in a position, seconds.
const STICK_S: std::ops::Range<f32> = 0.7..2.5;
/// Speed that the random stick asks for, m/s.
const STICK_SPEED_M_S: std::ops::Range<f32> = 0.4..2.0;
/// Largest change of direction of the random stick in every other move, radians.
const STICK_CURVE_RAD: f32 = 0.9;

/// Scripted input of one run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Script {
    /// Circle of radius 2 m.
    Circle,
    /// Two circles of radius 2 m, to the left and to the right.
    Figure8,
    /// Square of side 4 m.
    Square,
    /// Curves to alternate sides.
    Slalom,
    /// Straight walk, reversed by 180° every three seconds.
    Reversals,
    /// Straight walk with stops.
    StartStop,
    /// Mouse that jumps about at random.
    RandomMouse,
    /// Stick that is moved at random, to speeds of up to 2 m/s.
    RandomStick,
}

impl Script {
    /// All scripts.
    pub const ALL: [Self; 8] = [
        Self::Circle,
        Self::Figure8,
        Self::Square,
        Self::Slalom,
        Self::Reversals,
        Self::StartStop,
        Self::RandomMouse,
        Self::RandomStick,
    ];

    /// Scripts whose metrics have targets. The others make motion for training and tests.
    pub const MEASURED: [Self; 7] = [
        Self::Circle,
        Self::Figure8,
        Self::Square,
        Self::Slalom,
        Self::Reversals,
        Self::StartStop,
        Self::RandomMouse,
    ];

    /// Name in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Circle => "circle",
            Self::Figure8 => "figure_8",
            Self::Square => "square",
            Self::Slalom => "slalom",
            Self::Reversals => "reversals",
            Self::StartStop => "start_stop",
            Self::RandomMouse => "random_mouse",
            Self::RandomStick => "random_stick",
        }
    }

    /// Duration, seconds.
    pub fn seconds(self) -> f32 {
        let lap = TAU * RADIUS_M / SPEED_M_S;
        STAND_S
            + match self {
                Self::Circle | Self::Figure8 => 2.0 * lap,
                Self::Square => 8.0 * SIDE_M / SPEED_M_S,
                Self::Slalom => 5.0 * SLALOM_S,
                Self::Reversals | Self::StartStop => 8.0 * STEP_S,
                Self::RandomMouse | Self::RandomStick => 40.0,
            }
    }

    /// Direction of the velocity after `t` seconds of input, radians, and its speed, m/s.
    fn travel(self, t: f32) -> (f32, f32) {
        let rate = SPEED_M_S / RADIUS_M;
        let lap = TAU / rate;
        let step = (t / STEP_S) as u32;
        match self {
            Self::Circle => (rate * t, SPEED_M_S),
            Self::Figure8 if ((t / lap) as u32).is_multiple_of(2) => (rate * t, SPEED_M_S),
            Self::Figure8 => (-rate * t, SPEED_M_S),
            Self::Square => ((t * SPEED_M_S / SIDE_M).floor() * FRAC_PI_2, SPEED_M_S),
            Self::Slalom => (SLALOM_RAD * (TAU * t / SLALOM_S).sin(), SPEED_M_S),
            Self::Reversals => (PI * (step % 2) as f32, SPEED_M_S),
            Self::StartStop => (0.0, SPEED_M_S * ((step + 1) % 2) as f32),
            Self::RandomMouse | Self::RandomStick => (0.0, 0.0),
        }
    }

    /// Name of the stream of random numbers. With the seed it is the key of the generator.
    fn stream(self) -> &'static [u8; 24] {
        match self {
            Self::RandomStick => b"control: random stick   ",
            // The other scripts draw nothing.
            _ => b"control: random mouse   ",
        }
    }
}

/// Player that gives the commands of a script.
#[derive(Debug)]
pub struct Player {
    script: Script,
    mouse: MouseControl,
    pointer: Vec2,
    buttons: MouseButtons,
    /// Velocity that the stick asks for, m/s.
    stick: Vec2,
    /// Time at which the mouse or the stick moves on, seconds.
    until: f32,
    random: ChaCha8Rng,
}

impl Player {
    /// Makes the player of a script. The seed is that of the random mouse and stick.
    pub fn new(script: Script, seed: u64) -> Self {
        let mut key = [0; 32];
        key[..8].copy_from_slice(&seed.to_le_bytes());
        key[8..].copy_from_slice(script.stream());
        Self {
            script,
            mouse: MouseControl::new(MOUSE_SPEED_M_S),
            pointer: Vec2::ZERO,
            buttons: MouseButtons::Released,
            stick: Vec2::ZERO,
            until: 0.0,
            random: ChaCha8Rng::from_seed(key),
        }
    }

    /// Returns the command at a time, seconds. `object` is what the character follows.
    pub fn command(&mut self, seconds: f32, object: &SimulatedObject) -> Command {
        let t = seconds - STAND_S;
        if t < 0.0 {
            return Command::STAND;
        }
        match self.script {
            Script::RandomMouse => {
                self.move_mouse(t, &object.root());
                self.mouse.command(object, self.pointer, self.buttons)
            }
            Script::RandomStick => {
                self.move_stick(t, &object.root());
                Command::travel(self.stick)
            }
            steady => {
                let (yaw, speed) = steady.travel(t);
                Command::travel(direction_of(yaw) * speed)
            }
        }
    }

    fn move_mouse(&mut self, t: f32, root: &RootFrame) {
        if t < self.until {
            return;
        }
        self.until = t + self.random.random_range(MOUSE_S);
        let yaw = self.random.random_range(-PI..PI);
        let distance = self.random.random_range(MOUSE_M);
        self.pointer = root.position + direction_of(yaw) * distance;
        // One place in five is shown with no button held: the character stops.
        self.buttons = match self.random.random_range(0..5u32) {
            0 => MouseButtons::Released,
            _ => MouseButtons::LeftAndRight,
        };
    }

    fn move_stick(&mut self, t: f32, root: &RootFrame) {
        if t < self.until {
            return;
        }
        self.until = t + self.random.random_range(STICK_S);
        // One position in five is the middle: the character stops. Half of the others are curves.
        let turn = match self.random.random_range(0..5u32) {
            0 => return self.stick = Vec2::ZERO,
            1 | 2 => STICK_CURVE_RAD,
            _ => PI,
        };
        let yaw = root.yaw + self.random.random_range(-turn..turn);
        self.stick = direction_of(yaw) * self.random.random_range(STICK_SPEED_M_S);
    }
}
