//! Gamepad of a play, in builds with the feature `gamepad`.

use glam::Vec2;

/// Deflection below which a stick is at rest.
#[cfg(feature = "gamepad")]
const DEAD_ZONE: f32 = 0.15;

/// First gamepad that is used.
#[derive(Debug, Default)]
pub(super) struct Gamepad {
    #[cfg(feature = "gamepad")]
    pads: Option<gilrs::Gilrs>,
}

/// Sticks of a gamepad, each (right, up) in -1 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sticks {
    pub(super) left: Vec2,
    pub(super) right: Vec2,
}

impl Gamepad {
    /// Looks for gamepads; without any, or without the feature, the sticks are at rest.
    pub(super) fn open() -> Self {
        Self {
            #[cfg(feature = "gamepad")]
            pads: gilrs::Gilrs::new().ok(),
        }
    }

    /// Reads the sticks.
    #[cfg(feature = "gamepad")]
    pub(super) fn sticks(&mut self) -> Sticks {
        let Some(pads) = &mut self.pads else {
            return Sticks::default();
        };
        while pads.next_event().is_some() {}
        let Some((_, pad)) = pads.gamepads().next() else {
            return Sticks::default();
        };
        let stick = |x, y| {
            let deflection = Vec2::new(pad.value(x), pad.value(y));
            match deflection.length() > DEAD_ZONE {
                true => deflection.clamp_length_max(1.0),
                false => Vec2::ZERO,
            }
        };
        Sticks {
            left: stick(gilrs::Axis::LeftStickX, gilrs::Axis::LeftStickY),
            right: stick(gilrs::Axis::RightStickX, gilrs::Axis::RightStickY),
        }
    }

    /// Reads the sticks: without the feature they are at rest.
    #[cfg(not(feature = "gamepad"))]
    pub(super) fn sticks(&mut self) -> Sticks {
        Sticks::default()
    }
}
