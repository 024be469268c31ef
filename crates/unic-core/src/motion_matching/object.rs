//! Simulated object: the trajectory that a command asks for, damped by springs.

use super::{
    command::Command,
    root::{RootFrame, wrapped},
    spring::{Driven, Moving, Spring},
};
use glam::Vec2;
use serde::{Deserialize, Serialize};

/// Object that follows commands at once and smoothly; the character follows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SimulatedObject {
    /// Position (x, z), velocity and acceleration.
    pub motion: Driven<Vec2>,
    /// Yaw, radians, in −π..=π, and its rate.
    pub yaw: Moving<f32>,
    /// Yaw that was last asked for.
    pub goal_yaw: f32,
}

/// Springs of the object.
#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectSprings {
    pub(super) velocity: Spring,
    pub(super) yaw: Spring,
}

impl SimulatedObject {
    /// Puts the object at rest.
    pub fn at_rest(root: RootFrame) -> Self {
        Self {
            motion: Driven {
                position: root.position,
                ..Driven::default()
            },
            yaw: Moving {
                value: root.yaw,
                rate: 0.0,
            },
            goal_yaw: root.yaw,
        }
    }

    /// Position and yaw.
    pub fn root(&self) -> RootFrame {
        RootFrame {
            position: self.motion.position,
            yaw: self.yaw.value,
        }
    }

    /// Follows a command for `dt` seconds.
    pub(super) fn advance(&mut self, springs: &ObjectSprings, command: &Command, dt: f32) {
        self.motion = springs.velocity.drive(self.motion, command.velocity, dt);
        self.goal_yaw = command.goal_yaw(self.goal_yaw);
        // The goal on the nearer side.
        let goal = self.yaw.value + wrapped(self.goal_yaw - self.yaw.value);
        self.yaw = springs.yaw.toward(self.yaw, goal, dt);
        self.yaw.value = wrapped(self.yaw.value);
    }

    /// Predicts the root in each of the next ticks, into `out`. The command turns at `turn_rate`
    /// radians a second.
    pub(super) fn predict(
        mut self,
        springs: &ObjectSprings,
        command: &Command,
        turn_rate: f32,
        dt: f32,
        out: &mut [RootFrame],
    ) {
        let mut command = *command;
        for root in out {
            *root = self.root();
            self.advance(springs, &command, dt);
            command = turned(&command, turn_rate * dt);
        }
    }
}

/// Turns a command about +Y.
fn turned(command: &Command, angle: f32) -> Command {
    let turn = RootFrame {
        position: Vec2::ZERO,
        yaw: angle,
    };
    Command {
        velocity: turn.to_world(command.velocity),
        ..*command
    }
}
