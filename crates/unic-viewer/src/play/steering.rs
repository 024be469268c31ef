//! Sources of commands.

use glam::Vec2;
use unic_core::motion_matching::{Command, MouseButtons, SimulatedObject};

/// Source of the commands to the first character.
pub enum Steering<'a> {
    /// Command as it is.
    Command(Command),
    /// Place on the floor that the mouse points to, (x, z) metres, and its buttons.
    Mouse {
        /// Place.
        pointer: Vec2,
        /// Buttons.
        buttons: MouseButtons,
    },
    /// Command as a function of the time in seconds and of the object that the character follows.
    Script(&'a mut dyn FnMut(f32, &SimulatedObject) -> Command),
}
