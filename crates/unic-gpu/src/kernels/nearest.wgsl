// The nearest item of a tree. Whoever includes it says how far an item is: `to_item`, m², FAR and more
// for one that does not count.

override LEAVES_FROM: u32;
override CAPACITY: u32;
override ITEMS: u32;

const NO_ITEM = 0xffffffffu;
const FAR = 3e38;
// Three siblings stay behind on each of at most nine levels, and four children are on top.
const STACK = 32u;

@group(0) @binding(10) var<storage, read> items: array<u32>;
@group(0) @binding(11) var<storage, read> boxes: array<vec4<f32>>;
// Positions and normals of the body's vertices, world.
@group(0) @binding(12) var<storage, read> body: array<f32>;
// By garment vertex the item that was nearest before: where the search starts, and nothing else.
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

// Of several at one distance the lowest; NO_ITEM when none counts.
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
        if (node >= LEAVES_FROM) {
            for (var k = 0u; k < CAPACITY; k++) {
                let item = items[(node - LEAVES_FROM) * CAPACITY + k];
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
        // The nearest child goes on top.
        let first = height;
        for (var k = 1u; k <= 4u; k++) {
            let child = 4u * node + k;
            let distance = to_box(child, p);
            if (distance > bound) {
                continue;
            }
            var under = height;
            if (height > first && distance >= distances[height - 1u]) {
                under = height - 1u;
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
