//! `model.json`: everything that a program needs to run the graphs.

use crate::{
    graph::{Graph, OPSET},
    mesh::{MeshArray, MeshFile},
    port::{Length, Port, Role},
};
use serde::Serialize;
use unic_core::{
    IntersectionMode, Model,
    config::StateConfig,
    motion::{MotionLayout, VelocityScheme},
};

/// Content of `model.json`.
#[derive(Debug, Serialize)]
pub(crate) struct Description<'a> {
    /// Version of this description.
    version: u32,
    program: String,
    name: &'a str,
    provenance: &'a str,
    opset: i64,
    /// Ticks per second.
    fps: f32,
    units: &'static str,
    axes: &'static str,
    rotations: &'static str,
    wind_at_start: &'static str,
    joints: Vec<Joint<'a>>,
    mesh: Mesh,
    graphs: Vec<GraphDescription>,
    outside: Vec<Outside>,
}

#[derive(Debug, Serialize)]
struct Joint<'a> {
    name: &'a str,
    /// Index of the parent; null for the root.
    parent: Option<usize>,
    /// Position in the rest pose, metres.
    rest_position: [f32; 3],
    /// Local rotation of the rest pose: a unit quaternion x, y, z, w.
    rest_rotation: [f32; 4],
}

#[derive(Debug, Serialize)]
struct Mesh {
    file: &'static str,
    byte_order: &'static str,
    vertices: usize,
    arrays: Vec<MeshArray>,
}

#[derive(Debug, Serialize)]
struct GraphDescription {
    file: String,
    purpose: &'static str,
    inputs: Vec<PortDescription>,
    outputs: Vec<PortDescription>,
}

#[derive(Debug, Serialize)]
struct PortDescription {
    name: String,
    #[serde(rename = "type")]
    element: &'static str,
    shape: Vec<Length>,
    role: Role,
    /// Output of the tick before that is this input.
    #[serde(skip_serializing_if = "Option::is_none")]
    from: Option<String>,
    #[serde(skip_serializing_if = "str::is_empty")]
    unit: &'static str,
    meaning: &'static str,
}

/// Part of the animator that the graphs leave out.
#[derive(Debug, Serialize)]
struct Outside {
    name: &'static str,
    /// Whether the animator does it for this model.
    in_model: bool,
    meaning: &'static str,
}

impl<'a> Description<'a> {
    pub(crate) fn new(model: &'a Model, graphs: &[Graph], mesh: MeshFile) -> Self {
        Self {
            version: 1,
            program: format!("unic {}", env!("CARGO_PKG_VERSION")),
            name: &model.about().name,
            provenance: &model.about().provenance,
            opset: OPSET,
            fps: model.config().fps,
            units: "metres, seconds, radians",
            axes: "right-handed, +Y up, the character faces +Z",
            rotations: "unit quaternions x, y, z, w",
            wind_at_start: match model.config().motion.velocity {
                VelocityScheme::Forward => "of the first frame",
                VelocityScheme::Backward => "of the second frame",
            },
            joints: joints(model),
            mesh: Mesh {
                file: "mesh.bin",
                byte_order: "little-endian",
                vertices: model.vertex_count(),
                arrays: mesh.arrays,
            },
            graphs: graphs.iter().map(describe).collect(),
            outside: outside(model),
        }
    }
}

fn joints(model: &Model) -> Vec<Joint<'_>> {
    let skeleton = &model.character().skeleton;
    let rest = skeleton.bind_pose();
    (0..skeleton.len())
        .map(|joint| Joint {
            name: &skeleton.names()[joint],
            parent: skeleton.parents()[joint],
            rest_position: skeleton.joints()[joint].to_array(),
            rest_rotation: rest.local[joint].to_array(),
        })
        .collect()
}

fn describe(graph: &Graph) -> GraphDescription {
    let port = |(port, name): &(Port, String), from: Option<String>| PortDescription {
        name: name.clone(),
        element: "float32",
        shape: graph.sizes().shape(*port),
        role: port.role,
        from,
        unit: port.unit,
        meaning: port.meaning,
    };
    // Stages may read joints of their own choice.
    let has_state_of_tick = |port: Port| port.role == Role::State && graph.name() != "skinning";
    GraphDescription {
        file: format!("{}.onnx", graph.name()),
        purpose: purpose(graph.name()),
        inputs: (graph.inputs().iter())
            .map(|input| port(input, has_state_of_tick(input.0).then(|| input.0.next_name())))
            .collect(),
        outputs: graph.outputs().iter().map(|output| port(output, None)).collect(),
    }
}

fn purpose(graph: &str) -> &'static str {
    match graph {
        "start" => {
            "state and positions of the first frame, from its pose and the next one; after every cut and teleport"
        }
        "tick" => "state and positions one tick later: the stages below in one graph",
        "motion" => "stage of a tick: pose to motion vectors",
        "skinning" => {
            "stage of a tick: joints of this frame (joint_positions_out and joint_rotations_out of motion.onnx, or an engine's own) to skinned rest positions"
        }
        "encoder" => "stage of a tick: motion vectors to the motion's code",
        "prior" => "stage of a tick: motion vectors to expected displacements",
        _ => "stage of a tick: everything else to states and positions of the vertices",
    }
}

fn outside(model: &Model) -> Vec<Outside> {
    let config = model.config();
    let displaces = config.state != StateConfig::RootRelative;
    let is_paper = config.motion.layout != MotionLayout::Heading;
    let part = |name, in_model, meaning| Outside {
        name,
        in_model,
        meaning,
    };
    vec![
        part(
            "replay",
            displaces && model.prior().replay.is_some(),
            "residuals of training clips that are added to the prior's coefficients",
        ),
        part(
            "strain_projection",
            config.projection.is_some(),
            "sweeps that give the shown edges their lengths",
        ),
        part(
            "intersection_handling",
            config.intersection != IntersectionMode::Off,
            "moves vertices out of the body, the ground and props",
        ),
        part(
            "given_start",
            true,
            "start from positions of a simulation; start.onnx takes the mean shape of training",
        ),
        part(
            "input_checks",
            true,
            "refuses poses that are not finite or whose rotations are no unit quaternions",
        ),
        part(
            "normals",
            true,
            "unit normals of the vertices, from positions and faces",
        ),
        part(
            "display_between_ticks",
            true,
            "garment at the rate of the display: positions of the last two ticks, interpolated",
        ),
        part(
            "ground_height",
            is_paper,
            "height of the ground, which the motion vector of this model does not hold",
        ),
    ]
}
