//! What the field reads of a vertex: one path for training and runtime.
//!
//! Training gathers [`PointFrame`]s and calls [`write_frame_inputs`] for the vertices of a batch;
//! the animator does the same for all vertices. The part that depends on the state is a few
//! multiplications ([`StateInputs`]), which training repeats on tensors so that gradients flow.

use crate::{
    character::Garment,
    config::{DisplacementConfig, PointInput},
    transform::Rigid,
};
use glam::{Quat, Vec3};

/// Where the skeleton carries one garment vertex: the frame that its displacement lives in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PointFrame {
    /// LBS_i(rest), world, metres.
    pub skinned: Vec3,
    /// R_i: world from the vertex's own frame.
    pub rotation: Quat,
    /// m_i, the garment's mask: the share of a displacement that the vertex takes up.
    pub share: f32,
}

impl PointFrame {
    /// The frame of one vertex under `world_from_rest` of every joint.
    pub fn new(garment: &Garment, vertex: usize, world_from_rest: &[Rigid]) -> Self {
        let rest = garment.rest.vertices[vertex];
        Self {
            skinned: garment.weights.position(vertex, rest, world_from_rest),
            rotation: garment.weights.rotation(vertex, world_from_rest),
            share: garment.share(vertex),
        }
    }

    /// u = R_iᵀ (x − LBS_i(rest)) for a world position x.
    pub fn displacement(&self, world: Vec3) -> Vec3 {
        self.rotation.inverse() * (world - self.skinned)
    }

    /// m_i u for a world position of the garment as it is captured: what a model is to show of it. Everything
    /// that models learn and start from goes through here, so that they know the blend alone.
    pub fn blended_displacement(&self, world: Vec3) -> Vec3 {
        self.displacement(world) * self.share
    }

    /// x = LBS_i(rest) + R_i u.
    pub fn position(&self, displacement: Vec3) -> Vec3 {
        self.skinned + self.rotation * displacement
    }
}

/// Where the state of one vertex is counted from: world = origin + rotation · (offset + state).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    frame: PointFrame,
    offset: Vec3,
}

impl Place {
    /// Place of a state that is a position in a frame, see [`MotionState::world_from_state`](crate::motion::MotionState::world_from_state).
    pub fn in_frame(world_from_state: Rigid) -> Self {
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

    /// Of a state that is a displacement from where the prior puts the vertex, in its own frame.
    pub fn at_point(frame: PointFrame, prior: Vec3) -> Self {
        Self { frame, offset: prior }
    }

    /// World position of a state, metres.
    pub fn to_world(&self, state: Vec3) -> Vec3 {
        self.frame.position(self.offset + state)
    }

    /// State of a world position that is shown.
    pub fn to_state(&self, world: Vec3) -> Vec3 {
        self.frame.displacement(world) - self.offset
    }

    /// State of a captured world position: blended towards skinning by the garment's mask.
    pub fn to_blended_state(&self, world: Vec3) -> Vec3 {
        self.frame.blended_displacement(world) - self.offset
    }

    /// `state` after a push of what is shown to `moved`, as far as the garment's mask lets it.
    pub fn pushed(&self, state: Vec3, moved: Vec3) -> Vec3 {
        let target = self.to_state(moved);
        match self.frame.share {
            1.0 => target,
            share => state.lerp(target, share),
        }
    }
}

/// A vertex's frames at t, t − 1 and t − 2: enough for the velocity and acceleration of its skinning.
#[derive(Clone, Copy, Debug, Default)]
pub struct PointHistory {
    /// At t.
    pub now: PointFrame,
    /// LBS_i(rest) at t − 1.
    pub before: Vec3,
    /// LBS_i(rest) at t − 2.
    pub earlier: Vec3,
}

/// How far back a point is known when it moves on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Past {
    /// One frame: the first step after a reset.
    OneFrame,
    /// Two frames and more: every later step.
    TwoFrames,
}

impl PointHistory {
    /// Moves on by one frame. Where the frame before the previous one is not known, the point has
    /// moved steadily, as v_0 is v_1 in the motion vector.
    pub fn advance(&mut self, now: PointFrame, past: Past) {
        self.earlier = match past {
            Past::OneFrame => self.now.skinned * 2.0 - now.skinned,
            Past::TwoFrames => self.before,
        };
        self.before = self.now.skinned;
        self.now = now;
    }
}

/// Maps rest positions into [−1, 1]³ by the rest shape's bounding box, one scale for all axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RestBox {
    /// Centre, metres.
    pub centre: Vec3,
    /// Half the longest side, metres.
    pub half_extent: f32,
}

impl RestBox {
    /// Bounding box of the rest shape that the model is trained on.
    pub fn of(vertices: &[Vec3]) -> Self {
        let first = vertices.first().copied().unwrap_or_default();
        let low = vertices.iter().fold(first, |a, &b| a.min(b));
        let high = vertices.iter().fold(first, |a, &b| a.max(b));
        Self {
            centre: (low + high) / 2.0,
            half_extent: ((high - low).max_element() / 2.0).max(f32::MIN_POSITIVE),
        }
    }

    /// Position within the box.
    pub fn normalised(&self, rest: Vec3) -> Vec3 {
        (rest - self.centre) / self.half_extent
    }
}

/// Unit of [`PointInput::SkinVelocity`], m/s: a brisk run, so that inputs stay of order one.
pub const VELOCITY_UNIT: f32 = 2.0;
/// Unit of [`PointInput::SkinAcceleration`], m/s²: two g, a hard landing or a sharp arm swing.
pub const ACCELERATION_UNIT: f32 = 20.0;
/// Frames that [`PointInput::Velocity`] is measured in: a change of one scale in three frames is one.
const VELOCITY_FRAMES: f32 = 3.0;

