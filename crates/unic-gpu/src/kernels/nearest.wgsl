// Search for the nearest item of a tree. The kernel that includes this text defines `to_item`, the
// squared distance to an item in m²: more than FAR for an item that is not accepted.

override FIRST_LEAF: u32;
override CAPACITY: u32;
override ITEMS: u32;

const NO_ITEM = 0xffffffffu;
const FAR = 3e38;
// Size of the stack: three siblings on each of at most nine levels, and the four children of the
// last one.
const STACK = 32u;

@group(0) @binding(10) var<storage, read> items: array<u32>;
@group(0) @binding(11) var<storage, read> boxes: array<vec4<f32>>;
// Positions and normals of the body's vertices, world space.
@group(0) @binding(12) var<storage, read> body: array<f32>;
// Nearest item of each garment vertex in the last frame. It shortens the search and never changes
// the result.
@group(0) @binding(13) var<storage, read_write> seeds: array<u32>;

fn body_vertex(i: u32) -> vec3<f32> {
    return vec3<f32>(body[6u * i], body[6u * i + 1u], body[6u * i + 2u]);
}

fn squared(v: vec3<f32>) -> f32 {
    return dot(v, v);
}

// Squared distance to the box of a node, m².
fn to_box(node: u32, p: vec3<f32>) -> f32 {
    return squared(max(max(boxes[2u * node].xyz - p, p - boxes[2u * node + 1u].xyz), vec3<f32>()));
}

// Nearest item, the lowest one of several at the same distance; NO_ITEM when none is accepted.
fn nearest(p: vec3<f32>, seed: u32) -> u32 {
    var best = NO_ITEM;
    var bound = FAR;
    if (seed < ITEMS) {
        let found = to_item(seed, p);
        if (found < bound) {
            bound = found;
            best = seed;
        }
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
        if (node >= FIRST_LEAF) {
            for (var k = 0u; k < CAPACITY; k++) {
                let item = items[(node - FIRST_LEAF) * CAPACITY + k];
                if (item != NO_ITEM) {
                    let found = to_item(item, p);
                    if (found < bound || (found == bound && item < best)) {
                        bound = found;
                        best = item;
                    }
                }
            }
            continue;
        }
        // The nearest child so far stays on top of the stack; the others are not sorted.
        let first = height;
        for (var k = 1u; k <= 4u; k++) {
            let child = 4u * node + k;
            let distance = to_box(child, p);
            if (distance > bound) {
                continue;
            }
            var place = height;
            if (height > first && distance >= distances[height - 1u]) {
                place = height - 1u;
                nodes[height] = nodes[place];
                distances[height] = distances[place];
            }
            nodes[place] = child;
            distances[place] = distance;
            height++;
        }
    }
    return best;
}
