//! Jumps.

use super::Composer;
use crate::motion::{
    channel::{Channel, Side},
    footsteps::Jump,
    gait::GRAVITY,
};

impl Composer {
    pub(super) fn jump(&mut self, height: f64) {
        let height = height.clamp(0.02, 0.6);
        let takeoff = self.now + 1.0;
        let landing = takeoff + 2.0 * (2.0 * height / GRAVITY).sqrt();
        let crouch = 0.16 + 0.35 * height;
        self.jumps.push(Jump {
            takeoff,
            landing,
            crouch,
        });
        self.jump_trunk(takeoff, landing, crouch);
        for side in Side::BOTH {
            let arm = Channel::Flexion(side);
            // Back while crouching, forward and up with the push, down again after landing.
            self.gestures.step(arm, takeoff - 0.9, takeoff - 0.35, -0.7);
            self.gestures.step(arm, takeoff - 0.42, takeoff + 0.12, 2.6);
            self.gestures.step(arm, landing - 0.15, landing + 0.75, -1.9);
            let bend = (takeoff - 0.5, landing + 0.6);
            self.gestures.hold(Channel::Elbow(side), bend, 0.4, 0.5);
        }
        self.now = landing + 1.1;
    }

    fn jump_trunk(&mut self, takeoff: f64, landing: f64, crouch: f64) {
        let down = (takeoff - 0.95, takeoff + 0.05);
        let absorb = (landing - 0.1, landing + 0.9);
        for (span, ease, share) in [(down, 0.45, 1.0), (absorb, 0.4, 0.8)] {
            self.gestures
                .hold(Channel::Lean, span, ease, 2.0 * share * crouch);
            self.gestures
                .hold(Channel::Shift, span, ease, -0.22 * share * crouch);
        }
    }
}
