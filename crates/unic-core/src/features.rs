//! Inputs of the deformation field at one vertex, and the frames that its state lives in.
//!
//! For training, evaluation and the animator, which share this code so that all of them feed the
//! networks the same numbers. Training calls [`write_frame_inputs`] for the vertices of a batch,
//! the animator for all vertices. Inputs that depend on the state are a few multiplications
//! ([`StateInputs`]); training repeats them on tensors, so that gradients flow through them.

use crate::{
    character::Garment,
    config::{DisplacementConfig, PointInput},
    transform::Rigid,
};
use glam::{Quat, Vec3};

/// Skinned frame of a garment vertex, in which its displacement is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointFrame {
    /// Skinned rest position LBS_i(rest), in world space, metres.
    pub skinned: Vec3,
    /// Rotation R_i from the vertex's own frame to the world.
    pub rotation: Quat,
    /// Mask m_i of the garment: the share of its displacement from skinning that the vertex keeps.
    pub share: f32,
}

impl PointFrame {
    /// Makes the frame of one vertex, given `world_from_rest` of every joint.
    pub fn new(garment: &Garment, vertex: usize, world_from_rest: &[Rigid]) -> Self {
        let rest = garment.rest.vertices[vertex];
        Self {
            skinned: garment.weights.position(vertex, rest, world_from_rest),
            rotation: garment.weights.rotation(vertex, world_from_rest),
            share: garment.share(vertex),
        }
    }

    /// Returns the displacement u = R_iᵀ (x − LBS_i(rest)) of a world position x.
    pub fn displacement(&self, world: Vec3) -> Vec3 {
        self.rotation.inverse() * (world - self.skinned)
    }

    /// Returns the masked displacement m_i u of a captured world position.
    ///
    /// Everything that models learn from and start from is masked here, so that no model sees the
    /// garment without its mask.
    pub fn blended_displacement(&self, world: Vec3) -> Vec3 {
        self.displacement(world) * self.share
    }

    /// Returns the world position x = LBS_i(rest) + R_i u of a displacement u.
    pub fn position(&self, displacement: Vec3) -> Vec3 {
        self.skinned + self.rotation * displacement
    }
}

/// Coordinate frame of one vertex's state: world = origin + rotation · (offset + state).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateFrame {
    frame: PointFrame,
    offset: Vec3,
}

impl StateFrame {
    /// Makes the frame of a state that is a position, given
    /// [`MotionState::world_from_state`](crate::motion::MotionState::world_from_state).
    pub fn of_position(world_from_state: Rigid) -> Self {
        let (skinned, rotation) = (world_from_state.translation, world_from_state.rotation);
        let share = 1.0;
        Self {
            frame: PointFrame {
                skinned,
                rotation,
                share,
            },
            offset: Vec3::ZERO,
        }
    }

    /// Makes the frame of a state that is a displacement from the prior's, both in `frame`.
    pub fn of_displacement(frame: PointFrame, prior: Vec3) -> Self {
        Self { frame, offset: prior }
    }

    /// Returns the world position of a state, metres.
    pub fn to_world(&self, state: Vec3) -> Vec3 {
        self.frame.position(self.offset + state)
    }

    /// Returns the state of a world position that the model has produced, to which the mask is
    /// applied already.
    pub fn to_state(&self, world: Vec3) -> Vec3 {
        self.frame.displacement(world) - self.offset
    }

    /// Returns the state of a captured world position, blended towards skinning by the mask.
    pub fn to_blended_state(&self, world: Vec3) -> Vec3 {
        self.frame.blended_displacement(world) - self.offset
    }

    /// Returns `state` after its world position was pushed to `world`; the mask reduces the push.
    pub fn pushed(&self, state: Vec3, world: Vec3) -> Vec3 {
        let target = self.to_state(world);
        match self.frame.share {
            // Without rounding: the usual case of no mask ends exactly at the target.
            1.0 => target,
            share => state.lerp(target, share),
        }
    }
}

/// Frame of a vertex at t, and its position at t − 1, from which the velocity of its skinned position
/// follows. A new history is advanced twice before its first use: for the frame before, and for the
/// present one.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointHistory {
    /// Frame at t.
    pub now: PointFrame,
    /// Skinned rest position LBS_i(rest) at t − 1, world space, metres.
    pub before: Vec3,
}

impl PointHistory {
    /// Advances by one frame.
    pub fn advance(&mut self, now: PointFrame) {
        self.before = self.now.skinned;
        self.now = now;
    }
}

