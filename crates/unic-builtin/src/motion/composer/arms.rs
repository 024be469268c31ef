//! Raised arms.

use super::Composer;
use crate::motion::{
    Side,
    action::ArmRaise,
    channel::{Channel, Interval},
};

impl Composer {
    pub(super) fn raise_arms(&mut self, raise: ArmRaise) {
        let ease = self.random.between(0.9, 1.4);
        let end = self.now + 2.0 * ease + self.random.between(0.4, 1.0);
        let interval = Interval::new(self.now, end);
        for side in Side::BOTH {
            for (channel, angle) in raised_angles(raise, side) {
                self.gestures.hold(channel, interval, ease, angle);
            }
        }
        if let ArmRaise::Wave(side) = raise {
            // The hand waves while the arm is raised by more than half.
            let waving = Interval::new(interval.start + 0.6 * ease, interval.end - 0.6 * ease);
            self.gestures
                .wave(Channel::Rotation(side), waving, 0.35, 1.6, 0.0);
        }
        self.now = interval.end + 0.2;
    }
}

/// Angles of one raised arm by channel, radians.
fn raised_angles(raise: ArmRaise, side: Side) -> Vec<(Channel, f64)> {
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
