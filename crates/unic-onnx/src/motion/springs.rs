//! Masses on springs ([`unic_core::motion::JointSprings`]) as a part of a graph.

use super::Step;
use crate::{
    graph::{Graph, Value},
    kinematics::Joints,
    port::{SPRING_OFFSETS, SPRING_VELOCITIES, WIND},
};
use std::f32::consts::TAU;
use unic_core::{Model, motion::Spring};

/// Masses after a tick, N of them: those of a joint adjacent.
#[derive(Clone, Copy)]
pub(super) struct Masses {
    /// Offsets from the joints in the world's axes (N, 3), m.
    pub(super) offsets: Value,
    /// Velocities of the masses (N, 3), m/s.
    pub(super) velocities: Value,
}

/// Springs of one model.
#[derive(Clone, Copy)]
pub(super) struct SpringBuilder<'a> {
    pub(super) model: &'a Model,
}

impl SpringBuilder<'_> {
    fn is_empty(self) -> bool {
        self.model.config().motion.springs.is_empty()
    }

    /// Masses of the first frame, which follow the joints evenly. None without springs.
    pub(super) fn start(self, graph: &mut Graph, step: Step) -> Option<Masses> {
        if self.is_empty() {
            return None;
        }
        let velocities = self.joint_velocities(graph, step);
        let offsets = self.trail(graph, velocities);
        Some(Masses { offsets, velocities })
    }

    /// The masses of the inputs, advanced by a step of the joints. None without springs.
    pub(super) fn advance(self, graph: &mut Graph, step: Step) -> Option<Masses> {
        if self.is_empty() {
            return None;
        }
        let seconds = 1.0 / self.model.config().fps;
        let velocity = self.joint_velocities(graph, step);
        let trail = self.trail(graph, velocity);
        let (offsets, velocities) = (graph.input(SPRING_OFFSETS), graph.input(SPRING_VELOCITIES));
        let (e, de) = (graph.sub(offsets, trail), graph.sub(velocities, velocity));
        let mut row = |about: Value, row: usize| {
            let factors = [0, 1].map(|column| self.column(graph, |s| s.propagator(seconds)[row][column]));
            let [e, de] = [graph.mul(e, factors[0]), graph.mul(de, factors[1])];
            let sum = graph.add(e, de);
            graph.add(about, sum)
        };
        Some(Masses {
            offsets: row(trail, 0),
            velocities: row(velocity, 1),
        })
    }

    /// Numbers of the motion vector (N, 3): offsets times ω in the frames of the joints.
    pub(super) fn numbers(self, graph: &mut Graph, masses: Masses, joints: Joints) -> Value {
        let rotations = graph.take(joints.rotations, &self.joints(), 0);
        let matrices = graph.matrices(rotations);
        let local = graph.unrotated(matrices, masses.offsets);
        let omega = self.column(graph, |s| TAU * s.frequency_hz);
        graph.mul(local, omega)
    }

    /// Velocity of the joint of each mass (N, 3).
    fn joint_velocities(self, graph: &mut Graph, step: Step) -> Value {
        let moved = graph.sub(step.to.positions, step.from.positions);
        let velocities = graph.scale(moved, self.model.config().fps);
        graph.take(velocities, &self.joints(), 0)
    }

    /// Offsets (N, 3) of masses that follow their joints evenly.
    fn trail(self, graph: &mut Graph, velocities: Value) -> Value {
        let wind = graph.input(WIND);
        let in_air = graph.sub(velocities, wind);
        let seconds = self.column(graph, Spring::trail_s);
        graph.mul(in_air, seconds)
    }

    /// A number of each mass's spring (N, 1).
    fn column(self, graph: &mut Graph, number: impl Fn(&Spring) -> f32) -> Value {
        let springs = &self.model.config().motion.springs;
        let of_joint: Vec<f32> = springs.springs.iter().map(number).collect();
        let all = of_joint.repeat(springs.joints.len());
        graph.constant(&[all.len(), 1], &all)
    }

    /// Joint of each mass.
    fn joints(self) -> Vec<i64> {
        let springs = &self.model.config().motion.springs;
        let of_joint = |joint: &usize| vec![*joint as i64; springs.springs.len()];
        springs.joints.iter().flat_map(of_joint).collect()
    }
}