/// Bounding box of the rest shape, by which rest positions are scaled to [−1, 1]³.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBox {
    /// Centre of the box, metres.
    pub centre: Vec3,
    /// Half of the longest side, metres; the scale of all axes.
    pub half_extent: f32,
}

impl RestBox {
    /// Returns the bounding box of the rest shape that a model is trained on.
    pub fn of(vertices: &[Vec3]) -> Self {
        // An empty mesh has a box at the origin.
        let first = vertices.first().copied().unwrap_or_default();
        let low = vertices.iter().fold(first, |a, &b| a.min(b));
        let high = vertices.iter().fold(first, |a, &b| a.max(b));
        Self {
            centre: (low + high) / 2.0,
            // Above zero for a single vertex, too: positions are divided by it.
            half_extent: ((high - low).max_element() / 2.0).max(f32::MIN_POSITIVE),
        }
    }

    /// Scales a rest position to [−1, 1]³.
    pub fn normalised(&self, rest: Vec3) -> Vec3 {
        (rest - self.centre) / self.half_extent
    }
}

/// Unit of [`PointInput::SkinVelocity`], m/s: the speed of a fast walk, so that inputs stay of order
/// one.
pub const VELOCITY_UNIT: f32 = 2.0;
/// Unit of time of [`PointInput::Velocity`], frames: a change by one scale in three frames is 1.
const VELOCITY_FRAMES: f32 = 3.0;

/// Time step and air, which turn differences between frames into velocities.
#[derive(Clone, Copy, Debug)]
pub struct StepConditions {
    /// Seconds between frames.
    pub dt: f32,
    /// Velocity of the air, m/s, world space; velocities are relative to it.
    pub wind: Vec3,
}

/// Writes the inputs that do not depend on the state, three numbers each, in the configuration's
/// order. The field reads them after the inputs that do, see [`StateInputs`].
///
/// `rest` is the vertex's rest position after [`RestBox::normalised`].
pub fn write_frame_inputs(
    config: &DisplacementConfig,
    rest: Vec3,
    history: &PointHistory,
    step: StepConditions,
    out: &mut [f32],
) {
    let StepConditions { dt, wind } = step;
    let own_from_world = history.now.rotation.inverse();
    let velocity = (history.now.skinned - history.before) / dt;
    let inputs = config.inputs.iter().filter(|input| !input.is_state());
    for (input, out) in inputs.zip(out.chunks_exact_mut(3)) {
        let value = match input {
            PointInput::Rest => rest,
            PointInput::Up => own_from_world * Vec3::Y,
            PointInput::SkinVelocity => own_from_world * (velocity - wind) / VELOCITY_UNIT,
            // `StateInputs` writes these.
            PointInput::Displacement | PointInput::Velocity => continue,
        };
        out.copy_from_slice(&value.to_array());
    }
}

/// Factors that turn the displacements d_{t−1} and d_{t−2} into the leading inputs of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateInputs {
    /// Factor of d_{t−1}, if the configuration has [`PointInput::Displacement`].
    pub displacement: Option<f32>,
    /// Factor of d_{t−1} − d_{t−2}, if the configuration has [`PointInput::Velocity`].
    pub velocity: Option<f32>,
    /// Order of the two inputs.
    pub order: StateOrder,
}

/// Order of the two inputs that depend on the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateOrder {
    /// Displacement d_{t−1} first, then its change.
    DisplacementFirst,
    /// Change of the displacement first, then d_{t−1}.
    VelocityFirst,
}

impl StateInputs {
    /// Returns the factors and the order of a configuration.
    pub fn new(config: &DisplacementConfig) -> Self {
        let at = |input| config.inputs.iter().position(|i| *i == input);
        let (displacement, velocity) = (at(PointInput::Displacement), at(PointInput::Velocity));
        let order = match (displacement, velocity) {
            (Some(displacement), Some(velocity)) if velocity < displacement => StateOrder::VelocityFirst,
            _ => StateOrder::DisplacementFirst,
        };
        Self {
            displacement: displacement.map(|_| 1.0 / config.scale_m),
            velocity: velocity.map(|_| 1.0 / (config.scale_m * VELOCITY_FRAMES)),
            order,
        }
    }

