//! Interpolation of the pose between ticks, for displays of any rate.

use crate::skeleton::Pose;

/// Interpolates a controller's pose between its last two ticks.
#[derive(Clone, Debug, Default)]
pub struct PoseInterpolator {
    before: Pose,
    now: Pose,
    shown: Pose,
}

impl PoseInterpolator {
    /// Records the pose after a step; call it after every step.
    pub fn tick(&mut self, pose: &Pose) {
        std::mem::swap(&mut self.before, &mut self.now);
        copy(pose, &mut self.now);
        // The first pose, or one of another skeleton.
        if self.before.local.len() != self.now.local.len() {
            copy(pose, &mut self.before);
        }
    }

    /// Records the pose after a reset and forgets what was recorded before.
    pub fn cut(&mut self, pose: &Pose) {
        copy(pose, &mut self.before);
        copy(pose, &mut self.now);
    }

    /// Returns the pose between the previous tick (`share` 0) and the last one (1).
    pub fn show(&mut self, share: f32) -> &Pose {
        let share = share.clamp(0.0, 1.0);
        self.shown.trans = self.before.trans.lerp(self.now.trans, share);
        self.shown.local.clear();
        let pairs = self.before.local.iter().zip(&self.now.local);
        self.shown.local.extend(pairs.map(|(a, b)| a.slerp(*b, share)));
        &self.shown
    }
}

/// Copies a pose into buffers that are kept.
fn copy(from: &Pose, to: &mut Pose) {
    to.trans = from.trans;
    to.local.clone_from(&from.local);
}
