//! Masses on damped springs that follow the joints: a memory of the motion in the world's axes.
//!
//! Cloth that hangs from a body lags behind it, flies out in a turn and swings on after a stop. A
//! mass on a spring does the same, and needs no training: it knows inertia, centrifugal forces and
//! the drag of the air. Joint j moves with velocity v, the air with velocity a. A mass with offset
//! e from the joint and natural angular frequency ω obeys
//!
//! ë = −ω² e − 2 ζ ω (ė + v − d) − v̇,
//!
//! where d is v for [`SpringDamping::Joint`] and a for [`SpringDamping::Air`]. Joints move evenly
//! between two frames, for which the solution is exact.
//! Networks read ω e in the joint's own frame: the speed at which the mass passes the joint when it
//! swings freely. Stiff springs and soft ones then have about the same size.

use super::{MotionError, frame::Step};
use crate::{skeleton::Skeleton, transform::Rigid};
use glam::Vec3;
use serde::{Deserialize, Serialize};
use std::{f32::consts::TAU, ops::RangeInclusive};

/// Natural frequencies of usable springs, Hz.
pub const FREQUENCIES_HZ: RangeInclusive<f32> = 0.01..=100.0;

/// Damping ratios of usable springs: at 1 a mass would return without swinging.
pub const DAMPING_RATIOS: RangeInclusive<f32> = 0.01..=0.99;

/// Speed above which a joint is somewhere else, m/s, and takes its masses along. The hand of a
/// pitcher reaches 40 m/s.
const MOST_M_S: f32 = 100.0;

/// Body that the velocity of a mass is damped towards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpringDamping {
    /// The joint: a mass comes to rest at a joint that moves evenly.
    Joint,
    /// The air: a mass trails behind a joint that moves evenly.
    Air,
}

/// A damped spring.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spring {
    /// Natural frequency ω / 2π, Hz, within [`FREQUENCIES_HZ`].
    pub frequency_hz: f32,
    /// Damping ratio ζ, within [`DAMPING_RATIOS`].
    pub damping_ratio: f32,
    /// Body that the velocity is damped towards.
    pub damping: SpringDamping,
}

/// Joints that carry springs, and the springs that each of them carries.
///
/// The motion vector holds the offsets of their masses times ω after everything else: 3 numbers a
/// spring, the springs of a joint adjacent.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JointSprings {
    /// Joints that springs hang from.
    pub joints: Vec<usize>,
    /// Springs of each joint.
    pub springs: Vec<Spring>,
}

impl JointSprings {
    /// Count of numbers in the motion vector.
    pub fn numbers(&self) -> usize {
        3 * self.masses()
    }

    /// Returns whether there are no springs.
    pub fn is_empty(&self) -> bool {
        self.masses() == 0
    }

    /// Count of masses.
    pub fn masses(&self) -> usize {
        self.joints.len() * self.springs.len()
    }

    /// Checks springs that come from a file.
    ///
    /// # Errors
    /// A joint that the skeleton does not have, a frequency or damping ratio out of range.
    pub(super) fn check(&self, skeleton: &Skeleton) -> Result<(), MotionError> {
        let joints = skeleton.len();
        if let Some(&joint) = self.joints.iter().find(|joint| **joint >= joints) {
            return Err(MotionError::SpringJoint { joint, joints });
        }
        match self.springs.iter().find(|s| !s.is_usable()) {
            None => Ok(()),
            Some(spring) => Err(MotionError::Spring {
                frequency_hz: spring.frequency_hz,
                damping_ratio: spring.damping_ratio,
            }),
        }
    }
}

impl Spring {
    /// Springs of the training presets, with periods of 1.4, 0.7 and 0.3 s: each damped by the
    /// joint and by the air.
    pub const OF_PRESETS: [Self; 6] = [
        Self::new(0.7, 0.5, SpringDamping::Joint),
        Self::new(0.7, 0.5, SpringDamping::Air),
        Self::new(1.5, 0.4, SpringDamping::Joint),
        Self::new(1.5, 0.4, SpringDamping::Air),
        Self::new(3.5, 0.5, SpringDamping::Joint),
        Self::new(3.5, 0.5, SpringDamping::Air),
    ];

    const fn new(frequency_hz: f32, damping_ratio: f32, damping: SpringDamping) -> Self {
        Self {
            frequency_hz,
            damping_ratio,
            damping,
        }
    }