/// What makes velocities of the differences between frames.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Seconds between frames.
    pub dt: f32,
    /// Velocity of the air, m/s, world space: velocities are relative to it.
    pub wind: Vec3,
}

/// Writes the inputs that do not depend on the state, in the configuration's order, three numbers each.
pub fn write_frame_inputs(
    config: &DisplacementConfig,
    rest: Vec3,
    history: &PointHistory,
    tick: Tick,
    out: &mut [f32],
) {
    let Tick { dt, wind } = tick;
    let own_from_world = history.now.rotation.inverse();
    let velocity = || (history.now.skinned - history.before) / dt;
    let inputs = config.inputs.iter().filter(|input| !input.is_state());
    for (input, out) in inputs.zip(out.chunks_exact_mut(3)) {
        let value = match input {
            PointInput::Rest => rest,
            PointInput::Up => own_from_world * Vec3::Y,
            PointInput::SkinVelocity => own_from_world * (velocity() - wind) / VELOCITY_UNIT,
            PointInput::SkinAcceleration => {
                let before = (history.before - history.earlier) / dt;
                own_from_world * (velocity() - before) / dt / ACCELERATION_UNIT
            }
            PointInput::Displacement | PointInput::Velocity => continue,
        };
        out.copy_from_slice(&value.to_array());
    }
}

/// Factors that turn the displacements d_{t−1} and d_{t−2} into the leading inputs of the field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateInputs {
    /// Input = `displacement` · d_{t−1}, where the configuration has it.
    pub displacement: Option<f32>,
    /// Input = `velocity` · (d_{t−1} − d_{t−2}), where the configuration has it.
    pub velocity: Option<f32>,
    /// Which of them stands first.
    pub order: StateOrder,
}

/// Order of the two inputs that come from the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateOrder {
    /// d_{t−1}, then its change.
    DisplacementFirst,
    /// The change, then d_{t−1}.
    VelocityFirst,
}

impl StateInputs {
    /// Factors of a configuration.
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

    /// The two inputs as the configuration orders them.
    pub fn ordered<T>(&self, displacement: Option<T>, velocity: Option<T>) -> impl Iterator<Item = T> {
        let ordered = match self.order {
            StateOrder::DisplacementFirst => [displacement, velocity],
            StateOrder::VelocityFirst => [velocity, displacement],
        };
        ordered.into_iter().flatten()
    }

    /// Writes the leading inputs of one vertex.
    pub fn write(&self, displacement: Vec3, previous: Vec3, out: &mut [f32]) {
        let change = self.velocity.map(|k| (displacement - previous) * k);
        let ordered = self.ordered(self.displacement.map(|k| displacement * k), change);
        for (value, out) in ordered.zip(out.chunks_exact_mut(3)) {
            out.copy_from_slice(&value.to_array());
        }
    }
}

/// Shortens a field output to `limit`; exact below it. An output that is not finite, or whose square is
/// not, counts as zero: a state forgets whatever is finite, but it would keep a NaN for ever.
pub fn limited(output: Vec3, limit: f32) -> Vec3 {
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
            scale_m: 0.05,
            output_limit: 3.0,
            inputs,
        }
    }

    #[test]
    fn frame_inputs_are_invariant_to_a_rigid_motion_about_the_vertical() {
        use PointInput::{Rest, SkinAcceleration, SkinVelocity, Up};
        let config = config(vec![Rest, Up, SkinVelocity, SkinAcceleration]);
        let move_by = Rigid::new(Quat::from_rotation_y(2.0), Vec3::new(3.0, 0.0, -1.0));
        let history = PointHistory {
            now: PointFrame {
                skinned: Vec3::new(0.1, 1.0, 0.2),
                rotation: Quat::from_rotation_x(0.4),
                share: 1.0,
            },
            before: Vec3::new(0.05, 0.98, 0.2),
            earlier: Vec3::new(0.02, 0.99, 0.21),
        };
        let moved = PointHistory {
            now: PointFrame {
                skinned: move_by.point(history.now.skinned),
                rotation: move_by.rotation * history.now.rotation,
                share: 1.0,
            },
            before: move_by.point(history.before),
            earlier: move_by.point(history.earlier),
        };
        let wind = Vec3::new(0.5, 0.2, -2.0);
        let tick = |wind| Tick { dt: 1.0 / 30.0, wind };
        let (mut a, mut b) = ([0.0; 12], [0.0; 12]);
        write_frame_inputs(&config, Vec3::ONE, &history, tick(wind), &mut a);
        write_frame_inputs(&config, Vec3::ONE, &moved, tick(move_by.vector(wind)), &mut b);
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
    fn outputs_are_limited_whatever_they_are() {
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
    fn the_first_step_has_no_acceleration_and_later_ones_are_second_differences() {
        let frame = |x: f32| PointFrame {
            skinned: Vec3::X * x,
            rotation: Quat::IDENTITY,
            share: 1.0,
        };
        let mut history = PointHistory::default();
        history.advance(frame(1.0), Past::TwoFrames);
        history.advance(frame(1.5), Past::OneFrame);
        assert_eq!(
            (history.now.skinned, history.before, history.earlier),
            (Vec3::X * 1.5, Vec3::X, Vec3::X * 0.5)
        );
        history.advance(frame(1.8), Past::TwoFrames);
        assert_eq!((history.before, history.earlier), (Vec3::X * 1.5, Vec3::X));
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
