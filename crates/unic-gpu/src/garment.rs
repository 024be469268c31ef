//! Garment kernels with one invocation a vertex: skinning, prior, states and positions.

use crate::{
    GpuContext, GpuError,
    animator::Buffers,
    field::FieldShape,
    kernel::{Dispatch, Kernel, Source},
    mesh::Mesh,
    start_memory::MemoryRegions,
};
use unic_core::{
    Model,
    config::{DisplacementConfig, PointInput, StateConfig},
    features::{StateInputs, VELOCITY_UNIT},
};
use wgpu::Buffer;

/// Garment on the device. Asset.
#[derive(Debug)]
pub(crate) struct Garment {
    pub(crate) mesh: Mesh,
    /// The mesh with the garment's carriers in place of its weights.
    carried: Mesh,
    /// Principal components of the prior.
    components: Buffer,
    prepare: Kernel,
    rebase_states: Kernel,
    refresh_prior: Kernel,
    fade: Kernel,
    start_at_mean: Kernel,
    states_from_shown: Kernel,
    states_from_corrected: Kernel,
    clear_velocities: Kernel,
    write_positions: Kernel,
}

impl Garment {
    pub(crate) fn new(
        context: &GpuContext,
        model: &Model,
        shape: &FieldShape,
        regions: &MemoryRegions,
    ) -> Self {
        let prior = model.prior();
        let garment = model.garment();
        let text = [
            include_str!("kernels/vertex_state.wgsl"),
            include_str!("kernels/skin.wgsl"),
            include_str!("kernels/garment.wgsl"),
        ]
        .concat()
        .replace("//{inputs}", &input_lines(model));
        let vertices = ("VERTICES", model.vertex_count() as f64);
        let in_frame = ("IN_FRAME", f64::from(u8::from(is_in_frame(model))));
        let prior_constants = [
            vertices,
            ("COMPONENTS", prior.len() as f64),
            ("COEFFICIENTS", regions.coefficients as f64),
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
            carried: Mesh::new(context, &garment.rest, garment.carriers(), &[]),
            components: context.upload("components", &planar_components(model)),
            prepare: kernel("prepare", &[&prior_constants[..], &[stride]].concat()),
            rebase_states: kernel("rebase_states", &prior_constants),
            refresh_prior: kernel("refresh_prior", &prior_constants),
            fade: kernel("fade", &[vertices, ("FACTOR", regions.factor() as f64)]),
            start_at_mean: kernel("start_at_mean", &[vertices, in_frame]),
            states_from_shown: kernel("states_from_shown", &[vertices, in_frame]),
            states_from_corrected: kernel("states_from_corrected", &[vertices, in_frame]),
            clear_velocities: kernel("clear_velocities", &[vertices]),
            write_positions: kernel("write_positions", &[vertices, in_frame]),
        }
    }

    /// Poses the vertices: their frames, the prior and the field's inputs.
    pub(crate) fn prepare(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &buffers.tick),
            (1, &self.mesh.vertices),
            (2, &self.mesh.weights),
            (3, &self.components),
            (4, &buffers.vectors),
            (5, &buffers.points),
            (6, &buffers.states),
            (7, &buffers.inputs),
        ];
        self.prepare.dispatch(&bindings, self.mesh.groups())
    }

    /// Counts the displacements of frame 0 from its complete prior, once the velocities are known.
    pub(crate) fn rebase_states(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (1, &self.mesh.vertices),
            (3, &self.components),
            (4, &buffers.vectors),
            (5, &buffers.points),
            (6, &buffers.states),
        ];
        self.rebase_states.dispatch(&bindings, self.mesh.groups())
    }

    /// Computes the prior of the vertices again, after its coefficients have changed.
    pub(crate) fn refresh_prior(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (1, &self.mesh.vertices),
            (3, &self.components),
            (4, &buffers.vectors),
            (5, &buffers.points),
        ];
        self.refresh_prior.dispatch(&bindings, self.mesh.groups())
    }

    /// Advances the states by one tick of a field that is zero.
    pub(crate) fn fade(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [(4, &buffers.vectors), (6, &buffers.states)];
        self.fade.dispatch(&bindings, self.mesh.groups())
    }

    /// Sets the states to the mean shape.
    pub(crate) fn start_at_mean(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &buffers.tick),
            (1, &self.mesh.vertices),
            (5, &buffers.points),
            (6, &buffers.states),
        ];
        self.start_at_mean.dispatch(&bindings, self.mesh.groups())
    }

    /// Sets the states from the shown positions.
    pub(crate) fn states_from_shown(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &buffers.tick),
            (5, &buffers.points),
            (6, &buffers.states),
            (9, &buffers.shown),
        ];
        self.states_from_shown.dispatch(&bindings, self.mesh.groups())
    }

    /// Sets the states of the vertices that intersection handling has moved from the shown
    /// positions.
    pub(crate) fn states_from_corrected(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &buffers.tick),
            (5, &buffers.points),
            (6, &buffers.states),
            (9, &buffers.shown),
        ];
        self.states_from_corrected.dispatch(&bindings, self.mesh.groups())
    }

    /// Sets previous states of vertices, or previous offsets, to the current ones.
    pub(crate) fn clear_velocities(&self, states: &Buffer) -> Result<Dispatch, GpuError> {
        self.clear_velocities.dispatch(&[(6, states)], self.mesh.groups())
    }

    /// Computes the shown positions from the states.
    pub(crate) fn write_positions(&self, buffers: &Buffers) -> Result<Dispatch, GpuError> {
        let bindings = [
            (0, &buffers.tick),
            (1, &self.carried.vertices),
            (2, &self.carried.weights),
            (5, &buffers.points),
            (6, &buffers.states),
            (9, &buffers.shown),
        ];
        self.write_positions.dispatch(&bindings, self.mesh.groups())
    }
}

/// Returns whether states are positions relative to the root joint, and not displacements.
pub(crate) fn is_in_frame(model: &Model) -> bool {
    model.config().state == StateConfig::RootRelative
}

/// Arranges the prior's components coordinate by coordinate, so that neighbouring invocations read
/// neighbouring numbers.
fn planar_components(model: &Model) -> Vec<f32> {
    let prior = model.prior();
    let (count, vertices) = (prior.len(), model.vertex_count());
    let mut planar = vec![0.0; 3 * count * vertices];
    for vertex in 0..vertices {
        for k in 0..count {
            let vector = prior.components.vector(vertex, k);
            for (axis, value) in vector.to_array().into_iter().enumerate() {
                planar[(3 * k + axis) * vertices + vertex] = value;
            }
        }
    }
    planar
}

/// Writes the WGSL that stores the field's inputs of a vertex, in the configuration's order.
fn input_lines(model: &Model) -> String {
    let values = match &model.config().state {
        StateConfig::RootRelative => vec!["state.value.xyz".to_owned()],
        StateConfig::Displacement(config) => displacement_inputs(model, config),
    };
    // One line for each input: a loop over kinds of inputs would branch in every invocation.
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
        PointInput::Displacement | PointInput::Velocity => "vec3<f32>()".to_owned(),
    }
}
