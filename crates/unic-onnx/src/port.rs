//! Inputs and outputs of the graphs: names, shapes and meanings.

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

use Axis::{
    Categories, Channels, Components, Fixed, Joints, Latent, Motion, MotionPair, Recurrence, Vertices,
};

/// World position of the root joint minus its rest position.
pub(crate) const ROOT: Port = Port {
    name: "root",
    shape: &[Fixed(3)],
    role: Role::Pose,
    unit: "m",
    meaning: "world position of the root joint minus its rest position",
};
/// Local rotations of the joints.
pub(crate) const ROTATIONS: Port = Port {
    name: "rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::Pose,
    unit: "",
    meaning: "rotation of each joint relative to its parent, of the root joint relative to the world: unit quaternions x, y, z, w",
};
/// `root` of the next frame.
pub(crate) const NEXT_ROOT: Port = Port {
    name: "next_root",
    shape: &[Fixed(3)],
    role: Role::Pose,
    unit: "m",
    meaning: "root of the frame after this one",
};
/// `rotations` of the next frame.
pub(crate) const NEXT_ROTATIONS: Port = Port {
    name: "next_rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::Pose,
    unit: "",
    meaning: "rotations of the frame after this one",
};
/// Flag of a known next frame.
pub(crate) const NEXT_KNOWN: Port = Port {
    name: "next_known",
    shape: &[Fixed(1)],
    role: Role::Pose,
    unit: "",
    meaning: "1 if next_root and next_rotations are known; 0 takes backward differences and ignores them, though they must be finite",
};
/// Height of the ground.
pub(crate) const GROUND_HEIGHT: Port = Port {
    name: "ground_height",
    shape: &[Fixed(1)],
    role: Role::Surroundings,
    unit: "m",
    meaning: "height of the ground under the character, in the world",
};
/// Velocity of the air.
pub(crate) const WIND: Port = Port {
    name: "wind",
    shape: &[Fixed(3)],
    role: Role::Surroundings,
    unit: "m/s",
    meaning: "velocity of the air, in the world; zero in still air",
};

/// Rest positions.
pub(crate) const REST: Port = Port {
    name: "rest",
    shape: &[Vertices, Fixed(3)],
    role: Role::Vertices,
    unit: "m",
    meaning: "rest position of each vertex, in the space of the character's rest pose",
};
/// Dense skinning weights.
pub(crate) const SKINNING_WEIGHTS: Port = Port {
    name: "skinning_weights",
    shape: &[Vertices, Joints],
    role: Role::Vertices,
    unit: "",
    meaning: "skinning weight of each joint at each vertex; each row sums to 1",
};
/// Mask of the garment.
pub(crate) const MASK: Port = Port {
    name: "mask",
    shape: &[Vertices, Fixed(1)],
    role: Role::Vertices,
    unit: "",
    meaning: "share, 0 to 1, of a vertex's displacement from skinning",
};
/// Mean displacement.
pub(crate) const PRIOR_MEAN: Port = Port {
    name: "prior_mean",
    shape: &[Vertices, Fixed(3)],
    role: Role::Vertices,
    unit: "m",
    meaning: "mean displacement from skinning in training, in each vertex's rotated frame",
};
/// Principal components.
pub(crate) const PRIOR_SHAPES: Port = Port {
    name: "prior_shapes",
    shape: &[Vertices, Fixed(3), Components],
    role: Role::Vertices,
    unit: "m",
    meaning: "principal components of the displacement, in each vertex's rotated frame",
};

