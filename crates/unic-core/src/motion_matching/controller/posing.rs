//! Pose of the frame that plays, with its offset and locked feet.

use super::Controller;
use crate::motion_matching::feet::{Contact, FootTick};
use glam::Quat;

impl Controller {
    /// Makes the pose of the frame that plays with its offset, and its forward kinematics.
    pub(super) fn rebuild(&mut self) {
        let (database, state, scratch) = (&self.database, &self.state, &mut self.scratch);
        let skeleton = &database.skeleton;
        let root_joint = skeleton.root();
        let rotations = database.rotations(state.frame).iter().zip(&state.offset.joints);
        scratch.pose.local.clear();
        (scratch.pose.local).extend(
            rotations
                .map(|(rotation, offset)| (Quat::from_scaled_axis(offset.value) * *rotation).normalize()),
        );
        let local = &mut scratch.pose.local[root_joint];
        *local = (state.root.rotation() * *local).normalize();
        let hips = database.hips(state.frame) + state.offset.hips.value;
        scratch.pose.trans = state.root.world_from_root().point(hips) - skeleton.joints()[root_joint];
        skeleton.forward_kinematics(&scratch.pose, &mut scratch.world);
    }

    pub(super) fn advance_feet(&mut self, dt: f32) {
        let Self {
            database,
            state,
            scratch,
            ..
        } = self;
        let rules = self.settings.foot_rules();
        let contacts = database.contacts(state.frame);
        for (side, foot) in state.feet.iter_mut().enumerate() {
            let tick = FootTick {
                leg: database.settings.legs[side],
                contact: if contacts[side] {
                    Contact::Stands
                } else {
                    Contact::Swings
                },
                rest_height_m: database.settings.toe_heights_m[side],
                dt,
            };
            foot.advance(
                &tick,
                &rules,
                &database.skeleton,
                &mut scratch.pose,
                &scratch.world,
            );
        }
    }

    /// Bends the legs to the feet of a restored state.
    pub(super) fn show_feet(&mut self) {
        for (side, foot) in self.state.feet.iter().enumerate() {
            let leg = self.database.settings.legs[side];
            let rest = self.database.settings.toe_heights_m[side];
            foot.show(
                leg,
                rest,
                &self.database.skeleton,
                &mut self.scratch.pose,
                &self.scratch.world,
            );
        }
    }
}
