// Pushes that keep the order of cloth that lies over one place of the body. The kernels follow a
// push by `robust.wgsl`. Constants and rules are those of `depths.rs` in unic-core, whose comments
// give the reasons.

// Number of vertices of the body.
override BODY_VERTICES: u32;

// Depth below which cloth is not raised, metres.
const LEAST_DEPTH = 1e-4;
// Largest depth that counts, metres.
const MAX_DEPTH = 0.06;
// Weight of a corner from which on it takes the whole depth at a point of its face.
const FULL_WEIGHT = 0.1;

// Bits of the depth of the cloth next to each welded body vertex, metres. Bits of numbers above
// zero have the order of the numbers.
@group(0) @binding(23) var<storage, read_write> depths: array<atomic<u32>>;

@compute @workgroup_size(64)
fn clear_depths(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < BODY_VERTICES) {
        atomicStore(&depths[id.x], 0u);
    }
}

fn all_weights(first: vec2<f32>) -> vec3<f32> {
    return vec3<f32>(first, max(1.0 - first.x - first.y, 0.0));
}

// Finds the depth of each place of the body.
@compute @workgroup_size(64)
fn find_depths(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let pushed = pushed_cloth(i);
    if (pushed.depth > 0.0) {
        let welded = faces[pushed.face].welded;
        let weights = all_weights(pushed.weights);
        for (var k = 0u; k < 3u; k++) {
            let own = min(pushed.depth, MAX_DEPTH) * min(weights[k] / FULL_WEIGHT, 1.0);
            // The bits of -0 exceed those of all numbers above zero.
            if (own > 0.0) {
                atomicMax(&depths[welded[k]], bitcast<u32>(own));
            }
        }
    }
}

// Height over the margin to which cloth at a height over it is raised, metres.
fn raised(height: f32, depth: f32) -> f32 {
    return max(0.5 * (height + depth), 0.0);
}

// Moves the cloth that lies over a depth.
@compute @workgroup_size(64)
fn keep_order(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES) {
        return;
    }
    let pushed = pushed_cloth(i);
    let face = select(seeds[i], pushed.face, pushed.depth > 0.0);
    if (face == NO_ITEM) {
        return;
    }
    let p = shown_position(i);
    let around = contact(p, face);
    var weights = corner_weights(around);
    if (pushed.depth > 0.0) {
        weights = pushed.weights;
    }
    let welded = faces[face].welded;
    var at_corners = vec3<f32>();
    for (var k = 0u; k < 3u; k++) {
        at_corners[k] = bitcast<f32>(atomicLoad(&depths[welded[k]]));
    }
    if (max(at_corners.x, max(at_corners.y, at_corners.z)) < LEAST_DEPTH) {
        return;
    }
    let depth = dot(at_corners, all_weights(weights));
    let margin = tick[HANDLING].x;
    let size = length(pushed.by);
    if (size > 0.0) {
        show(i, seeds[i], p + pushed.by * (raised(-size, depth) / size));
        return;
    }
    var height = -pushed.depth;
    if (pushed.depth == 0.0) {
        height = around.height - margin;
        if (height < -TOLERANCE || height >= depth) {
            return;
        }
    }
    let out = push_out(around, p, margin + raised(height, depth));
    if (out.exists) {
        show(i, face, out.to);
    }
}

// Finds the nearest faces of the vertices that were moved: planes belong to them.
@compute @workgroup_size(64)
fn find_nearest(@builtin(global_invocation_id) id: vec3<u32>) {
    let i = id.x;
    if (i >= VERTICES || seeds[mark(i)] == 0u) {
        return;
    }
    pushed_vertex = i;
    seeds[i] = nearest(shown_position(i), seeds[i]);
}
