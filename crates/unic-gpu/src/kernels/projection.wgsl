// Strain projection: offsets that bring the edges of the predicted garment into their limits. It is
// that of `unic_core::projection`, whose comments give the reasons.

// Share of an offset's velocity that is left after a tick.
override CARRY: f32;
// Share of an offset that is left after a tick.
override PULL: f32;
// Largest offset, metres.
override RADIUS: f32;
// Place in `vectors` of the share of a given displacement that is left.
override SHARE: u32;

// Positions and normals of the garment, world space.
@group(0) @binding(9) var<storage, read_write> shown: array<f32>;
// Marks of vertices from VERTICES on; the word at 2 VERTICES is 1 if the robust rule has moved any
// vertex, see `robust.wgsl`.
@group(0) @binding(13) var<storage, read_write> seeds: array<u32>;
// Offsets in the vertices' own frames.
@group(0) @binding(16) var<storage, read_write> offsets: array<VertexState>;
// Predicted positions relative to the origin of the tick, metres.
@group(0) @binding(17) var<storage, read_write> predicted: array<vec4<f32>>;
// Positions that sweeps move: relative to the origin of the tick, or in world space after
// intersection handling.
@group(0) @binding(18) var<storage, read_write> projected: array<vec4<f32>>;
// First vertex at the place of each vertex. Only first vertices are solved for.
@group(0) @binding(19) var<storage, read> firsts: array<u32>;
// Planes that shown vertices stay above, see `planes.wgsl`.
@group(0) @binding(22) var<storage, read> planes: array<vec4<f32>>;
// Vectors of the frame, with the share of a given garment that is left.
@group(0) @binding(4) var<storage, read> vectors: array<f32>;

fn shown_position(i: u32) -> vec3<f32> {
    return vec3<f32>(shown[6u * i], shown[6u * i + 1u], shown[6u * i + 2u]);
}

fn show(i: u32, position: vec3<f32>) {
    shown[6u * i] = position.x;
    shown[6u * i + 1u] = position.y;
    shown[6u * i + 2u] = position.z;
}

fn within_radius(offset: vec3<f32>) -> vec3<f32> {
    let size = length(offset);
    return select(offset, offset * (RADIUS / size), size > RADIUS);
}

fn shift(i: u32, by: vec3<f32>) {
    projected[i] += vec4<f32>(by, 0.0);
}

// Sets the offsets to zero.
@compute @workgroup_size(64)
fn clear_offsets(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    offsets[i] = VertexState(vec4<f32>(), vec4<f32>());
}

// Carries the offsets on from the previous tick. The shown positions are the predicted ones.
@compute @workgroup_size(64)
fn carry(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let position = shown_position(i) - tick[1].xyz;
    let offset = offsets[i];
    let velocity = (offset.value.xyz - offset.previous.xyz) * CARRY;
    let carried = within_radius(offset.value.xyz + velocity) * PULL;
    predicted[i] = vec4<f32>(position, 0.0);
    projected[i] = vec4<f32>(position + rotated(points[i].rotation, carried), 0.0);
}

// Keeps what the sweeps have left as the offsets of this tick.
@compute @workgroup_size(64)
fn keep_offsets(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let solved = (projected[firsts[i]] - predicted[i]).xyz;
    let value = within_radius(rotated_back(points[i].rotation, solved));
    offsets[i] = VertexState(vec4<f32>(value, 0.0), offsets[i].value);
}

// Adds the offsets, scaled by 1 - share^2, to the shown positions, which are the predicted ones.
@compute @workgroup_size(64)
fn add_offsets(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let share = vectors[SHARE];
    let offset = offsets[i].value.xyz * (1.0 - share * share);
    show(i, shown_position(i) + rotated(points[i].rotation, offset));
}

// Copies the shown positions. Sweeps then move them, or measure the bends there.
@compute @workgroup_size(64)
fn load_shown(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    projected[i] = vec4<f32>(shown_position(i), 0.0);
}

// Moves vertices back above their planes.
@compute @workgroup_size(64)
fn stay_above(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let plane = planes[i];
    shift(i, plane.xyz * max(plane.w - dot(plane.xyz, projected[i].xyz), 0.0));
}

// Length of a move after which a vertex without a plane may have come into the body, metres. Such a
// vertex was higher than PLANE_REACH of `planes.wgsl`, which is twice as long.
const LONG_MOVE = 0.01;

// Shows what the sweeps have left, if intersection handling has moved any vertex, and marks those
// that have moved far. Vertices at one place move together.
@compute @workgroup_size(64)
fn store_shown(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    if (seeds[2u * VERTICES] == 1u) {
        let position = projected[firsts[i]].xyz;
        if (distance(position, shown_position(i)) > LONG_MOVE) {
            seeds[VERTICES + i] = 1u;
        }
        show(i, position);
    }
}
