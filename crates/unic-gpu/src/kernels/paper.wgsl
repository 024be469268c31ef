// The paper's way out of the body: the nearest vertex, its tangent plane, and out along its normal.

override LEAVES_FROM: u32;
override CAPACITY: u32;
override BODY_VERTICES: u32;

const NO_ITEM = 0xffffffffu;
const FAR = 3e38;
// Three siblings stay behind on each of at most nine levels.
const STACK = 28u;

@group(0) @binding(10) var<storage, read> items: array<u32>;
@group(0) @binding(11) var<storage, read> boxes: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read> body: array<f32>;
// The body vertex that was nearest in the frame before.
@group(0) @binding(13) var<storage, read_write> seeds: array<u32>;

fn body_vertex(i: u32) -> vec3<f32> {
    return vec3<f32>(body[6u * i], body[6u * i + 1u], body[6u * i + 2u]);
}

fn squared(v: vec3<f32>) -> f32 {
    return dot(v, v);
}

fn to_box(node: u32, p: vec3<f32>) -> f32 {
    return squared(max(max(boxes[2u * node].xyz - p, p - boxes[2u * node + 1u].xyz), vec3<f32>()));
}

// The nearest body vertex; of several the lowest.
fn nearest(p: vec3<f32>, seed: u32) -> u32 {
    var best = seed;
    var bound = FAR;
    if (seed < BODY_VERTICES) {
        bound = squared(body_vertex(seed) - p);
    }
    var nodes: array<u32, STACK>;
    var distances: array<f32, STACK>;
    nodes[0] = 0u;
    distances[0] = 0.0;
    var height = 1u;
    while (height > 0u) {
        height--;
        let node = nodes[height];
        if (distances[height] > bound) {
            continue;
        }
        if (node >= LEAVES_FROM) {
            for (var k = 0u; k < CAPACITY; k++) {
                let item = items[(node - LEAVES_FROM) * CAPACITY + k];
                if (item != NO_ITEM) {
                    let found = squared(body_vertex(item) - p);
                    if (found < bound || (found == bound && item < best)) {
                        bound = found;
                        best = item;
                    }
                }
            }
            continue;
        }
        // The nearest child goes on top.
        let first = height;
        for (var k = 1u; k <= 4u; k++) {
            let child = 4u * node + k;
            let distance = to_box(child, p);
            if (distance > bound) {
                continue;
            }
            let is_nearest = height == first || distance < distances[height - 1u];
            let under = select(height - 1u, height, is_nearest);
            if (!is_nearest) {
                nodes[height] = nodes[under];
                distances[height] = distances[under];
            }
            nodes[under] = child;
            distances[under] = distance;
            height++;
        }
    }
    return best;
}

@compute @workgroup_size(64)
fn drag(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let at = place_of(i);
    let p = to_world(at, states[i].value.xyz);
    let vertex = nearest(p, seeds[i]);
    seeds[i] = vertex;
    if (vertex >= BODY_VERTICES) {
        return;
    }
    let b = body_vertex(vertex);
    let n = vec3<f32>(body[6u * vertex + 3u], body[6u * vertex + 4u], body[6u * vertex + 5u]);
    // How far off the vertex it ends, metres.
    let relaxation = tick[HANDLING].x;
    if (dot(p - b, n) < 0.0) {
        states[i].value = vec4<f32>(to_state(at, b + n * relaxation), 0.0);
    }
}
