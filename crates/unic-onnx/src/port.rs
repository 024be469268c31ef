//! Inputs and outputs of the graphs: names, shapes and meanings.

mod inputs;
mod stages;
mod state;

pub(crate) use inputs::*;
pub(crate) use stages::*;
pub(crate) use state::*;

use serde::Serialize;

/// Input or output of a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Port {
    /// Name. An output that is the next value of a state has the suffix of [`Port::next_name`].
    pub(crate) name: &'static str,
    /// Lengths of the axes.
    pub(crate) shape: &'static [Axis],
    /// Source or use of the numbers.
    pub(crate) role: Role,
    /// Unit of the numbers, empty for those without one.
    pub(crate) unit: &'static str,
    /// Explanation for users of the graph.
    pub(crate) meaning: &'static str,
}

/// Source of an input's numbers, or use of an output's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Role {
    /// The character's animation, anew in every tick.
    Pose,
    /// The surroundings: ground and air.
    Surroundings,
    /// An array of `mesh.bin`, the same in every tick.
    Vertices,
    /// An output of the tick before.
    State,
    /// An output of another stage in the same tick.
    Stage,
    /// Positions to draw.
    Result,
}

/// Length of an axis of a port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Axis {
    /// Garment vertices: any number.
    Vertices,
    /// Joints of the skeleton, J.
    Joints,
    /// Numbers of a motion vector, D.
    Motion,
    /// Numbers of two motion vectors, 2 D.
    MotionPair,
    /// Masses on springs.
    Masses,
    /// Numbers of the latent vector.
    Latent,
    /// Channels of the motion code.
    Channels,
    /// Categories of a channel of the motion code.
    Categories,
    /// Numbers of the recurrence's state: real parts, then imaginary parts.
    Recurrence,
    /// Principal components of the prior.
    Components,
    /// A number that is the same for all models.
    Fixed(usize),
}

/// Lengths of the axes that depend on the model.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    pub(crate) joints: usize,
    pub(crate) motion: usize,
    pub(crate) masses: usize,
    pub(crate) latent: usize,
    pub(crate) channels: usize,
    pub(crate) categories: usize,
    pub(crate) recurrence: usize,
    pub(crate) components: usize,
}

/// Length of an axis in a file: a number, or the name of a length that is chosen at run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub(crate) enum Length {
    Fixed(usize),
    Named(&'static str),
}

impl Sizes {
    /// Returns the length of an axis.
    pub(crate) fn length(&self, axis: Axis) -> Length {
        Length::Fixed(match axis {
            Axis::Vertices => return Length::Named("vertices"),
            Axis::Joints => self.joints,
            Axis::Motion => self.motion,
            Axis::MotionPair => 2 * self.motion,
            Axis::Masses => self.masses,
            Axis::Latent => self.latent,
            Axis::Channels => self.channels,
            Axis::Categories => self.categories,
            Axis::Recurrence => self.recurrence,
            Axis::Components => self.components,
            Axis::Fixed(length) => length,
        })
    }

    /// Returns the shape of a port.
    pub(crate) fn shape(&self, port: Port) -> Vec<Length> {
        port.shape.iter().map(|&axis| self.length(axis)).collect()
    }
}

impl Port {
    /// Name of the output that holds the port's value after the tick.
    pub(crate) fn next_name(self) -> String {
        format!("{}_out", self.name)
    }
}
