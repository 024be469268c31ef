// Garment vertices: skinning and prior, start of the states, and shown positions.

// Number of the prior's principal components.
override COMPONENTS: u32;
// Start of their coefficients in `vectors`.
override COEFFICIENTS: u32;
// Place of the factor of displacements in `vectors`.
override FACTOR: u32;
// Length of one input channel: the vertices, padded to whole tiles.
override STRIDE: u32;

// Coordinate c of component k at vertex i is at (3 k + c) VERTICES + i.
@group(0) @binding(3) var<storage, read> components: array<f32>;
@group(0) @binding(4) var<storage, read_write> vectors: array<f32>;
// Inputs of the field, channel by channel.
@group(0) @binding(7) var<storage, read_write> inputs: array<f32>;
// Positions and normals of the garment, world space.
@group(0) @binding(9) var<storage, read_write> shown: array<f32>;

// Displacement of the prior in the vertex's own frame, metres.
fn prior_displacement(i: u32) -> vec3<f32> {
    var sum = vertices[i].mean;
    for (var k = 0u; k < COMPONENTS; k++) {
        let at = 3u * k * VERTICES + i;
        let component = vec3<f32>(components[at], components[at + VERTICES], components[at + 2u * VERTICES]);
        sum += component * vectors[COEFFICIENTS + k];
    }
    return sum;
}

fn write_input(i: u32, k: u32, value: vec3<f32>) {
    let at = 3u * k * STRIDE + i;
    inputs[at] = value.x;
    inputs[at + STRIDE] = value.y;
    inputs[at + 2u * STRIDE] = value.z;
}

// Computes the vertex's frame, its prior and the field's inputs for a new pose.
@compute @workgroup_size(64)
fn prepare(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let vertex = vertices[i];
    let now = skinned(vertex);
    let rotation = skinning_rotation(vertex);
    let before = points[i].now.xyz;
    points[i] = Point(rotation, vec4<f32>(now, 0.0), vec4<f32>(prior_displacement(i), 0.0));
    let state = states[i];
    //{inputs}
}

// Recomputes the prior of frame 0 once its velocities are known, and counts the states from it.
// World positions stay the same.
@compute @workgroup_size(64)
fn rebase_states(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let prior = prior_displacement(i);
    let value = states[i].value + points[i].prior - vec4<f32>(prior, 0.0);
    states[i] = VertexState(value, value);
    points[i].prior = vec4<f32>(prior, 0.0);
}

// Recomputes the prior after its coefficients have changed.
@compute @workgroup_size(64)
fn refresh_prior(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    points[i].prior = vec4<f32>(prior_displacement(i), 0.0);
}

// Advances the states by one tick of a field that is zero.
@compute @workgroup_size(64)
fn fade(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let value = states[i].value;
    states[i] = VertexState(vec4<f32>(value.xyz * vectors[FACTOR], value.w), value);
}

// Sets the states to the mean displacement from the skinned rest shape.
@compute @workgroup_size(64)
fn start_at_mean(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let point = points[i];
    let world = point.now.xyz + rotated(point.rotation, vertices[i].mean);
    states[i].value = vec4<f32>(to_state(state_frame(i), world), states[i].value.w);
}

// Sets the states to given positions, which are in the buffer of shown positions, blended by the
// mask.
@compute @workgroup_size(64)
fn states_from_shown(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let world = vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
    states[i].value = blended(states[i].value, state_frame(i), world);
}

// Sets the states of the vertices whose shown position was corrected. Other states keep their bits.
@compute @workgroup_size(64)
fn states_from_corrected(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let frame = state_frame(i);
    let world = vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
    if (any(world != to_world(frame, states[i].value.xyz))) {
        states[i].value = pushed(states[i].value, frame, world);
    }
}

// Sets the velocity of the states to zero.
@compute @workgroup_size(64)
fn clear_velocities(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    states[i].previous = states[i].value;
}

// Computes the shown positions from the states. The places of the normals, which are computed last,
// hold the skinned positions until then, see `robust.wgsl`.
@compute @workgroup_size(64)
fn write_positions(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let world = to_world(state_frame(i), states[i].value.xyz);
    shown[6u * i] = world.x;
    shown[6u * i + 1u] = world.y;
    shown[6u * i + 2u] = world.z;
    let carried = skinned(vertices[i]);
    shown[6u * i + 3u] = carried.x;
    shown[6u * i + 4u] = carried.y;
    shown[6u * i + 5u] = carried.z;
}
