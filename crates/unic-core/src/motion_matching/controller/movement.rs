//! Movement of the visible root beside the simulated object.

use super::{Clamping, Controller};
use crate::motion_matching::{inertia::Velocities, root::wrapped};

impl Controller {
    /// Moves the root by the motion of the frame, then towards the object. Returns the distance of
    /// the adjustment, metres.
    pub(super) fn advance_root(&mut self, dt: f32) -> (f32, Clamping) {
        let (database, state) = (&self.database, &mut self.state);
        // Up to the frame that plays, from the one before it.
        let data = Velocities::of(
            database,
            state
                .frame
                .saturating_sub(1)
                .max(database.clip_of(state.frame).first),
        );
        let velocity = state.root.to_world(data.root) + state.offset.velocity.value;
        let yaw_rate = data.yaw_rate + state.offset.yaw_rate.value;
        // The oldest root makes room for the newest one.
        if let [first, ..] = state.past.as_mut_slice() {
            *first = state.root;
            state.past.rotate_left(1);
        }
        state.root.position += velocity * dt;
        state.root.yaw = wrapped(state.root.yaw + yaw_rate * dt);
        let speed = velocity.length();
        let adjusted = self.adjust(speed, yaw_rate.abs(), dt);
        (adjusted, self.clamp())
    }

    /// Moves the root towards the object. Returns the distance, metres.
    fn adjust(&mut self, speed: f32, yaw_rate: f32, dt: f32) -> f32 {
        let (settings, state) = (&self.settings, &mut self.state);
        let share = |half_life: f32| 1.0 - (-std::f32::consts::LN_2 * dt / half_life.max(1e-3)).exp();
        let object = state.object.root();
        let way = (object.position - state.root.position) * share(settings.adjustment_half_life_s);
        let way = way.clamp_length_max(settings.adjustment_ratio * speed * dt);
        state.root.position += way;
        let turn = wrapped(object.yaw - state.root.yaw) * share(settings.yaw_adjustment_half_life_s);
        let most = settings.yaw_adjustment_ratio * yaw_rate + settings.yaw_adjustment_rad_m * speed;
        state.root.yaw = wrapped(state.root.yaw + turn.max(-most * dt).min(most * dt));
        way.length()
    }

    /// Keeps the root within its limits around the object.
    fn clamp(&mut self) -> Clamping {
        let (settings, state) = (&self.settings, &mut self.state);
        let object = state.object.root();
        let away = state.root.position - object.position;
        let turned = wrapped(state.root.yaw - object.yaw);
        state.root.position = object.position + away.clamp_length_max(settings.clamp_m);
        state.root.yaw = wrapped(object.yaw + turned.clamp(-settings.clamp_rad, settings.clamp_rad));
        match away.length() > settings.clamp_m || turned.abs() > settings.clamp_rad {
            true => Clamping::Clamped,
            false => Clamping::Within,
        }
    }
}
