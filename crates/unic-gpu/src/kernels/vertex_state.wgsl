// States of the vertices, the frames in which they are expressed, and the settings of a tick.

// Skinned vertex with its prior.
struct Point {
    // World from the vertex's own frame, a unit quaternion.
    rotation: vec4<f32>,
    // LBS(rest) at t, world space, metres.
    now: vec4<f32>,
    // Displacement of the prior in the vertex's own frame, metres.
    prior: vec4<f32>,
}

struct VertexState {
    // State at t; w is the garment's mask, which never changes.
    value: vec4<f32>,
    // State at t - 1.
    previous: vec4<f32>,
}

// Frame of a state: a position in the world is origin + rotation (offset + state).
struct StateFrame {
    rotation: vec4<f32>,
    origin: vec3<f32>,
    offset: vec3<f32>,
}

override VERTICES: u32;
// True if states are positions relative to the root joint, false if they are displacements.
override IN_FRAME: bool = false;

// World from the frame of root-relative states: rotation, then translation. Then margin or
// relaxation of the intersection handling, and the wind in m/s. Then rotation and translation of
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

fn state_frame(i: u32) -> StateFrame {
    if (IN_FRAME) {
        return StateFrame(tick[0], tick[1].xyz, vec3<f32>());
    }
    let point = points[i];
    return StateFrame(point.rotation, point.now.xyz, point.prior.xyz);
}

fn to_world(frame: StateFrame, state: vec3<f32>) -> vec3<f32> {
    return frame.origin + rotated(frame.rotation, frame.offset + state);
}

fn to_state(frame: StateFrame, world: vec3<f32>) -> vec3<f32> {
    return rotated_back(frame.rotation, world - frame.origin) - frame.offset;
}

// State of a captured position, blended towards skinning by the mask.
fn blended(state: vec4<f32>, frame: StateFrame, world: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(rotated_back(frame.rotation, world - frame.origin) * state.w - frame.offset, state.w);
}

// State after a correction of the shown position, weighted by the mask.
fn pushed(state: vec4<f32>, frame: StateFrame, corrected: vec3<f32>) -> vec4<f32> {
    return vec4<f32>(mix(state.xyz, to_state(frame, corrected), state.w), state.w);
}
