//! Forward kinematics of a BVH skeleton.

use super::{Bvh, BvhJoint, Channel};
use glam::{Quat, Vec3};
use unic_core::transform::Rigid;

impl Bvh {
    /// Computes `world_from_joint` of every joint in one frame into `out`, in the file's unit and
    /// axes.
    ///
    /// # Panics
    /// When `frame` is not below [`len`](Self::len).
    pub fn world_from_joint(&self, frame: usize, out: &mut Vec<Rigid>) {
        let values = &self.values[frame * self.channels..(frame + 1) * self.channels];
        self.accumulate(out, |joint| joint.parent_from_joint(values));
    }

    /// Computes `world_from_joint` of every joint in the zero pose into `out`: all rotations are
    /// zero and all joints are at their offsets.
    pub fn world_from_joint_at_zero(&self, out: &mut Vec<Rigid>) {
        self.accumulate(out, |joint| Rigid::new(Quat::IDENTITY, joint.offset));
    }

    fn accumulate(&self, out: &mut Vec<Rigid>, parent_from_joint: impl Fn(&BvhJoint) -> Rigid) {
        out.clear();
        for joint in &self.joints {
            let local = parent_from_joint(joint);
            // Parents precede their children: `out[parent]` exists.
            out.push(joint.parent.map_or(local, |parent| out[parent] * local));
        }
    }
}

impl BvhJoint {
    /// Computes `parent_from_joint` from the channel values of one frame.
    fn parent_from_joint(&self, values: &[f32]) -> Rigid {
        let mut translation = self.offset;
        let mut rotation = Quat::IDENTITY;
        for (channel, &value) in self.channels.iter().zip(&values[self.first_channel..]) {
            match channel {
                Channel::Position(axis) => translation[axis.index()] = value,
                Channel::Rotation(axis) => rotation *= about(axis.vector(), value),
            }
        }
        Rigid::new(rotation.normalize(), translation)
    }
}

/// Returns the rotation about a unit axis.
fn about(axis: Vec3, degrees: f32) -> Quat {
    // Files accumulate whole turns. They are removed in f64, before the conversion to f32 radians
    // loses the digits of the remaining angle.
    Quat::from_axis_angle(axis, f64::from(degrees).rem_euclid(360.0).to_radians() as f32)
}
