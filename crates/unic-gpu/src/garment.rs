//! The garment's kernels that take one vertex each.

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    field::FieldShape,
    kernel::{Dispatch, Kernel, Source},
    mesh::Mesh,
};
use unic_core::{
    config::{DisplacementConfig, PointInput, StateConfig},
    features::{ACCELERATION_UNIT, StateInputs, VELOCITY_UNIT},
    model::Model,
};
use wgpu::Buffer;

/// The garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Garment {
    pub(crate) mesh: Mesh,
    shapes: Buffer,
    prepare: Kernel,
    rehang: Kernel,
    take_mean: Kernel,
    take_shown: Kernel,
    take_moved: Kernel,
    hold: Kernel,
    show: Kernel,
}

impl Garment {
    pub(crate) fn new(context: &GpuContext, model: &Model, shape: &FieldShape, coefficients: usize) -> Self {
        let prior = model.prior();
        let garment = model.garment();
        let text = [
            include_str!("kernels/places.wgsl"),
            include_str!("kernels/skin.wgsl"),
            include_str!("kernels/garment.wgsl"),
        ]
        .concat()
        .replace("//{inputs}", &input_lines(model));
        let vertices = ("VERTICES", model.vertex_count() as f64);
        let in_frame = ("IN_FRAME", f64::from(u8::from(is_in_frame(model))));
        let hung = [
            vertices,
            ("SHAPES", prior.len() as f64),
            ("COEFFICIENTS", coefficients as f64),
        ];
        let kernel = |entry: &str, constants: &[(&str, f64)]| {
            let source = Source {
                text: &text,
                entry,
                constants,
            };
            Kernel::new(context, &source)
        };
        let stride = ("STRIDE", shape.stride(model.vertex_count()) as f64);
        Self {
            mesh: Mesh::new(context, &garment.rest, &garment.weights, &prior.mean),
            shapes: context.upload("shapes", &planar_shapes(model)),
            prepare: kernel("prepare", &[hung[0], hung[1], hung[2], stride]),
            rehang: kernel("rehang", &hung),
            take_mean: kernel("take_mean", &[vertices, in_frame]),
            take_shown: kernel("take_shown", &[vertices, in_frame]),
            take_moved: kernel("take_moved", &[vertices, in_frame]),
            hold: kernel("hold", &[vertices]),
            show: kernel("show", &[vertices, in_frame]),
        }
    }

    pub(crate) fn prepare(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [
            (0, &of.tick),
            (1, &self.mesh.vertices),
            (2, &self.mesh.weights),
            (3, &self.shapes),
            (4, &of.vectors),
            (5, &of.points),
            (6, &of.states),
            (7, &of.inputs),
        ];
        self.prepare.dispatch(&buffers, self.mesh.groups())
    }

    pub(crate) fn rehang(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [
            (1, &self.mesh.vertices),
            (3, &self.shapes),
            (4, &of.vectors),
            (5, &of.points),
            (6, &of.states),
        ];
        self.rehang.dispatch(&buffers, self.mesh.groups())
    }

    /// States from the mean shape.
    pub(crate) fn take_mean(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [
            (0, &of.tick),
            (1, &self.mesh.vertices),
            (5, &of.points),
            (6, &of.states),
        ];
        self.take_mean.dispatch(&buffers, self.mesh.groups())
    }

    /// States from what is shown.
    pub(crate) fn take_shown(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [(0, &of.tick), (5, &of.points), (6, &of.states), (9, &of.shown)];
        self.take_shown.dispatch(&buffers, self.mesh.groups())
    }

    /// States from what is shown, where it is elsewhere than they are.
    pub(crate) fn take_moved(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [(0, &of.tick), (5, &of.points), (6, &of.states), (9, &of.shown)];
        self.take_moved.dispatch(&buffers, self.mesh.groups())
    }

    /// States at rest.
    pub(crate) fn hold(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        self.hold.dispatch(&[(6, &of.states)], self.mesh.groups())
    }

    /// Positions from states.
    pub(crate) fn show(&self, of: &Buffers) -> Result<Dispatch, GpuError> {
        let buffers = [(0, &of.tick), (5, &of.points), (6, &of.states), (9, &of.shown)];
        self.show.dispatch(&buffers, self.mesh.groups())
    }
}

/// Are states positions relative to the root joint?
pub(crate) fn is_in_frame(model: &Model) -> bool {
    model.config().state == StateConfig::RootRelative
}

/// Coordinates of the prior's shapes side by side, so that neighbouring invocations read neighbours.
fn planar_shapes(model: &Model) -> Vec<f32> {
    let prior = model.prior();
    let (count, vertices) = (prior.len(), model.vertex_count());
    let mut planar = vec![0.0; 3 * count * vertices];
    for (vertex, shapes) in prior.shapes.chunks_exact(count.max(1)).enumerate() {
        for (k, shape) in shapes.iter().enumerate() {
            for (axis, value) in shape.to_array().into_iter().enumerate() {
                planar[(3 * k + axis) * vertices + vertex] = value;
            }
        }
    }
    planar
}

/// Writes what the field reads of a vertex, in the configuration's order.
fn input_lines(model: &Model) -> String {
    let values = match &model.config().state {
        StateConfig::RootRelative => vec!["state.value.xyz".to_owned()],
        StateConfig::Displacement(config) => displacement_inputs(model, config),
    };
    let lines = values.iter().enumerate();
    lines
        .map(|(k, value)| format!("write_input(i, {k}u, {value});\n    "))
        .collect()
}

fn displacement_inputs(model: &Model, config: &DisplacementConfig) -> Vec<String> {
    let state = StateInputs::new(config);
    let change = "(state.value.xyz - state.previous.xyz)";
    let ordered = state.ordered(
        state.displacement.map(|k| format!("state.value.xyz * {k:?}f")),
        state.velocity.map(|k| format!("{change} * {k:?}f")),
    );
    let frame = config.inputs.iter().filter(|input| !input.is_state());
    ordered
        .chain(frame.map(|input| frame_input(model, *input)))
        .collect()
}

fn frame_input(model: &Model, input: PointInput) -> String {
    let fps = model.config().fps;
    let centre = model.rest_box().centre;
    match input {
        PointInput::Rest => format!(
            "(vertex.rest - vec3<f32>({:?}f, {:?}f, {:?}f)) / {:?}f",
            centre.x,
            centre.y,
            centre.z,
            model.rest_box().half_extent
        ),
        PointInput::Up => "rotated_back(rotation, vec3<f32>(0.0, 1.0, 0.0))".to_owned(),
        PointInput::SkinVelocity => {
            format!(
                "rotated_back(rotation, (now - before) * {fps:?}f - tick[HANDLING].yzw) * {:?}f",
                VELOCITY_UNIT.recip()
            )
        }
        PointInput::SkinAcceleration => format!(
            "rotated_back(rotation, (now - before) - (before - earlier)) * {:?}f",
            fps * fps / ACCELERATION_UNIT
        ),
        PointInput::Displacement | PointInput::Velocity => "vec3<f32>()".to_owned(),
    }
}
