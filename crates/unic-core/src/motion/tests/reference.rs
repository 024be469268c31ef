//! Reference implementation of the motion vector, for whole clips.
//!
//! It computes with rotation matrices in f64 instead of quaternions, and uses nothing of the code
//! under test but its input types.

use crate::{
    motion::{MotionLayout, MotionSpec, VelocityScheme},
    skeleton::Skeleton,
};
use glam::{DMat3, DVec3, Vec3};

/// Clip of translations and local rotations (axis times angle), one array a frame.
pub(super) struct Motion {
    pub(super) trans: Vec<Vec3>,
    pub(super) axis_angles: Vec<Vec<Vec3>>,
    pub(super) ground: f32,
    pub(super) dt: f32,
}

/// Joints of one frame in the world.
struct Joints {
    rotation: Vec<DMat3>,
    position: Vec<DVec3>,
}

/// Coordinate frame of a motion vector.
#[derive(Clone, Copy)]
struct Frame {
    rotation: DMat3,
    origin: DVec3,
}

/// Returns c_0, c_1, ... of a clip.
pub(super) fn motion_vectors(spec: &MotionSpec, skeleton: &Skeleton, motion: &Motion) -> Vec<Vec<f64>> {
    let count = motion.trans.len();
    let joints: Vec<Joints> = (0..count)
        .map(|t| forward_kinematics(skeleton, motion.trans[t], &motion.axis_angles[t]))
        .collect();
    let frames = frames(spec, skeleton, &joints, f64::from(motion.dt));
    (0..count)
        .map(|t| {
            let (from, frame_of_velocity) = match spec.velocity {
                VelocityScheme::Backward => (t.max(1) - 1, t.max(1)),
                VelocityScheme::Forward => (t.min(count - 2), t),
            };
            let step = (&joints[from], &joints[from + 1]);
            let local: Vec<DMat3> = motion.axis_angles[t].iter().map(|&a| rodrigues(a)).collect();
            let vector = Vector {
                spec,
                skeleton,
                motion,
                now: &joints[t],
                step,
                local: &local,
                frame: frames[t],
                velocity_frame: frames[frame_of_velocity],
            };
            vector.numbers()
        })
        .collect()
}

/// Everything that one vector is made of.
struct Vector<'a> {
    spec: &'a MotionSpec,
    skeleton: &'a Skeleton,
    motion: &'a Motion,
    now: &'a Joints,
    /// Joints before and after the step that velocities are differences of.
    step: (&'a Joints, &'a Joints),
    /// Rotations of the joints relative to their parents.
    local: &'a [DMat3],
    frame: Frame,
    velocity_frame: Frame,
}

impl Vector<'_> {
    fn numbers(&self) -> Vec<f64> {
        let (spec, now, step) = (self.spec, self.now, self.step);
        let Frame { rotation, origin } = self.frame;
        let root = self.skeleton.root();
        let others: Vec<usize> = (0..self.skeleton.len()).filter(|&j| j != root).collect();
        let si = spec.layout == MotionLayout::Heading;
        let unit = if si { f64::from(self.motion.dt) } else { 1.0 };
        let height = |j: usize| now.position[j].y - f64::from(self.motion.ground);
        let moved = |j: usize| step.1.position[j] - step.0.position[j];
        let velocity = |world: DVec3| self.velocity_frame.rotation.transpose() * world / unit;
        let mut c: Vec<f64> = Vec::new();
        c.extend(match spec.layout {
            MotionLayout::Paper => (rotation.transpose() * (now.position[root] - origin)).to_array(),
            MotionLayout::PaperRootRelative => [0.0; 3],
            MotionLayout::Heading => [0.0, height(root), 0.0],
        });
        c.extend(velocity(moved(root)).to_array());
        c.extend(rows(rotation.transpose() * now.rotation[root]));
        let turn = step.1.rotation[root] * step.0.rotation[root].transpose();
        c.extend(velocity(logarithm(turn)).to_array());
        others.iter().for_each(|&j| c.extend(rows(self.local[j])));
        let position = |j: usize| rotation.transpose() * (now.position[j] - origin);
        others.iter().for_each(|&j| c.extend(position(j).to_array()));
        others
            .iter()
            .for_each(|&j| c.extend(velocity(moved(j)).to_array()));
        for (j, rest) in spec.contact_joints.into_iter().zip(spec.contact_rest_heights_m) {
            let low = height(j) - f64::from(rest) < 0.05;
            let contact = if si {
                low && moved(j).length() / unit < 0.25
            } else {
                moved(j).length_squared() < 0.002
            };
            c.push(f64::from(u8::from(contact)));
        }
        c
    }
}

