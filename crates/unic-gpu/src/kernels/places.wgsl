// What is known of a vertex and of the frame, and where states are counted from.

// Where the skeleton carries a vertex, and where the prior puts it there.
struct Point {
    // World from the vertex's own frame, a unit quaternion.
    rotation: vec4<f32>,
    // LBS(rest) at t, world, metres.
    now: vec4<f32>,
    // At t - 1.
    before: vec4<f32>,
    // Displacement in the own frame, metres.
    prior: vec4<f32>,
}

struct VertexState {
    // At t; w is the garment's mask, which never changes.
    value: vec4<f32>,
    // At t - 1.
    previous: vec4<f32>,
}

struct Place {
    rotation: vec4<f32>,
    origin: vec3<f32>,
    offset: vec3<f32>,
}

override VERTICES: u32;
// Are states positions relative to the root joint, or displacements?
override IN_FRAME: bool = false;

// World from the frame of root-relative states: rotation, then translation, whose w is 1 on the first step
// after a reset; margin of the intersection handling and the wind in m/s; then rotation and translation of
// `world_from_rest` of every joint.
@group(0) @binding(0) var<storage, read> tick: array<vec4<f32>>;
const HANDLING = 2u;
const JOINTS = 3u;
@group(0) @binding(5) var<storage, read_write> points: array<Point>;
@group(0) @binding(6) var<storage, read_write> states: array<VertexState>;

fn rotated(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

fn rotated_back(q: vec4<f32>, v: vec3<f32>) -> vec3<f32> {
    return rotated(vec4<f32>(-q.xyz, q.w), v);
}

fn place_of(i: u32) -> Place {
    if (IN_FRAME) {
        return Place(tick[0], tick[1].xyz, vec3<f32>());
    }
    let point = points[i];
    return Place(point.rotation, point.now.xyz, point.prior.xyz);
}

fn to_world(at: Place, state: vec3<f32>) -> vec3<f32> {
    return at.origin + rotated(at.rotation, at.offset + state);
}

fn to_state(at: Place, world: vec3<f32>) -> vec3<f32> {
    return rotated_back(at.rotation, world - at.origin) - at.offset;
}

// State of a captured position, blended towards skinning by the mask.
fn blended(state: vec4<f32>, at: Place, world: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(rotated_back(at.rotation, world - at.origin) * state.w - at.offset, state.w);
}

// State after a push of what is shown, as far as the mask lets it.
fn pushed(state: vec4<f32>, at: Place, moved: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(mix(state.xyz, to_state(at, moved), state.w), state.w);
}