/// Positions of the joints in the last frame.
pub(crate) const JOINT_POSITIONS: Port = Port {
    name: "joint_positions",
    shape: &[Joints, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "world position of each joint",
};
/// Rotations of the joints in the last frame.
pub(crate) const JOINT_ROTATIONS: Port = Port {
    name: "joint_rotations",
    shape: &[Joints, Fixed(4)],
    role: Role::State,
    unit: "",
    meaning: "world rotation of each joint: unit quaternions x, y, z, w",
};
/// Heading of the character.
pub(crate) const YAW: Port = Port {
    name: "yaw",
    shape: &[Fixed(1), Fixed(1)],
    role: Role::State,
    unit: "rad",
    meaning: "heading of the character about +Y; at 0 it faces +Z",
};
/// Rotation of the sequence frame.
pub(crate) const SEQUENCE_ROTATION: Port = Port {
    name: "sequence_rotation",
    shape: &[Fixed(1), Fixed(4)],
    role: Role::State,
    unit: "",
    meaning: "world rotation of the root joint in the first frame: a unit quaternion x, y, z, w",
};
/// Origin of the sequence frame.
pub(crate) const SEQUENCE_ORIGIN: Port = Port {
    name: "sequence_origin",
    shape: &[Fixed(1), Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "world position of the root joint in the first frame",
};
/// Normalised motion vector of the last frame.
pub(crate) const MOTION: Port = Port {
    name: "motion",
    shape: &[Fixed(1), Motion],
    role: Role::State,
    unit: "",
    meaning: "motion vector, normalised",
};
/// State of the prior's recurrence.
pub(crate) const RECURRENCE: Port = Port {
    name: "recurrence",
    shape: &[Fixed(1), Recurrence],
    role: Role::State,
    unit: "",
    meaning: "oscillators of the prior: all real parts, then all imaginary parts",
};
/// Displacements of the vertices.
pub(crate) const DISPLACEMENT: Port = Port {
    name: "displacement",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "displacement of each vertex from the prior, in its rotated frame",
};
/// Displacements one frame earlier.
pub(crate) const DISPLACEMENT_BEFORE: Port = Port {
    name: "displacement_before",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "displacement one tick earlier",
};
/// Skinned rest positions.
pub(crate) const SKINNED: Port = Port {
    name: "skinned",
    shape: &[Vertices, Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "rest position of each vertex after linear blend skinning, in the world",
};
/// Positions relative to the root joint.
pub(crate) const ROOT_RELATIVE: Port = Port {
    name: "root_relative",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "position of each vertex relative to the root joint, in the frame of the motion vector",
};

/// Two normalised motion vectors.
pub(crate) const MOTION_PAIR: Port = Port {
    name: "motion_pair",
    shape: &[Fixed(1), MotionPair],
    role: Role::Stage,
    unit: "",
    meaning: "motion vectors of the last frame and of this one, normalised",
};
/// Latent vector.
pub(crate) const LATENT: Port = Port {
    name: "latent",
    shape: &[Fixed(1), Latent],
    role: Role::Stage,
    unit: "",
    meaning: "code of the motion, which the field reads; the category with the largest logit in each channel",
};
/// Logits of the motion code.
pub(crate) const LOGITS: Port = Port {
    name: "logits",
    shape: &[Channels, Categories],
    role: Role::Stage,
    unit: "",
    meaning: "logits of the code's categories, for programs that pick categories by a rule of their own",
};
/// Coefficients of the prior.
pub(crate) const COEFFICIENTS: Port = Port {
    name: "coefficients",
    shape: &[Fixed(1), Components],
    role: Role::Stage,
    unit: "",
    meaning: "coefficients of the prior's principal components",
};
/// Displacements of the prior.
pub(crate) const PRIOR: Port = Port {
    name: "prior",
    shape: &[Vertices, Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "displacement of each vertex by the prior, in its rotated frame",
};
/// Rotations of the vertices.
pub(crate) const VERTEX_ROTATIONS: Port = Port {
    name: "vertex_rotations",
    shape: &[Vertices, Fixed(4)],
    role: Role::Stage,
    unit: "",
    meaning: "rotation of each vertex's frame, the blend of its joints': unit quaternions x, y, z, w",
};
/// Skinned rest positions of the last frame.
pub(crate) const SKINNED_BEFORE: Port = Port {
    name: "skinned_before",
    shape: &[Vertices, Fixed(3)],
    role: Role::State,
    unit: "m",
    meaning: "skinned positions of the tick before",
};
/// Rotation of the frame of root-relative states.
pub(crate) const FRAME_ROTATION: Port = Port {
    name: "frame_rotation",
    shape: &[Fixed(1), Fixed(4)],
    role: Role::Stage,
    unit: "",
    meaning: "world rotation of the frame of root_relative: a unit quaternion x, y, z, w",
};
/// World position of the root joint.
pub(crate) const ROOT_POSITION: Port = Port {
    name: "root_position",
    shape: &[Fixed(1), Fixed(3)],
    role: Role::Stage,
    unit: "m",
    meaning: "world position of the root joint",
};
/// World positions of the garment.
pub(crate) const POSITIONS: Port = Port {
    name: "positions",
    shape: &[Vertices, Fixed(3)],
    role: Role::Result,
    unit: "m",
    meaning: "world position of each vertex",
};
