//! Jumps.

use super::Composer;
use crate::motion::{
    Side,
    channel::{Channel, Interval},
    footsteps::Jump,
    gait::GRAVITY,
};

impl Composer {
    pub(super) fn jump(&mut self, height: f64) {
        let height = height.clamp(0.02, 0.6);
        let takeoff = self.now + 1.0;
        // A free fall from the height takes √(2 h / g); the rise takes as long.
        let landing = takeoff + 2.0 * (2.0 * height / GRAVITY).sqrt();
        // Higher jumps start from a deeper crouch.
        let crouch = 0.16 + 0.35 * height;
        self.jumps.push(Jump {
            takeoff,
            landing,
            crouch,
        });
        let push = Interval::new(takeoff - 0.95, takeoff + 0.05);
        let absorb = Interval::new(landing - 0.1, landing + 0.9);
        self.bend_trunk(push, 0.45, 1.0, crouch);
        self.bend_trunk(absorb, 0.4, 0.8, crouch);
        for side in Side::BOTH {
            // Back while crouching, forward and up with the push, down again after landing. The
            // three amounts sum to zero.
            let back = Interval::new(takeoff - 0.9, takeoff - 0.35);
            let up = Interval::new(takeoff - 0.42, takeoff + 0.12);
            let down = Interval::new(landing - 0.15, landing + 0.75);
            for (interval, amount) in [(back, -0.7), (up, 2.6), (down, -1.9)] {
                self.gestures.step(Channel::Flexion(side), interval, amount);
            }
            let bend = Interval::new(takeoff - 0.5, landing + 0.6);
            self.gestures.hold(Channel::Elbow(side), bend, 0.4, 0.5);
        }
        self.now = landing + 1.1;
    }

    /// Leans the trunk forward and moves the pelvis back with a share of the crouch, in metres.
    fn bend_trunk(&mut self, interval: Interval, ease: f64, share: f64, crouch: f64) {
        self.gestures
            .hold(Channel::Lean, interval, ease, 2.0 * share * crouch);
        self.gestures
            .hold(Channel::Shift, interval, ease, -0.22 * share * crouch);
    }
}