    /// Returns whether frequency and damping ratio are within [`FREQUENCIES_HZ`] and
    /// [`DAMPING_RATIOS`].
    pub fn is_usable(&self) -> bool {
        FREQUENCIES_HZ.contains(&self.frequency_hz) && DAMPING_RATIOS.contains(&self.damping_ratio)
    }

    /// Offset per velocity v − a of a mass that trails evenly, seconds.
    pub fn trail_s(&self) -> f32 {
        match self.damping {
            SpringDamping::Joint => 0.0,
            SpringDamping::Air => -2.0 * self.damping_ratio / (TAU * self.frequency_hz),
        }
    }

    /// Matrix that takes (e, ė) to their values after `seconds`, for a joint at rest in still air.
    pub fn propagator(&self, seconds: f32) -> [[f32; 2]; 2] {
        let omega = TAU * self.frequency_hz;
        let decay_rate = self.damping_ratio * omega;
        let swing = omega * (1.0 - self.damping_ratio * self.damping_ratio).sqrt();
        let (sin, cos) = (swing * seconds).sin_cos();
        let decay = (-decay_rate * seconds).exp();
        let (mixed, sin) = (decay_rate / swing * sin, sin / swing);
        [
            [decay * (cos + mixed), decay * sin],
            [-decay * omega * omega * sin, decay * (cos - mixed)],
        ]
    }
}

/// A mass, in the axes of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mass {
    /// Offset from the joint, m.
    offset: Vec3,
    /// Velocity of the mass, m/s; not that of the joint.
    velocity: Vec3,
}

/// The masses of a moving character.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Masses(Vec<Mass>);

impl Masses {
    /// Masses at rest at their joints.
    pub(super) fn at_joints(springs: &JointSprings) -> Self {
        Self(vec![Mass::default(); springs.masses()])
    }

    /// Lets the masses follow the joints evenly, as though these had always moved as in this step.
    /// A joint that is too fast has them at rest with it.
    pub(super) fn start(&mut self, springs: &JointSprings, step: Step) {
        let all = springs
            .joints
            .iter()
            .flat_map(|joint| springs.springs.iter().map(move |s| (joint, s)));
        for (mass, (&joint, spring)) in self.0.iter_mut().zip(all) {
            let velocity = step.velocity(joint);
            if velocity.length() <= MOST_M_S {
                *mass = Mass {
                    offset: (velocity - step.wind) * spring.trail_s(),
                    velocity,
                };
            }
        }
    }

    /// Advances the masses by a step of the joints.
    pub(super) fn advance(&mut self, springs: &JointSprings, step: Step) {
        let count = springs.springs.len();
        for (s, spring) in springs.springs.iter().enumerate() {
            let m = spring.propagator(step.dt);
            let of_spring = self.0.iter_mut().skip(s).step_by(count.max(1));
            for (mass, &joint) in of_spring.zip(&springs.joints) {
                let velocity = step.velocity(joint);
                if velocity.length() > MOST_M_S {
                    continue;
                }
                let trail = (velocity - step.wind) * spring.trail_s();
                // About the even trail, in the joint's moving frame, the motion is free.
                let (e, de) = (mass.offset - trail, mass.velocity - velocity);
                mass.offset = trail + e * m[0][0] + de * m[0][1];
                mass.velocity = velocity + e * m[1][0] + de * m[1][1];
            }
        }
    }

    /// Writes the offsets times ω in the frames of their joints, m/s.
    pub(super) fn write(&self, springs: &JointSprings, world_from_joint: &[Rigid], out: &mut [f32]) {
        let per_joint = 3 * springs.springs.len();
        let masses = self.0.chunks_exact(springs.springs.len().max(1));
        let joints = out.chunks_exact_mut(per_joint.max(1)).zip(masses);
        for ((out, masses), &joint) in joints.zip(&springs.joints) {
            let joint_from_world = world_from_joint[joint].rotation.conjugate();
            let masses = masses.iter().zip(&springs.springs);
            for (out, (mass, spring)) in out.chunks_exact_mut(3).zip(masses) {
                let scaled = mass.offset * (TAU * spring.frequency_hz);
                out.copy_from_slice(&(joint_from_world * scaled).to_array());
            }
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// First mass whose numbers are not finite.
    pub(super) fn first_unusable(&self) -> Option<usize> {
        let finite = |m: &Mass| m.offset.is_finite() && m.velocity.is_finite();
        self.0.iter().position(|m| !finite(m))
    }
}
