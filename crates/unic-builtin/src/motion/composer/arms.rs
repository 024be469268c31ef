//! Raised arms.

use super::Composer;
use crate::motion::{
    action::ArmRaise,
    channel::{Channel, Side},
};

impl Composer {
    pub(super) fn raise_arms(&mut self, raise: ArmRaise) {
        let ease = self.random.between(0.9, 1.4);
        let span = (self.now, self.now + 2.0 * ease + self.random.between(0.4, 1.0));
        for side in Side::BOTH {
            for (channel, amount) in raised(raise, side) {
                self.gestures.hold(channel, span, ease, amount);
            }
        }
        if let ArmRaise::Wave(side) = raise {
            let waving = (span.0 + 0.6 * ease, span.1 - 0.6 * ease);
            self.gestures
                .wave(Channel::Rotation(side), waving, 0.35, [1.6, 0.0]);
        }
        self.now = span.1 + 0.2;
    }
}

/// Channels of one arm of a raise, radians.
fn raised(raise: ArmRaise, side: Side) -> Vec<(Channel, f64)> {
    let (flexion, abduction) = (Channel::Flexion(side), Channel::Abduction(side));
    let (rotation, elbow) = (Channel::Rotation(side), Channel::Elbow(side));
    match raise {
        ArmRaise::Forward => vec![(flexion, 1.5)],
        ArmRaise::Sideways => vec![(abduction, 1.4)],
        ArmRaise::Overhead => vec![(flexion, 2.85)],
        ArmRaise::Star => vec![(abduction, 2.6)],
        ArmRaise::Wave(waving) if waving == side => vec![(abduction, 1.5), (elbow, 1.2), (rotation, -1.4)],
        ArmRaise::Wave(_) => Vec::new(),
        ArmRaise::Akimbo => vec![(abduction, 0.7), (flexion, -0.35), (elbow, 1.6), (rotation, 0.6)],
    }
}
