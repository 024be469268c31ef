// Garment vertices: carried along by the skeleton, hung where the prior says, started, and shown.

// Shapes of the prior.
override SHAPES: u32;
// Where their coefficients are in `vectors`.
override COEFFICIENTS: u32;
// Numbers of one input channel: the vertices, padded to whole tiles.
override STRIDE: u32;

// Coordinate c of shape k of vertex i at (3 k + c) VERTICES + i.
@group(0) @binding(3) var<storage, read> shapes: array<f32>;
@group(0) @binding(4) var<storage, read_write> vectors: array<f32>;
// What the field reads, channel by channel.
@group(0) @binding(7) var<storage, read_write> inputs: array<f32>;
// Positions and normals, world.
@group(0) @binding(9) var<storage, read_write> shown: array<f32>;

fn hung(i: u32) -> vec3<f32> {
    var sum = vertices[i].mean;
    for (var k = 0u; k < SHAPES; k++) {
        let at = 3u * k * VERTICES + i;
        let shape = vec3<f32>(shapes[at], shapes[at + VERTICES], shapes[at + 2u * VERTICES]);
        sum += shape * vectors[COEFFICIENTS + k];
    }
    return sum;
}

fn write_input(i: u32, k: u32, value: vec3<f32>) {
    let at = 3u * k * STRIDE + i;
    inputs[at] = value.x;
    inputs[at + STRIDE] = value.y;
    inputs[at + 2u * STRIDE] = value.z;
}

// A new pose: the vertex's frame, its prior and the field's inputs.
@compute @workgroup_size(64)
fn prepare(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let vertex = vertices[i];
    let now = skinned(vertex);
    let rotation = turned(vertex);
    let before = points[i].now.xyz;
    // Where the frame before is not known, the point has moved steadily.
    let earlier = select(points[i].before.xyz, 2.0 * before - now, tick[1].w > 0.5);
    points[i] = Point(rotation, vec4<f32>(now, 0.0), vec4<f32>(before, 0.0), vec4<f32>(hung(i), 0.0));
    let state = states[i];
    //{inputs}
}

// The velocities of frame 0 are known at last, and with them where the prior put the garment there:
// states are counted from it anew.
@compute @workgroup_size(64)
fn rehang(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let prior = hung(i);
    let value = states[i].value + points[i].prior - vec4<f32>(prior, 0.0);
    states[i] = VertexState(value, value);
    points[i].prior = vec4<f32>(prior, 0.0);
}

// At the mean shape, carried by the skeleton.
@compute @workgroup_size(64)
fn take_mean(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let point = points[i];
    let world = point.now.xyz + rotated(point.rotation, vertices[i].mean);
    states[i].value = vec4<f32>(to_state(place_of(i), world), states[i].value.w);
}

// At the positions that are put where those are that are shown, blended by the mask.
@compute @workgroup_size(64)
fn take_shown(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let world = vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
    states[i].value = blended(states[i].value, place_of(i), world);
}

// At the positions that are shown, where these are others: the bits of what has not moved stay.
@compute @workgroup_size(64)
fn take_moved(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let at = place_of(i);
    let world = vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
    if (any(world != to_world(at, states[i].value.xyz))) {
        states[i].value = pushed(states[i].value, at, world);
    }
}

// At rest.
@compute @workgroup_size(64)
fn hold(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    states[i].previous = states[i].value;
}

@compute @workgroup_size(64)
fn show(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let world = to_world(place_of(i), states[i].value.xyz);
    shown[6u * i] = world.x;
    shown[6u * i + 1u] = world.y;
    shown[6u * i + 2u] = world.z;
}
