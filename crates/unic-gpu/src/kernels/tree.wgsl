// Refit of a complete tree of boxes with four children a node. Nodes are numbered as in a heap: the
// children of node n are 4 n + 1 to 4 n + 4.

// Number of the first leaf.
override FIRST_LEAF: u32;
// Number of leaves.
override LEAVES: u32;
// Number of places in a leaf.
override CAPACITY: u32;

const NO_ITEM = 0xffffffffu;
const FAR = 1e30;

// Items leaf after leaf; NO_ITEM fills up.
@group(0) @binding(0) var<storage, read> items: array<u32>;
// Lower and upper corner of every node, metres.
@group(0) @binding(1) var<storage, read_write> boxes: array<vec4<f32>>;
// Positions and normals of the body, world space.
@group(0) @binding(2) var<storage, read> body: array<f32>;

fn body_vertex(i: u32) -> vec3<f32> {
    return vec3<f32>(body[6u * i], body[6u * i + 1u], body[6u * i + 2u]);
}

//{items}

@compute @workgroup_size(64)
fn refit_leaves(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= LEAVES) {
        return;
    }
    var low = vec3<f32>(FAR);
    var high = vec3<f32>(-FAR);
    for (var k = 0u; k < CAPACITY; k++) {
        let item = items[id.x * CAPACITY + k];
        if (item != NO_ITEM) {
            for (var corner = 0u; corner < CORNERS; corner++) {
                let p = body_vertex(corner_of(item, corner));
                low = min(low, p);
                high = max(high, p);
            }
        }
    }
    boxes[2u * (FIRST_LEAF + id.x)] = vec4<f32>(low, 0.0);
    boxes[2u * (FIRST_LEAF + id.x) + 1u] = vec4<f32>(high, 0.0);
}

// Refits the nodes above the leaves in one workgroup, level by level upwards.
@compute @workgroup_size(256)
fn refit_nodes(@builtin(local_invocation_index) t: u32) {
    var count = LEAVES / 4u;
    var first = (FIRST_LEAF - 1u) / 4u;
    for (; count > 0u; count /= 4u) {
        storageBarrier();
        for (var i = t; i < count; i += 256u) {
            let node = first + i;
            let child = 2u * (4u * node + 1u);
            boxes[2u * node] = min(min(boxes[child], boxes[child + 2u]), min(boxes[child + 4u], boxes[child + 6u]));
            boxes[2u * node + 1u] = max(max(boxes[child + 1u], boxes[child + 3u]), max(boxes[child + 5u], boxes[child + 7u]));
        }
        first = (first - 1u) / 4u;
    }
}