    /// Arranges the two inputs in the configuration's order.
    pub fn ordered<T>(&self, displacement: Option<T>, velocity: Option<T>) -> impl Iterator<Item = T> {
        let ordered = match self.order {
            StateOrder::DisplacementFirst => [displacement, velocity],
            StateOrder::VelocityFirst => [velocity, displacement],
        };
        ordered.into_iter().flatten()
    }

    /// Writes the leading inputs of one vertex from d_{t−1} and d_{t−2}.
    pub fn write(&self, displacement: Vec3, previous: Vec3, out: &mut [f32]) {
        let change = self.velocity.map(|k| (displacement - previous) * k);
        let ordered = self.ordered(self.displacement.map(|k| displacement * k), change);
        for (value, out) in ordered.zip(out.chunks_exact_mut(3)) {
            out.copy_from_slice(&value.to_array());
        }
    }
}

/// Shortens an output of the field to the length `limit`; shorter outputs stay exactly the same.
///
/// An output whose squared length is not finite becomes zero.
pub fn limited(output: Vec3, limit: f32) -> Vec3 {
    // A state decays from any finite value, but it would keep a NaN for ever.
    match output.length_squared().is_finite() {
        true => output.clamp_length_max(limit),
        false => Vec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn config(inputs: Vec<PointInput>) -> DisplacementConfig {
        DisplacementConfig {
            memory_s: 0.1,
            excursion_m: None,
            scale_m: 0.05,
            output_limit: 3.0,
            inputs,
        }
    }

    #[test]
    fn frame_inputs_are_invariant_to_a_rigid_motion_about_the_vertical() {
        use PointInput::{Rest, SkinVelocity, Up};
        let config = config(vec![Rest, Up, SkinVelocity]);
        let move_by = Rigid::new(Quat::from_rotation_y(2.0), Vec3::new(3.0, 0.0, -1.0));
        let history = PointHistory {
            now: PointFrame {
                skinned: Vec3::new(0.1, 1.0, 0.2),
                rotation: Quat::from_rotation_x(0.4),
                share: 1.0,
            },
            before: Vec3::new(0.05, 0.98, 0.2),
        };
        let moved = PointHistory {
            now: PointFrame {
                skinned: move_by.point(history.now.skinned),
                rotation: move_by.rotation * history.now.rotation,
                share: 1.0,
            },
            before: move_by.point(history.before),
        };
        let wind = Vec3::new(0.5, 0.2, -2.0);
        let step = |wind| StepConditions { dt: 1.0 / 30.0, wind };
        let (mut a, mut b) = ([0.0; 9], [0.0; 9]);
        write_frame_inputs(&config, Vec3::ONE, &history, step(wind), &mut a);
        write_frame_inputs(&config, Vec3::ONE, &moved, step(move_by.vector(wind)), &mut b);
        for (a, b) in a.iter().zip(b) {
            assert!((a - b).abs() < 2e-4, "{a} {b}");
        }
        let world = Vec3::new(0.3, 0.9, 0.1);
        let (u, v) = (
            history.now.displacement(world),
            moved.now.displacement(move_by.point(world)),
        );
        assert!((u - v).length() < 1e-6);
        assert!((history.now.position(u) - world).length() < 1e-6);
    }

    #[test]
    fn outputs_are_limited_in_length_and_zero_when_not_finite() {
        let short = Vec3::new(0.1, -0.2, 0.3);
        assert_eq!(limited(short, 2.0), short);
        assert!((limited(Vec3::new(30.0, 0.0, -40.0), 2.0) - Vec3::new(1.2, 0.0, -1.6)).length() < 1e-6);
        for lost in [
            Vec3::NAN,
            Vec3::INFINITY,
            Vec3::X * f32::NEG_INFINITY,
            Vec3::Y * 1e30,
        ] {
            assert_eq!(limited(lost, 2.0), Vec3::ZERO);
        }
    }

    #[test]
    fn state_inputs_follow_the_order_of_the_configuration() {
        use PointInput::{Displacement, Velocity};
        let mut out = [0.0; 6];
        let inputs = StateInputs::new(&config(vec![Velocity, Displacement]));
        inputs.write(Vec3::X * 0.05, Vec3::ZERO, &mut out);
        assert!((out[0] - 1.0 / 3.0).abs() < 1e-6 && (out[3] - 1.0).abs() < 1e-6);
        let inputs = StateInputs::new(&config(vec![Displacement]));
        inputs.write(Vec3::X * 0.05, Vec3::ZERO, &mut out[..3]);
        assert!((out[0] - 1.0).abs() < 1e-6);
    }
}