/// Returns the coordinate frame of every c_t.
fn frames(spec: &MotionSpec, skeleton: &Skeleton, joints: &[Joints], dt: f64) -> Vec<Frame> {
    let root = skeleton.root();
    let first = Frame {
        rotation: joints[0].rotation[root],
        origin: joints[0].position[root],
    };
    match spec.layout {
        MotionLayout::Paper => return vec![first; joints.len()],
        MotionLayout::PaperRootRelative => {
            let at_root = |j: &Joints| Frame {
                origin: j.position[root],
                ..first
            };
            return joints.iter().map(at_root).collect();
        }
        MotionLayout::Heading => {}
    }
    let rotations: Vec<DMat3> = joints.iter().map(|j| j.rotation[root]).collect();
    let own_yaw = |r: &DMat3| (r.z_axis.x - r.x_axis.z).atan2(r.x_axis.x + r.z_axis.z);
    let mut yaw = own_yaw(&rotations[0]);
    let mut yaws = vec![yaw];
    for pair in rotations.windows(2) {
        yaw += logarithm(pair[1] * pair[0].transpose()).y;
        let error = own_yaw(&pair[1]) - yaw;
        let evidence = (1.0 + pair[1].y_axis.y) / 2.0;
        yaw += (1.0 - (-evidence.powi(2) * dt / 0.1).exp()) * error.sin().atan2(error.cos());
        yaws.push(yaw);
    }
    let origins = joints.iter().map(|j| j.position[root]);
    let rotations = yaws.into_iter().map(DMat3::from_rotation_y);
    rotations
        .zip(origins)
        .map(|(rotation, origin)| Frame { rotation, origin })
        .collect()
}

fn forward_kinematics(skeleton: &Skeleton, trans: Vec3, axis_angles: &[Vec3]) -> Joints {
    let joint = |j: usize| skeleton.joints()[j].as_dvec3();
    let global = |local: &[Vec3], mut j: usize| {
        let mut rotation = rodrigues(local[j]);
        while let Some(parent) = skeleton.parents()[j] {
            rotation = rodrigues(local[parent]) * rotation;
            j = parent;
        }
        rotation
    };
    let position = |mut j: usize| {
        let mut sum = DVec3::ZERO;
        while let Some(parent) = skeleton.parents()[j] {
            let bone = global(skeleton.rest_pose(), parent).transpose() * (joint(j) - joint(parent));
            sum += global(axis_angles, parent) * bone;
            j = parent;
        }
        sum + joint(j) + trans.as_dvec3()
    };
    Joints {
        rotation: (0..skeleton.len()).map(|j| global(axis_angles, j)).collect(),
        position: (0..skeleton.len()).map(position).collect(),
    }
}

/// Rotation matrix R = I + sin θ K + (1 − cos θ) K² (Rodrigues).
fn rodrigues(axis_angle: Vec3) -> DMat3 {
    let axis_angle = axis_angle.as_dvec3();
    let angle = axis_angle.length();
    let k = axis_angle / angle.max(1e-12);
    let cross = DMat3::from_cols(k.cross(DVec3::X), k.cross(DVec3::Y), k.cross(DVec3::Z));
    DMat3::IDENTITY + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

/// Axis times angle of a rotation matrix, from its skew-symmetric part.
fn logarithm(r: DMat3) -> DVec3 {
    let skew = DVec3::new(
        r.y_axis.z - r.z_axis.y,
        r.z_axis.x - r.x_axis.z,
        r.x_axis.y - r.y_axis.x,
    );
    let trace = r.x_axis.x + r.y_axis.y + r.z_axis.z;
    let angle = (skew.length() / 2.0).atan2((trace - 1.0) / 2.0);
    skew.normalize_or_zero() * angle
}

/// First two rows of a matrix.
fn rows(r: DMat3) -> [f64; 6] {
    let (x, y, z) = (r.x_axis, r.y_axis, r.z_axis);
    [x.x, y.x, z.x, x.y, y.y, z.y]
}
